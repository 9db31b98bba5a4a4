"""Smooth paths of one marker against plain solutions of what they minimise."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from handclean.gaps.family import c1, cubic, spline
from handclean.gaps.family.cubic import END_FRAMES
from handclean.gaps.tracks import Refused


def least_second_differences(column, start, stop):
    """Oracle: the papers' system, one unknown a frame, solved by least squares."""
    frames = np.arange(start - 2, stop + 2)
    differences = np.zeros((len(frames) - 2, len(frames)))
    for row in range(len(frames) - 2):
        differences[row, row : row + 3] = [1.0, -2.0, 1.0]
    known = np.r_[0, 1, len(frames) - 2, len(frames) - 1]
    unknown = np.arange(2, len(frames) - 2)
    right = -differences[:, known] @ column[frames[known]]
    return np.linalg.lstsq(differences[:, unknown], right, rcond=None)[0]


@pytest.mark.parametrize("filler", [cubic, c1, spline])
def test_a_parabola_is_restored(bodies, filler):
    time = np.arange(60.0)[:, None]
    whole = (1e-4 * time**2 * [1.0, -2.0, 0.5] + 1e-3 * time)[:, None]
    path = filler.prepare(bodies.without(whole, (0, 20, 45)))(bodies.gap(0, 20, 45))
    np.testing.assert_allclose(path.places, whole[20:45, 0], atol=1e-9)


def test_c1_solves_the_printed_system(bodies, rng):
    whole = rng.normal(size=(40, 1, 3))
    path = c1.prepare(bodies.without(whole, (0, 12, 27)))(bodies.gap(0, 12, 27))
    expected = least_second_differences(whole[:, 0], 12, 27)
    np.testing.assert_allclose(path.places, expected, atol=1e-9)


def test_c1_needs_two_samples_on_each_side(bodies, rng):
    whole = rng.normal(size=(40, 1, 3))
    for gaps in (((0, 1, 9),), ((0, 20, 39),), ((0, 20, 30), (0, 31, 33))):
        with pytest.raises(Refused, match="two samples on each side"):
            c1.prepare(bodies.without(whole, *gaps))(bodies.gap(*gaps[0]))


def test_noise_grows_with_the_gap_for_c1_and_less_for_a_fit(bodies, rng):
    """Errata: 5.5 times over 20 frames, 25 times over 100."""
    noise = rng.normal(size=(130, 400, 3))
    for frames, times in ((20, 5.5), (100, 25.0)):
        gap = 10, 10 + frames
        middle = 10 + frames // 2
        off = {}
        for filler in (c1, cubic):
            tracks = bodies.without(noise, (list(range(400)), *gap))
            fill = filler.prepare(tracks)
            paths = [fill(bodies.gap(m, *gap)).places for m in range(400)]
            off[filler] = np.sqrt(np.mean(np.array(paths)[:, middle - 10] ** 2))
        assert off[c1] == pytest.approx(times, rel=0.2)
        assert off[cubic] < 0.9 * off[c1]


def test_cubic_leaves_both_ends_as_the_fitted_parabolas_do(bodies, rng):
    whole = bodies.whole(rng, 120, markers=1)
    path = cubic.prepare(bodies.without(whole, (0, 50, 90)))(bodies.gap(0, 50, 90))
    ends = []
    for end, step in ((49, -1), (90, 1)):
        frames = end + step * np.arange(END_FRAMES)
        fitted = np.polynomial.polynomial.polyfit(frames - end, whole[frames, 0], 2)
        ends.append((whole[end, 0], fitted[1]))
    (x0, v0), (x1, v1) = ends
    s = np.arange(1, 41)[:, None] / 41.0
    expected = (
        (2 * s**3 - 3 * s**2 + 1) * x0
        + (s**3 - 2 * s**2 + s) * 41.0 * v0
        + (3 * s**2 - 2 * s**3) * x1
        + (s**3 - s**2) * 41.0 * v1
    )
    np.testing.assert_allclose(path.places, expected, atol=1e-12)


def test_spline_goes_through_ten_samples_on_each_side_across_other_gaps(bodies, rng):
    whole = bodies.whole(rng, 120, markers=1)
    tracks = bodies.without(whole, (0, 30, 35), (0, 45, 70))
    path = spline.prepare(tracks)(bodies.gap(0, 45, 70))
    frames = np.r_[35:45, 70:80]
    expected = CubicSpline(frames, whole[frames, 0])(np.arange(45, 70))
    np.testing.assert_allclose(path.places, expected, atol=1e-12)
