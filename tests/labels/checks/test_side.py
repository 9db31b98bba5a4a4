"""Points of the other hand are refused, in one line."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from handclean.errors import HandcleanError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.io.hdf5.prior import read_prior
from handclean.labels.checks import side
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


@pytest.mark.parametrize("seed", range(12))
def test_no_more_frames_are_looked_at_than_decide_it(monkeypatch, seed):
    """The verdict is that of the median over all five frames."""
    rng = np.random.default_rng(seed)
    subject = template_subject(load_marker_set("maycock26"))
    scores = rng.uniform(0.8, 1.2, side.MIRROR_FRAMES) * side.MIRROR_RATIO
    fits = [
        SimpleNamespace(score=score, chosen=np.zeros(26), rms=0.004) for score in scores
    ]
    looked = iter(fits)
    monkeypatch.setattr(side, "is_odd", lambda *_: True)
    monkeypatch.setattr(side, "make_target", lambda *_: SimpleNamespace(spacing=1.0))
    monkeypatch.setattr(side, "find_in_frame", lambda *_: next(looked))
    result = SimpleNamespace(
        chosen=np.zeros((40, 26), int), tracked=np.ones(40, bool), rms=np.ones(40)
    )
    setup = SimpleNamespace(labelling=SimpleNamespace(alpha=1.0))
    if np.median(scores) < side.MIRROR_RATIO:
        with pytest.raises(HandcleanError, match="mirror image"):
            side.expect_side(None, subject, result, None, setup)
        assert not list(looked)
    else:
        side.expect_side(None, subject, result, None, setup)
        worse = np.cumsum(scores >= side.MIRROR_RATIO)
        assert len(list(looked)) == 5 - 1 - np.argmax(worse == 3)
