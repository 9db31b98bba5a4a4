"""The contract every gap filler keeps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handclean.gaps.fill import FILLERS, fill
from handclean.gaps.settings import METHODS, FillConfig
from handclean.hand.model import neutral_pose
from handclean.recording import Origin

pytestmark = pytest.mark.parametrize("method", METHODS)

FRAMES = 80


@st.composite
def some_gaps(draw, markers=17):
    """(label number, start, stop) of a few gaps, also ones that must stay open."""
    found = []
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, FRAMES - 1))
        found.append(
            (draw(st.integers(0, markers - 1)), start, start + draw(st.integers(1, 30)))
        )
    return found


def test_every_method_has_a_filler(method):
    assert method in FILLERS
    assert set(FILLERS) == set(METHODS)


@given(gaps=some_gaps(), seed=st.integers(0, 50))
@settings(max_examples=30)
def test_measured_samples_come_back_bit_for_bit(scenes, method, gaps, seed):
    rng = np.random.default_rng(seed)
    whole = scenes.take(scenes.waving(rng, FRAMES), 2e-4, rng)
    take = scenes.without(whole, *((scenes.labels[m], a, b) for m, a, b in gaps))
    filled, figures = fill(take, scenes.subject, settings=FillConfig(method=method))
    before, after = take.markers, filled.markers
    measured = before.measured
    np.testing.assert_array_equal(
        after.positions[measured].view(np.uint64),
        before.positions[measured].view(np.uint64),
    )
    np.testing.assert_array_equal(after.origin[measured], before.origin[measured])
    new = after.origin == Origin.FILLED
    assert not (new & measured).any()
    assert np.isfinite(after.positions[new]).all()
    assert np.isnan(after.positions[~new & ~measured]).all()
    assert figures.filled_samples == new.sum()
    assert figures.missing_samples == (~measured).sum()


def test_a_hand_carried_along_a_straight_line_is_restored(scenes, method):
    poses = np.tile(neutral_pose(scenes.model.tree), (FRAMES, 1))
    poses[:, 7:] = 0.3
    poses[:, :3] = np.outer(np.arange(FRAMES), [0.001, -0.002, 0.0005])  # [m]
    whole = scenes.take(poses)
    take = scenes.without(
        whole, ("R_INDEX_TIP", 20, 45), (("R_RING_MID", "R_HAND_IN"), 30, 50)
    )
    filled = fill(take, scenes.subject, settings=FillConfig(method=method))[0].markers
    new = filled.origin == Origin.FILLED
    if method != "rigid":  # no bone has four markers: nothing to be rigid with
        assert new.sum() == 65
    away = filled.positions[new] - whole.markers.positions[new]
    assert np.abs(away).max(initial=0.0) < 1e-6  # one micrometre


@pytest.mark.parametrize(
    ("start", "stop", "why"),
    [
        (0, 10, "reaches the start of the take"),
        (70, 80, "reaches the end of the take"),
        (10, 61, "longer than max_gap_s = 0.5 s"),
        (3, 10, "too little known beside it"),
        (0, 80, "missing in all of the take"),
    ],
)
def test_what_cannot_be_filled_stays_open_and_says_why(
    scenes, method, rng, start, stop, why
):
    whole = scenes.take(scenes.waving(rng, FRAMES))
    take = scenes.without(whole, ("R_INDEX_TIP", start, stop))
    filled, figures = fill(take, scenes.subject, settings=FillConfig(method=method))
    np.testing.assert_array_equal(filled.markers.origin, take.markers.origin)
    assert (figures.gaps, figures.filled, figures.left_open) == (1, 0, 1)
    (event,) = filled.events
    assert (event.start, event.stop) == (start, stop)
    assert event.text.startswith("gap in R_INDEX_TIP: left open, " + why)


def test_filling_twice_is_filling_once(scenes, method, rng):
    whole = scenes.take(scenes.waving(rng, FRAMES), 3e-4, rng)
    gaps = ("R_LITTLE_TIP", 20, 40), ("R_LITTLE_PROX", 30, 50), ("R_HAND_IN", 0, 9)
    take = scenes.without(whole, *gaps)
    once = fill(take, scenes.subject, settings=FillConfig(method=method))[0]
    twice = fill(once, scenes.subject, settings=FillConfig(method=method))[0]
    for part in ("positions", "origin", "sigma"):
        one, two = getattr(once.markers, part), getattr(twice.markers, part)
        np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(
        once.motions["right"].angles, twice.motions["right"].angles
    )
    assert once.events == twice.events


def test_the_ends_of_a_filled_gap_meet_what_was_measured(scenes, method, rng):
    whole = scenes.take(scenes.waving(rng, FRAMES))
    take = scenes.without(whole, ("R_MIDDLE_MID", 30, 55))
    filled = fill(take, scenes.subject, settings=FillConfig(method=method))[0].markers
    path = filled.positions[:, scenes.column("R_MIDDLE_MID")]
    if method == "rigid":
        assert np.isnan(path[30:55]).all()
        return
    truth = whole.markers.positions[:, scenes.column("R_MIDDLE_MID")]
    usual = np.linalg.norm(np.diff(truth, axis=0), axis=1).max()
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert steps[[29, 54]].max() < 2.0 * usual
