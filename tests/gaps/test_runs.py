"""Which gaps there are and which may be bridged."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import arrays

from handclean.gaps.runs import (
    AT_END,
    AT_START,
    NO_SEED,
    THROUGHOUT,
    TOO_LONG,
    Limits,
    clusters_of,
    gaps_of,
)

LIMITS = Limits(longest=20, seed=5, rate=100.0)


def known(frames, *gaps):
    mask = np.ones(frames, dtype=bool)
    for start, stop in gaps:
        mask[start:stop] = False
    return mask


@pytest.mark.parametrize(
    ("gap", "reason"),
    [
        ((30, 50), ""),
        ((30, 51), TOO_LONG),
        ((0, 10), AT_START),
        ((90, 100), AT_END),
        ((0, 100), THROUGHOUT),
        ((5, 10), ""),
        ((4, 10), NO_SEED),
        ((90, 95), ""),
        ((90, 96), NO_SEED),
    ],
)
def test_a_gap_by_itself_is_refused_for_the_reason_it_has(gap, reason):
    (cluster,) = clusters_of(known(100, gap), LIMITS)
    assert cluster.gaps[0].refused.startswith(reason)
    assert cluster.refused == bool(reason)


def test_gaps_with_enough_between_them_are_bridged_apart():
    found = clusters_of(known(100, (20, 30), (35, 45)), LIMITS)
    assert [(c.start, c.stop) for c in found] == [(20, 30), (35, 45)]


def test_gaps_with_too_little_between_them_are_bridged_at_once():
    (cluster,) = clusters_of(known(100, (20, 28), (30, 38)), LIMITS)
    assert len(cluster.gaps) == 2
    assert not cluster.refused


def judged(*gaps, frames=100):
    """Why each of these gaps stays open, without numbers; "" if it is bridged."""
    found = gaps_of(known(frames, *gaps)[:, None], LIMITS)
    assert [(gap.start, gap.stop) for gap in found] == list(gaps)
    return [gap.refused.split(":")[0] for gap in found]


def test_gaps_that_lean_on_each_other_may_be_longer_together_than_one_may_be():
    assert judged((20, 32), (35, 45)) == ["", ""]
    assert judged((20, 40), (41, 61), (63, 83)) == ["", "", ""]


@pytest.mark.parametrize(
    ("gap", "reason"),
    [
        ((52, 53), ""),
        ((51, 52), ""),
        ((51, 53), NO_SEED),
        ((54, 58), ""),
        ((53, 57), NO_SEED),
        ((55, 75), ""),
        ((54, 74), NO_SEED),
    ],
)
def test_a_gap_beside_one_that_is_too_long_is_judged_by_itself(gap, reason):
    """It needs as many known frames on each side as it has, five at most."""
    first, second = judged((20, 50), gap)
    assert first.startswith(TOO_LONG)
    assert second == reason
    mirrored = (100 - gap[1], 100 - gap[0])
    assert judged(mirrored, (50, 80))[0] == reason


def test_single_frames_at_the_ends_of_a_take_are_bridged():
    assert judged((1, 2), (98, 99)) == ["", ""]


def test_a_gap_that_nothing_supports_does_not_keep_its_neighbours_open():
    assert judged((0, 30), (32, 42), (45, 46)) == [AT_START, NO_SEED, ""]
    assert judged((54, 55), (58, 68), (70, 100)) == ["", NO_SEED, AT_END]
    # too near the long gap to be bridged with the next, but not by itself
    assert judged((20, 50), (51, 52), (54, 64))[1:] == ["", NO_SEED]


@given(mask=arrays(bool, 60))
def test_what_is_bridged_does_not_depend_on_the_direction_of_time(mask):
    there = gaps_of(mask[:, None], LIMITS)
    back = gaps_of(mask[::-1][:, None], LIMITS)
    bridged = [(gap.start, gap.stop) for gap in there if not gap.refused]
    mirrored = [(60 - gap.stop, 60 - gap.start) for gap in back if not gap.refused]
    assert bridged == mirrored[::-1]


@given(mask=arrays(bool, 60))
def test_a_gap_with_enough_known_frames_beside_it_is_bridged_whatever_else(mask):
    for gap in gaps_of(mask[:, None], LIMITS):
        sides = mask[max(gap.start - 5, 0) : gap.start], mask[gap.stop :][:5]
        if all(len(s) == 5 and s.all() for s in sides) and gap.frames <= 20:
            assert not gap.refused


def test_scattered_single_losses_need_no_five_in_a_row():
    scattered = known(100, (20, 21), (24, 25), (28, 29))
    assert all(not cluster.refused for cluster in clusters_of(scattered, LIMITS))


def test_a_gap_beside_an_open_end_is_refused_when_nothing_lies_between():
    found = gaps_of(known(100, (0, 10), (12, 20))[:, None], LIMITS)
    assert [gap.refused.split(":")[0] for gap in found] == [AT_START, NO_SEED]


@given(mask=arrays(bool, (60, 2)))
def test_gaps_are_the_unknown_frames_of_each_column(mask):
    again = np.ones_like(mask)
    for gap in gaps_of(mask, LIMITS):
        again[gap.start : gap.stop, gap.column] = False
        if not gap.refused:
            assert gap.frames <= LIMITS.longest
            assert 0 < gap.start < gap.stop < 60
    np.testing.assert_array_equal(again, mask)
