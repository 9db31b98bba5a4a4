"""Stretches of a mask."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handclean.arrays import runs


@given(mask=arrays(bool, st.integers(0, 40)))
def test_runs_are_where_the_mask_is_true_and_nowhere_else(mask):
    again = np.zeros_like(mask)
    for start, stop in runs(mask):
        assert stop > start
        assert not again[max(start - 1, 0) : stop].any()  # runs do not touch
        again[start:stop] = True
    np.testing.assert_array_equal(again, mask)
