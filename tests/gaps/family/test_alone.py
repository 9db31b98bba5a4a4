"""Fillers that look at no other marker, by numbers worked out by hand."""

import numpy as np
import pytest

from handclean.gaps.family import average, last, linear
from handclean.gaps.tracks import Refused


def line(frames, step):
    """(T, 1, 3) a marker of constant velocity."""
    return np.outer(np.arange(float(frames)), step)[:, None]


STEP = np.array([0.001, -0.002, 0.0005])  # [m/frame]


def test_last_holds_the_last_place(bodies):
    fill = last.prepare(bodies.without(line(60, STEP), (0, 40, 50)))
    np.testing.assert_array_equal(
        fill(bodies.gap(0, 40, 50)).places, np.tile(39.0 * STEP, (10, 1))
    )


@pytest.mark.parametrize("filler", [average, linear])
def test_a_constant_velocity_is_restored(bodies, filler):
    whole = line(60, STEP)
    path = filler.prepare(bodies.without(whole, (0, 40, 50)))(bodies.gap(0, 40, 50))
    np.testing.assert_allclose(path.places, whole[40:50, 0], atol=1e-15)


def test_average_takes_the_steps_of_a_third_of_a_second(bodies):
    whole = np.zeros((100, 1, 3))
    whole[:, 0, 0] = np.where(np.arange(100) < 47, 0.0, 0.033)  # [m]: one step
    for start, step in ((80, 0.001), (81, 0.0)):  # 33 frames at 100 Hz
        fill = average.prepare(bodies.without(whole, (0, start, 90)))
        path = fill(bodies.gap(0, start, 90)).places[:, 0]
        expected = 0.033 + step * np.arange(1, 90 - start + 1)
        np.testing.assert_allclose(path, expected, atol=1e-12)


def test_average_skips_steps_that_are_not_known(bodies):
    whole = line(60, STEP)
    tracks = bodies.without(whole, (0, 30, 35), (0, 40, 50))
    path = average.prepare(tracks)(bodies.gap(0, 40, 50))
    np.testing.assert_allclose(path.places, whole[40:50, 0], atol=1e-15)
    lone = bodies.without(whole, (0, 0, 39), (0, 40, 50))
    with pytest.raises(Refused, match="no velocity is known"):
        average.prepare(lone)(bodies.gap(0, 40, 50))


def test_linear_divides_the_way_evenly(bodies):
    whole = np.zeros((10, 1, 3))
    whole[5, 0], whole[2, 0] = [3.0, 6.0, -9.0], [0.0, 0.0, 3.0]
    path = linear.prepare(bodies.without(whole, (0, 3, 5)))(bodies.gap(0, 3, 5))
    np.testing.assert_allclose(path.places, [[1.0, 2.0, -1.0], [2.0, 4.0, -5.0]])
