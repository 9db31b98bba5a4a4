"""Which gaps there are and which may be bridged."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
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
    runs,
)

LIMITS = Limits(longest=20, seed=5, rate=100.0)


def known(frames, *gaps):
    mask = np.ones(frames, dtype=bool)
    for start, stop in gaps:
        mask[start:stop] = False
    return mask


@given(mask=arrays(bool, st.integers(0, 40)))
def test_runs_are_where_the_mask_is_true_and_nowhere_else(mask):
    again = np.zeros_like(mask)
    for start, stop in runs(mask):
        assert stop > start
        assert not again[max(start - 1, 0) : stop].any()  # runs do not touch
        again[start:stop] = True
    np.testing.assert_array_equal(again, mask)


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


def test_gaps_that_lean_on_each_other_are_refused_when_together_too_long():
    (cluster,) = clusters_of(known(100, (20, 32), (35, 45)), LIMITS)
    assert all(gap.refused.startswith(NO_SEED) for gap in cluster.gaps)


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
