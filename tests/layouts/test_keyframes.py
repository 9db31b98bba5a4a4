"""Keyframes stand far apart."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.errors import HandcleanError
from handclean.layouts.keyframes import farthest, keyframes, known_frames


def apart(rows):
    return min(np.linalg.norm(a - b) for a, b in itertools.combinations(rows, 2))


@given(count=st.integers(2, 8), seed=st.integers(0, 500))
def test_no_single_keyframe_can_be_put_farther_from_the_others(count, seed):
    angles = np.random.default_rng(seed).normal(size=(60, 4))
    chosen, least = farthest(angles, count)
    assert len(set(chosen.tolist())) == count
    assert least == pytest.approx(apart(angles[chosen]))
    for n in range(count):
        rest = angles[np.delete(chosen, n)]
        gaps = np.linalg.norm(angles[:, None] - rest, axis=2).min(axis=1)
        assert gaps[chosen[n]] == pytest.approx(gaps.max())


def test_corners_of_a_square_are_found(rng):
    inside = rng.uniform(-0.9, 0.9, (200, 2))
    corners = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    found = keyframes([inside[:100], np.vstack([inside[100:], corners])], 4)
    assert sorted(map(tuple, found)) == sorted(map(tuple, corners))


def test_frames_with_an_unknown_angle_are_left_out(rng):
    angles = rng.normal(size=(30, 3))
    angles[::2, 1] = np.nan
    assert len(known_frames([angles], 100)) == 15
    assert np.isfinite(keyframes([angles], 5)).all()
    assert len(known_frames([angles], 7)) == 7


def test_one_keyframe_is_allowed(rng):
    assert keyframes([rng.normal(size=(5, 3))], 1).shape == (1, 3)


def test_too_few_frames_are_told_with_their_number(rng):
    angles = rng.normal(size=(9, 3))
    angles[0] = np.nan
    with pytest.raises(HandcleanError, match=r"8 frames .* for 10 keyframes"):
        keyframes([angles], 10)


def test_a_motion_with_too_few_postures_is_refused():
    two = np.repeat(np.eye(2), 20, axis=0)
    with pytest.raises(HandcleanError, match="fewer than 3 postures that differ"):
        keyframes([two], 3)
