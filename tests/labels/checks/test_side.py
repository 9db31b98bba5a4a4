"""Points of the other hand are refused, in one line."""

from dataclasses import replace

import pytest

from handclean.errors import HandcleanError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.io.hdf5.prior import read_prior
from handclean.labels.label import label
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate
from handclean.tree import MIRROR


@pytest.fixture(scope="module")
def points():
    """A take of somebody's right hand."""
    settings = SimulateConfig(seed=5, duration_s=1.0, ghosts_per_s=0.0)
    return next(iter(simulate("grasp", settings))).unlabelled


@pytest.mark.parametrize("name", ["maycock26"])
def test_a_template_labels_its_own_side_only(points, name):
    template = template_subject(load_marker_set(name))
    found, figures = label(points, template, prior=read_prior())
    assert figures.followed == found.frames
    cloud = points.unlabelled
    other = replace(cloud, positions=cloud.positions * MIRROR)
    with pytest.raises(
        HandcleanError, match=r"^[^\n]*(mirror image|could be followed)"
    ):
        label(replace(points, unlabelled=other), template, prior=read_prior())
