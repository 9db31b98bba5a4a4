"""Readings without their noise."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.glove.smooth import smoothed, smoothed_chunks, width


def slowly(times, values, cutoff):
    """The same by a fit of every frame's parabola."""
    size = width(cutoff)
    out = values.copy()
    for t in range(len(times)):
        for s in range(values.shape[1]):
            apart = (times - times[t]) / size
            near = (np.abs(apart) <= 4.5) & np.isfinite(values[:, s])
            if not np.isfinite(values[t, s]) or near.sum() < 3:
                continue
            root = np.exp(-0.25 * apart[near] ** 2)
            matrix = root[:, None] * apart[near, None] ** np.arange(3)
            right = root * values[near, s]
            out[t, s] = np.linalg.lstsq(matrix, right, rcond=None)[0][0]
    return out


def test_it_is_a_parabola_through_neighbours(rng):
    times = np.cumsum(rng.uniform(0.5, 1.5, 80)) / 60.0
    values = rng.normal(size=(80, 2))
    values[10:13, 0] = np.nan
    values[40, 1] = np.nan
    np.testing.assert_allclose(
        smoothed(times, values, 8.0), slowly(times, values, 8.0), atol=1e-9
    )


@given(st.integers(0, 2**31), st.floats(2.0, 30.0), st.integers(30, 200))
def test_parabolas_pass_unchanged_to_their_ends(seed, cutoff, count):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.8, 1.2, count)) / 100.0
    a, b, c = rng.normal(size=3)
    values = (a + b * times + c * times**2)[:, None]
    np.testing.assert_allclose(smoothed(times, values, cutoff), values, atol=1e-7)


def test_the_gain_falls_to_its_half_power_at_the_cutoff():
    times = np.arange(6000) / 500.0
    for frequency, gain in ((1.0, 1.0), (4.0, 0.97), (8.0, 0.707), (30.0, 0.0)):
        wave = np.sin(2.0 * np.pi * frequency * times)[:, None]
        out = smoothed(times, wave, 8.0)[500:-500]
        inside = wave[500:-500]
        assert (out * inside).sum() / (inside**2).sum() == pytest.approx(gain, abs=0.01)


@given(st.lists(st.integers(1, 40), min_size=1, max_size=30), st.integers(0, 2**31))
def test_chunks_of_any_size_give_the_same_bytes(sizes, seed):
    rng = np.random.default_rng(seed)
    count = sum(sizes)
    times = np.cumsum(rng.uniform(0.5, 1.5, count)) / 60.0
    values = rng.normal(size=(count, 2))
    values[rng.random(values.shape) < 0.1] = np.nan
    ends = np.cumsum([0, *sizes])
    chunks = [(times[a:b], values[a:b]) for a, b in pairwise(ends)]
    found = list(smoothed_chunks(chunks, 6.0))
    for place, whole in enumerate((times, values, smoothed(times, values, 6.0))):
        together = np.concatenate([parts[place] for parts in found])
        np.testing.assert_array_equal(together, whole)


def test_blank_and_lonely_readings_stay_as_they_are(rng):
    times = np.arange(40) / 60.0
    times[20:] += 5.0
    values = rng.normal(size=(40, 1))
    values[25:38] = np.nan
    out = smoothed(times, values, 8.0)
    assert np.isnan(out[25:38]).all()
    np.testing.assert_allclose(out[38:], values[38:])


def test_wrong_readings_stay_and_tell_nothing(rng):
    times = np.arange(60) / 60.0
    values = np.linspace(0.0, 5.0, 60)[:, None] + 100.0
    broken = values.copy()
    broken[30:32] = 255.0
    out = smoothed(times, broken, 8.0, lambda v: v >= 255.0)
    np.testing.assert_array_equal(out[30:32], 255.0)
    others = np.r_[0:30, 32:60]
    np.testing.assert_allclose(out[others], values[others], atol=1e-9)


def test_no_cutoff_leaves_readings_alone(rng):
    values = rng.normal(size=(9, 3))
    np.testing.assert_array_equal(smoothed(np.arange(9.0), values, 0.0), values)
