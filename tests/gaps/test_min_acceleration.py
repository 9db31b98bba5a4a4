"""The path of least acceleration: its laws, and the papers' linear system as oracle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.gaps.min_acceleration import (
    EndFit,
    bend_of,
    bridge,
    hermite,
    nearest,
    slope_weights,
)
from handclean.gaps.runs import Cluster, Gap, Limits, clusters_of

BENT = EndFit(order=2, frames=5)


def papers_system(x0, v0, x1, v1, missing):
    """Oracle: the n x n system of Maycock III-C, velocities as frames just outside."""
    samples = np.full(missing + 4, np.nan)
    samples[:2], samples[-2:] = [x0 - v0, x0], [x1, x1 + v1]
    second = np.zeros((missing + 2, missing + 4))
    for row in range(missing + 2):
        second[row, row : row + 3] = [1.0, -2.0, 1.0]
    free = np.arange(2, missing + 2)
    fixed = np.array([0, 1, missing + 2, missing + 3])
    known = second[:, fixed] @ samples[fixed]
    return np.linalg.lstsq(second[:, free], -known, rcond=None)[0]


def bridged(values, known, fit=BENT, limits=None):
    limits = limits or Limits(longest=len(values), seed=5, rate=100.0)
    filled = values.copy()
    for cluster in clusters_of(known, limits):
        for part in bridge(values, known, cluster, fit, 10):
            filled[part.start : part.stop] = part.path
    return filled


def test_the_path_is_the_solution_of_the_papers_system(rng):
    for missing in (1, 2, 7, 40):
        x0, x1 = rng.normal(size=2)
        v0, v1 = rng.normal(size=2)
        want = papers_system(x0, v0, x1, v1, missing)
        # their frames just outside sit on the cubic, whose slope at the end is this:
        cubic = np.polyfit(
            [-1.0, 0.0, missing + 1.0, missing + 2.0], [x0 - v0, x0, x1, x1 + v1], 3
        )
        slope = np.polyder(cubic)
        share = np.arange(1, missing + 1) / (missing + 1.0)
        ends = (x0, np.polyval(slope, 0.0), x1, np.polyval(slope, missing + 1.0))
        got = hermite(share, missing + 1.0, tuple(np.array([e]) for e in ends))
        np.testing.assert_allclose(got[:, 0], want, atol=1e-9 * np.abs(want).max())


@given(
    bumps=st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    ends=st.lists(st.floats(-1, 1), min_size=4, max_size=4),
)
def test_no_path_with_the_same_ends_has_less_acceleration(bumps, ends):
    s = np.linspace(0.0, 1.0, 2001)
    x0, v0, x1, v1 = (np.array([e]) for e in ends)
    path = hermite(s, 1.0, (x0, v0, x1, v1))[:, 0]
    bump = sum(b * np.sin(np.pi * (k + 1) * s) for k, b in enumerate(bumps))
    bump *= (s * (1.0 - s)) ** 2  # changes neither ends nor their velocities

    def effort(x):
        return np.mean((np.diff(x, 2) * 2000**2) ** 2)

    assert effort(path) <= effort(path + bump) * (1 + 1e-6) + 1e-9
    assert bend_of(1.0, x0, v0, x1, v1)[0] == pytest.approx(
        effort(path), rel=1e-2, abs=1e-6
    )


def test_a_parabola_is_restored_whatever_the_gap(rng):
    t = np.arange(60.0)
    values = np.outer(0.01 * t**2, [1.0, -2.0]) + np.outer(t, [0.3, 0.1]) + 1.0
    for start, stop in ((10, 11), (20, 50)):
        known = np.ones(60, dtype=bool)
        known[start:stop] = False
        np.testing.assert_allclose(bridged(values, known), values, atol=1e-9)


@given(seed=st.integers(0, 1000))
def test_a_straight_line_is_restored_through_any_cluster_of_gaps(seed):
    rng = np.random.default_rng(seed)
    known = rng.random(80) < 0.5
    known[:12] = known[-12:] = True
    line = np.outer(np.arange(80.0), [0.01, -0.02])
    np.testing.assert_allclose(bridged(line, known), line, atol=1e-9)


@given(ends=st.lists(st.floats(-1, 1), min_size=3, max_size=3))
def test_a_path_ends_unbent_where_a_single_frame_is_known(ends):
    """No path with the other end's velocity has less acceleration."""
    x0, x1, v0 = ends
    before = x0 + v0 * np.arange(-11.0, 1.0)
    values = np.concatenate([before, np.full(20, np.nan), [x1]])[:, None]
    known = np.isfinite(values[:, 0])
    (part,) = bridge(
        values, known, Cluster(gaps=(Gap(column=0, start=12, stop=32),)), BENT, 10
    )
    path = np.concatenate([[x0], part.path[:, 0], [x1]])
    bends = np.diff(path, 2)
    assert abs(bends[-1]) <= 0.06 * np.abs(bends).max() + 1e-9
    slopes = [np.array([v]) for v in (1.5 * (x1 - x0) / 21.0 - 0.5 * v0, v0)]
    least = bend_of(21.0, values[11], slopes[1], values[32], slopes[0])
    assert part.bend**2 == pytest.approx(least, abs=1e-12)
    for other in (-0.01, 0.01):
        assert (
            bend_of(21.0, values[11], slopes[1], values[32], slopes[0] + other) > least
        )
    mirror = bridge(
        values[::-1],
        known[::-1],
        Cluster(gaps=(Gap(column=0, start=1, stop=21),)),
        BENT,
        10,
    )
    np.testing.assert_allclose(mirror[0].path[::-1], part.path, atol=1e-12)


