"""A small problem: the coarse template hand and a motion along five directions."""

import numpy as np
import pytest

from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.layouts.feasible import feasible
from handclean.layouts.problem import make_problem, on_bones
from handclean.layouts.settings import LayoutConfig


@pytest.fixture(scope="session")
def tree():
    return template("left")


@pytest.fixture(scope="session")
def surface(tree):
    return template_surface(tree, coarse=True)


@pytest.fixture(scope="session")
def takes(tree):
    """Two takes that move all joints along five directions."""
    rng = np.random.default_rng(7)
    middle, half = tree.limits.mean(axis=1), np.ptp(tree.limits, axis=1) / 2.0
    ways = rng.normal(size=(5, len(half))) / 3.0
    return [
        middle + half * np.clip(rng.uniform(-1.0, 1.0, (80, 5)) @ ways, -1.0, 1.0)
        for _ in range(2)
    ]


@pytest.fixture(scope="session")
def few():
    """Settings of a small search."""
    return LayoutConfig(
        markers=5, dimensions=4, keyframes=4, particles=60, iterations=25, patience=9
    )


@pytest.fixture(scope="session")
def model(surface, tree, few):
    return on_bones(surface, tree, feasible(surface, tree, few))


@pytest.fixture(scope="session")
def problem(model, tree, takes, few):
    return make_problem(model, takes, tree.hinges, few)
