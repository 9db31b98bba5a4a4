"""Find the layout of k markers that suits a motion best."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError
from handclean.kernels.layouts import Weights
from handclean.layouts.annealing import anneal
from handclean.layouts.greedy import greedy
from handclean.layouts.objective import energies, weights_of
from handclean.layouts.particles import swarm
from handclean.layouts.problem import Problem
from handclean.layouts.ranking import BY_HAND, wheatland
from handclean.layouts.search import Found, Watch
from handclean.layouts.settings import LayoutConfig

Method = Callable[
    [Problem, LayoutConfig, np.random.Generator, Ints | None, Watch | None], Found
]

METHODS: Mapping[str, Method] = {
    "anneal": anneal,
    "swarm": swarm,
    "greedy": greedy,
    "wheatland": wheatland,
    **BY_HAND,
}
"""The ways to find a layout. Those of Wheatland and Hoyet do not look at the energy."""

SEARCHES = ("anneal", "swarm", "greedy")
"""Those that lower the energy."""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """k markers, and what there is to say about them.

    Attributes
    ----------
    method : how it was found.
    chosen : (k,) candidates, in the order of the hand's bones.
    labels : what the problem's model calls them: numbers of vertices, or markers.
    bones : names of the bones they sit on.
    energy, condition, distance, hidden : the energy and its three terms, the terms
        without weights; the energy is infinite if the layout leaves something
        undetermined (only layouts that were not searched for do).
    weights : how much each term counts.
    kappa : (F,) condition number in each keyframe.
    smallest_m : [m] smallest distance of two markers in any keyframe; infinite of one.
    weighed : how many layouts were weighed.
    history : (H, 2) layouts weighed and least energy so far, after each step.
    stopped : why the search ended.
    """

    method: str
    chosen: Ints
    labels: tuple[str, ...]
    bones: tuple[str, ...]
    energy: float
    condition: float
    distance: float
    hidden: float
    weights: Weights
    kappa: Floats
    smallest_m: float
    weighed: int
    history: Floats
    stopped: str


def optimize(
    problem: Problem,
    settings: LayoutConfig,
    rng: np.random.Generator,
    *,
    start: Ints | None = None,
    watch: Watch | None = None,
) -> Layout:
    """Find a layout.

    Parameters
    ----------
    problem : candidates and what they are judged by.
    settings : method and what it needs, markers, weights. Sets made by hand say
        themselves how many markers there are.
    start : (S, k) layouts to begin with.
    watch : called as the search goes on.

    Raises
    ------
    HandcleanError
        If k markers cannot determine the posture, or there are fewer candidates.
    """
    if settings.method not in BY_HAND:
        _check(problem, settings)
    found = METHODS[settings.method](problem, settings, rng, start, watch)
    layout = weighed(problem, found, settings)
    if settings.method in SEARCHES and not np.isfinite(layout.energy):
        joints = " (two for each finger of four joints)" if settings.full else ""
        raise HandcleanError(
            f"no layout of {settings.markers} markers was found that determines the "
            f"{len(problem.columns)} unknowns; take more markers{joints} or fewer "
            "dimensions"
        )
    return layout


def weighed(problem: Problem, found: Found, settings: LayoutConfig) -> Layout:
    """Say all about a layout that was found."""
    model = problem.model
    order = np.lexsort((found.layout, model.bone[found.layout]))
    chosen = found.layout[order]
    terms = energies(problem, chosen[None], settings)
    return Layout(
        method=settings.method,
        chosen=chosen,
        labels=tuple(model.labels[n] for n in chosen),
        bones=tuple(model.tree.bones[model.bone[n]] for n in chosen),
        energy=float(terms.total[0]),
        condition=float(terms.condition[0]),
        distance=float(terms.distance[0]),
        hidden=float(terms.hidden[0]),
        weights=weights_of(settings),
        kappa=terms.kappa[0],
        smallest_m=float(terms.smallest_m[0]),
        weighed=int(found.history[-1, 0]),
        history=found.history,
        stopped=found.stopped,
    )


def _check(problem: Problem, settings: LayoutConfig) -> None:
    unknowns, count = len(problem.columns), len(problem.home)
    if settings.markers > count:
        raise HandcleanError(
            f"{settings.markers} markers cannot be placed on {count} candidates; allow "
            "more"
        )
    if settings.w1 > 0.0 and settings.markers < problem.needed:
        instead = "" if not settings.full else " or the posture subspace"
        raise HandcleanError(
            f"{settings.markers} markers give {3 * settings.markers} equations for "
            f"{unknowns} unknowns; take {problem.needed} markers or more, or fewer "
            f"dimensions{instead}"
        )
