"""Smoothing takes away what is fast, shifts nothing, and stays within its run."""

import subprocess
import sys

import numpy as np
import pytest

from handclean.gaps.smooth import padding_frames, smooth

RATE = 120.0
CUTOFF = 6.0
T = np.arange(1200) / RATE
ALL = np.ones((len(T), 1), dtype=bool)
INNER = slice(240, -240)


def smoothed(path, cutoff=CUTOFF, seen=ALL):
    return smooth(path, seen, cutoff, RATE).positions


def response(frequency, cutoff=CUTOFF):
    """Complex gain of a sine of 1 cm, from the middle of the run."""
    wave = np.exp(2j * np.pi * frequency * T)
    path = 0.01 * np.stack([wave.real, wave.imag, wave.real], axis=1)[:, None]
    out = smoothed(path, cutoff)[INNER, 0]
    return np.mean((out[:, 0] + 1j * out[:, 1]) * wave[INNER].conj()) / 0.01


def fourth_order(frequency, cutoff=CUTOFF):
    """The gain that the module promises, of both passes with the corrected cut-off."""
    w, wc = (np.tan(np.pi * f / RATE) for f in (frequency, cutoff))
    return 1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * (w / wc) ** 4)


def test_slow_motion_passes_and_fast_goes():
    assert abs(response(1.0)) == pytest.approx(1.0, abs=1e-3)
    assert abs(response(40.0)) < 2e-4


@pytest.mark.parametrize("frequency", [0.5, 1.0, 3.0, 6.0, 12.0, 25.0, 40.0])
@pytest.mark.parametrize("cutoff", [3.0, 6.0, 20.0])
def test_the_response_is_that_of_the_corrected_filter_without_phase(frequency, cutoff):
    gain = response(frequency, cutoff)
    assert gain.real == pytest.approx(fourth_order(frequency, cutoff), abs=1e-6)
    assert abs(gain.imag) < 1e-6


def test_the_gain_at_the_cutoff_is_half_the_power():
    assert abs(response(CUTOFF)) == pytest.approx(np.sqrt(0.5), abs=1e-6)


def test_nothing_is_shifted_in_time():
    path = np.zeros((len(T), 1, 3))
    path[600, 0] = 1.0
    bump = smoothed(path)[:, 0, 0]
    assert bump.argmax() == 600
    np.testing.assert_allclose(bump[601:800], bump[599:400:-1], atol=1e-12)


@pytest.mark.parametrize("cutoff", [1.0, 3.0, 6.0, 20.0])
def test_a_marker_that_moves_evenly_is_not_held_back_at_the_ends(cutoff):
    line = T[:, None, None] * np.array([1.0, -0.5, 0.0])  # [m/s]
    assert np.abs(smoothed(line, cutoff) - line).max() < 6e-4


def test_each_run_is_smoothed_as_if_it_were_alone(rng):
    path, seen = rng.normal(scale=0.01, size=(len(T), 2, 3)), np.ones((len(T), 2), bool)
    seen[400:410, 0] = False
    path[400:410, 0] = 7.0
    found = smooth(path, seen, CUTOFF, RATE)
    np.testing.assert_array_equal(found.done, seen)
    np.testing.assert_array_equal(found.positions[400:410, 0], 7.0)
    for rows, m in ((slice(0, 400), 0), (slice(410, None), 0), (slice(None), 1)):
        part = path[rows, m][:, None]
        alone = smooth(part, np.ones(part.shape[:2], bool), CUTOFF, RATE)
        np.testing.assert_array_equal(alone.positions[:, 0], found.positions[rows, m])


def test_runs_that_are_too_short_are_left(rng):
    least = padding_frames(CUTOFF, RATE) + 1
    seen = np.zeros((len(T), 1), bool)
    seen[10 : 10 + least], seen[100 : 100 + least - 1] = True, True
    path = rng.normal(size=(len(T), 1, 3))
    found = smooth(path, seen, CUTOFF, RATE)
    assert np.flatnonzero(found.done[:, 0]).tolist() == list(range(10, 10 + least))
    np.testing.assert_array_equal(found.positions[~found.done], path[~found.done])
    assert (found.positions[found.done] != path[found.done]).any(axis=1).all()


@pytest.mark.parametrize("cutoff", [1e-9, 0.02, 59.999])
def test_extreme_cutoffs_give_numbers(rng, cutoff):
    found = smooth(rng.normal(size=(1200, 1, 3)), ALL, cutoff, RATE)
    assert np.isfinite(found.positions).all()
    assert found.done.any() == (cutoff > 1.0)


def test_places_beyond_all_measure_are_left(rng):
    path = rng.normal(size=(1200, 2, 3))
    path[:9, 0] = 1.5e308
    found = smooth(path, ALL[:, [0, 0]], CUTOFF, RATE)
    np.testing.assert_array_equal(found.positions[:, 0], path[:, 0])
    assert found.done.all(axis=0).tolist() == [False, True]
    assert not found.done[:, 0].any()


def test_scipys_filters_are_loaded_by_those_who_smooth_only():
    code = (
        "import sys, handclean.api.fill_gaps, handclean.api.clean\n"
        "import handclean.gaps.smooth as s, numpy as np\n"
        "assert 'scipy.signal' not in sys.modules\n"
        "s.smooth(np.ones((99, 1, 3)), np.ones((99, 1), bool), 6.0, 120.0)\n"
        "assert 'scipy.signal' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
