"""The contract every gap filler keeps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handclean.gaps import fill as filling
from handclean.gaps.family.table import BASELINES
from handclean.gaps.settings import METHODS, FillConfig
from handclean.hand.model import neutral_pose
from handclean.recording import Origin

pytestmark = pytest.mark.parametrize("method", METHODS)

FRAMES = 160


def fill(take, subject, method):
    """Fill by one method, however far off to expect it."""
    settings = FillConfig(method=method, max_sigma_m=1.0)
    return filling.fill(take, subject, settings=settings)


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


@given(gaps=some_gaps(), seed=st.integers(0, 50))
@settings(max_examples=10)
def test_measured_samples_come_back_bit_for_bit(scenes, method, gaps, seed):
    rng = np.random.default_rng(seed)
    whole = scenes.take(scenes.waving(rng, FRAMES), 2e-4, rng)
    take = scenes.without(whole, *((scenes.labels[m], a, b) for m, a, b in gaps))
    filled, figures = fill(take, scenes.subject, method)
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
    filled = fill(take, scenes.subject, method)[0].markers
    new = filled.origin == Origin.FILLED
    if method == "last":  # it stays where it was
        return
    if method != "rigid":  # no bone has four markers: nothing to be rigid with
        assert new.sum() == 65
    away = filled.positions[new] - whole.markers.positions[new]
    assert np.abs(away).max(initial=0.0) < 1e-6  # one micrometre


TWO_ENDS = ("min-acceleration", "coupled", "linear", "cubic", "c1", "spline")
"""Methods that lay a path between two ends."""


@pytest.mark.parametrize(("start", "stop"), [(0, 10), (FRAMES - 10, FRAMES)])
def test_paths_between_two_ends_need_both_and_others_say_if_they_do(
    scenes, method, rng, start, stop
):
    whole = scenes.take(scenes.waving(rng, FRAMES))
    take = scenes.without(whole, ("R_INDEX_TIP", start, stop))
    filled, figures = fill(take, scenes.subject, method)
    (event,) = filled.events
    assert (event.start, event.stop) == (start, stop)
    if figures.filled:
        assert method not in TWO_ENDS
        assert event.text.startswith("gap in R_INDEX_TIP: filled by ")
        return
    np.testing.assert_array_equal(filled.markers.origin, take.markers.origin)
    assert event.text.startswith("gap in R_INDEX_TIP: left open, ")
    if method in TWO_ENDS:
        side = "start" if start == 0 else "end"
        assert f"reaches the {side} of the take" in event.text


def test_what_is_missing_throughout_stays_open(scenes, method, rng):
    whole = scenes.take(scenes.waving(rng, FRAMES))
    take = scenes.without(whole, ("R_INDEX_TIP", 0, FRAMES))
    filled, figures = fill(take, scenes.subject, method)
    np.testing.assert_array_equal(filled.markers.origin, take.markers.origin)
    assert figures.reasons == {"missing in all of the take": 1}


def test_filling_twice_is_filling_once(scenes, method, rng):
    whole = scenes.take(scenes.waving(rng, FRAMES), 3e-4, rng)
    gaps = ("R_LITTLE_TIP", 20, 40), ("R_LITTLE_PROX", 30, 50), ("R_HAND_IN", 0, 9)
    take = scenes.without(whole, *gaps)
    once = fill(take, scenes.subject, method)[0]
    twice = fill(once, scenes.subject, method)[0]
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
    filled = fill(take, scenes.subject, method)[0].markers
    path = filled.positions[:, scenes.column("R_MIDDLE_MID")]
    if method == "rigid":
        assert np.isnan(path[30:55]).all()
        return
    truth = whole.markers.positions[:, scenes.column("R_MIDDLE_MID")]
    usual = np.linalg.norm(np.diff(truth, axis=0), axis=1).max()
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    ends = [29] if method in BASELINES and BASELINES[method].causal else [29, 54]
    assert steps[ends].max() < 2.0 * usual