def test_between_two_single_frames_the_path_is_straight():
    values = np.array([[1.0], [0.0], [0.0], [4.0]])
    known = np.array([True, False, False, True])
    gap = Gap(column=0, start=1, stop=3)
    (part,) = bridge(values, known, Cluster(gaps=(gap,)), BENT, 10)
    np.testing.assert_allclose(part.path[:, 0], [2.0, 3.0])


def test_velocities_come_from_sure_frames_where_the_end_is_one():
    values = np.arange(40.0)[:, None]
    values[30:] = 7.0
    known, sure = np.ones(40, dtype=bool), np.ones(40, dtype=bool)
    known[20:26], sure[30:] = False, False
    cluster = Cluster(gaps=(Gap(column=0, start=20, stop=26),))
    fit = EndFit(order=1, frames=8)
    (led,) = bridge(values, known, cluster, fit, 10, sure)
    np.testing.assert_allclose(led.path, values[20:26], atol=1e-9)
    (misled,) = bridge(values, known, cluster, fit, 10)
    assert np.abs(misled.path - values[20:26]).max() > 0.5


def test_paths_of_a_cluster_meet_the_frames_between_its_gaps(rng):
    t = np.arange(70.0)
    values = np.sin(t / 9.0)[:, None] + rng.normal(scale=1e-3, size=(70, 1))
    known = np.ones(70, dtype=bool)
    known[25:33] = known[35:43] = False
    filled = bridged(values, known)
    np.testing.assert_array_equal(filled[known], values[known])
    assert np.abs(np.diff(filled[:, 0])).max() < 0.13  # nowhere a jump
    assert np.abs(filled - np.sin(t / 9.0)[:, None]).max() < 0.02


def test_slopes_of_a_fit_carry_less_noise_into_a_gap_than_single_frames(rng):
    noise = rng.normal(size=(4000, 10))
    back = -np.arange(10)
    fitted = noise @ slope_weights(back, 1)
    single = noise[:, :2] @ slope_weights(back[:2], 1)
    # errata: single frames amplify noise 25 times over 100 frames; T/8 of both slopes
    assert np.std(single) * 100 / 8 * np.sqrt(2) == pytest.approx(25, rel=0.1)
    assert np.std(fitted) < 0.1 * np.std(single)


@pytest.mark.parametrize("order", [1, 2])
def test_slope_weights_differentiate_polynomials_at_the_end(rng, order):
    times = -np.array([0, 1, 3, 4, 8])  # with frames missing
    coefficients = rng.normal(size=order + 1)
    samples = np.polyval(coefficients, times)
    slope = np.polyval(np.polyder(coefficients), 0.0)
    assert slope_weights(times, order) @ samples == pytest.approx(slope)


def test_nearest_frames_come_nearest_first_and_skip_the_unknown():
    known = np.array([1, 1, 0, 1, 0, 0, 1, 1], dtype=bool)
    np.testing.assert_array_equal(nearest(known, 3, -1, 5, 10), [3, 1, 0])
    np.testing.assert_array_equal(nearest(known, 6, 1, 5, 10), [6, 7])
