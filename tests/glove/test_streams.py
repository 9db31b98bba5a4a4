"""Two clocks."""

import numpy as np
import pytest

from handclean.errors import HandcleanError
from handclean.glove.streams import at_times, find_offset


def streams(rng, offset, markers_hz=100.0):
    """Readings by one clock and rotations by another of one smooth motion."""
    freq, phase = rng.uniform(0.1, 0.7, (6, 3)), rng.uniform(0, 6, (6, 3))

    def motion(t):
        return np.sin(2 * np.pi * freq * t[:, None, None] + phase).sum(axis=1)

    glove = np.arange(0, 15, 1 / 60)
    markers = np.arange(0, 20, 1 / markers_hz)
    readings = 100 - 30 * motion(glove + offset) + rng.normal(0, 3, (len(glove), 3))
    return glove, readings, markers, motion(markers)


@pytest.mark.parametrize("offset", [-3.217, 0.0, 0.504, 4.61])
def test_the_offset_between_two_clocks_is_found(offset, rng):
    found = find_offset(*streams(rng, offset), 10.0)
    assert found.seconds == pytest.approx(offset, abs=0.004)
    assert found.correlation > 0.9
    assert found.next_best < found.correlation


def test_clocks_that_do_not_start_at_zero_make_no_difference(rng):
    glove, readings, markers, rotations = streams(rng, 1.25)
    found = find_offset(glove + 5.0, readings, markers - 2.0, rotations, 10.0)
    assert found.seconds == pytest.approx(1.25 - 7.0, abs=0.004)


def test_gaps_of_the_markers_are_bridged(rng):
    glove, readings, markers, rotations = streams(rng, 0.7)
    rotations[300:340] = np.nan
    found = find_offset(glove, readings, markers, rotations, 5.0)
    assert found.seconds == pytest.approx(0.7, abs=0.01)


def test_streams_of_different_motions_are_refused(rng):
    glove, readings, _, _ = streams(rng, 0.0)
    _, _, markers, other = streams(rng, 0.0)
    with pytest.raises(HandcleanError, match="same motion"):
        find_offset(glove, readings, markers, other, 5.0)


def test_streams_that_hardly_overlap_are_refused(rng):
    glove, readings, markers, rotations = streams(rng, 0.0)
    with pytest.raises(HandcleanError, match="overlap"):
        find_offset(glove + 100.0, readings, markers, rotations, 5.0)


def test_angles_between_frames_are_interpolated_and_gaps_stay_gaps():
    times = np.arange(10.0)
    values = 2.0 * times[:, None]
    values[5] = np.nan
    found = at_times(times, values, np.array([-1.0, 0.5, 3.0, 4.5, 8.25, 9.5]))
    np.testing.assert_allclose(found[:, 0], [np.nan, 1.0, 6.0, np.nan, 16.5, np.nan])
