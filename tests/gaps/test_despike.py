"""Spikes go, honest motion stays."""

import numpy as np
import pytest

from handclean.gaps import despike as module
from handclean.gaps.despike import despike
from handclean.gaps.noise import MIN_DIFFERENCES, noise_of
from handclean.io import files

RATE = 100.0
NOISE = 2e-4  # [m]
T = np.arange(600) / RATE
ALL = np.ones((len(T), 1), dtype=bool)
REAL = {
    "hand_embodiment/recording.tsv": ({}, 25),
    "guitar/Pick1.csv": ({"rate_hz": 120.0, "unit": "mm"}, 0),
    "c3d/sample_37/ART-Human_hands_real_no6dof.c3d": ({}, 0),
}
"""Recordings: what must be said to read them, and how many samples are spikes."""


def slow(rng):
    """(T, 1, 3) [m] a marker that moves as hands do, with noise."""
    pace, phase = rng.uniform(0.3, 2.0, 3), rng.uniform(0.0, 6.0, 3)
    path = 0.05 * np.sin(2.0 * np.pi * T[:, None] * pace + phase)
    return (path + rng.normal(scale=NOISE, size=path.shape))[:, None]


def thrown(path, start, frames, aside=0.02):
    """The path with ``frames`` frames thrown aside by so many metres."""
    path = path.copy()
    path[start : start + frames, 0, 1] += aside
    return path


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_a_spike_of_up_to_three_frames_is_replaced_by_its_neighbours_path(rng, frames):
    path = slow(rng)
    found = despike(thrown(path, 200, frames), ALL, RATE)
    assert np.flatnonzero(found.spikes[:, 0]).tolist() == list(range(200, 200 + frames))
    away = np.linalg.norm(found.positions - path, axis=2)
    assert away[found.spikes].max() < 8.0 * NOISE
    assert away[~found.spikes].max() == 0.0


def test_spikes_close_to_each_other_are_found(rng):
    path = slow(rng)
    some = thrown(thrown(thrown(path, 200, 1), 203, 2, -0.01), 208, 3)
    found = np.flatnonzero(despike(some, ALL, RATE).spikes[:, 0])
    assert found.tolist() == [200, 203, 204, 208, 209, 210]


def test_more_than_three_frames_are_no_spike(rng):
    assert not despike(thrown(slow(rng), 200, 4), ALL, RATE).spikes.any()


@pytest.mark.parametrize("at", [0, 1, 299, 298, 310, 311, 599])
def test_what_has_not_two_frames_on_both_sides_is_left(rng, at):
    seen = ALL.copy()
    seen[300:310] = False
    given = thrown(slow(rng), at, 1)
    found = despike(given, seen, RATE)
    assert not found.spikes.any()
    np.testing.assert_array_equal(found.positions, given)


def test_what_is_not_measured_is_not_looked_at(rng):
    seen, path = ALL.copy(), slow(rng)
    seen[300:310] = False
    path[300:310] = 9.0
    assert not despike(path, seen, RATE).spikes.any()


def honest(kind):
    """(T, 1, 3) [m] what is fast and no spike."""
    path = np.zeros((len(T), 1, 3))
    x = path[:, 0, 0]
    if kind == "step":  # another marker's name from here on
        x[300:] = 0.03
    elif kind == "kink":  # a hand that hits the table with 3 m/s
        x[:] = -3.0 * np.abs(T - 3.0)
    elif kind == "tremor":  # 10 Hz, 2 cm
        x[:] = 0.02 * np.sin(2.0 * np.pi * 10.0 * T)
    elif kind == "twitch":  # out and back by 1.5 mm in 20 ms
        x[300] = 0.0015
    elif kind == "tap":  # out and back by 2 cm in 80 ms
        near = np.abs(T - 3.0) < 0.04
        x[near] = 0.01 * (1.0 + np.cos(2.0 * np.pi * (T[near] - 3.0) / 0.08))
    return path


@pytest.mark.parametrize("kind", ["step", "kink", "tremor", "tap", "twitch", "rest"])
@pytest.mark.parametrize("noise", [0.0, 2e-5, 1e-3])
def test_honest_motion_is_not_touched(rng, kind, noise):
    path = honest(kind)
    path = path + noise * rng.normal(size=path.shape)
    assert not despike(path, ALL, RATE).spikes.any()


@pytest.mark.parametrize(
    ("name", "without", "kind"),
    [
        ("SPIKE_MOTION", 0.0, "kink"),
        ("HONEST_ACCELERATION_M_S2", 0.0, "twitch"),
    ],
)
def test_every_bound_is_needed(monkeypatch, rng, name, without, kind):
    """What `test_honest_motion_is_not_touched` shows is not so without the bound."""
    path = honest(kind) + 2e-5 * rng.normal(size=(len(T), 1, 3))
    monkeypatch.setattr(module, name, without)
    assert despike(path, ALL, RATE).spikes.any()


def test_what_a_marker_near_by_does_too_is_no_spike(rng, monkeypatch):
    path = slow(rng)
    pair = np.concatenate([path, path + np.array([0.03, 0.0, 0.0])], axis=1)
    pair[200, :, 1] += [0.02, 0.012]  # a finger's tip and its middle
    pair[300, :, 1] += [0.02, -0.012]  # two that are taken for each other
    both = np.ones((len(T), 2), bool)
    assert np.argwhere(despike(pair, both, RATE).spikes).tolist() == [
        [300, 0],
        [300, 1],
    ]
    monkeypatch.setattr(module, "NEIGHBOURS", 0)
    assert despike(pair, both, RATE).spikes.sum() == 4


def test_noise_alone_is_no_spike_and_is_measured(rng):
    path = rng.normal(scale=NOISE, size=(20_000, 1, 3))
    assert noise_of(path[:, 0]) == pytest.approx(NOISE, rel=0.03)
    assert not despike(path, np.ones((20_000, 1), bool), RATE).spikes.any()
    loud = path * 10.0
    loud[500] += 0.01  # five standard deviations per axis
    assert not despike(loud, np.ones((20_000, 1), bool), RATE).spikes.any()


def test_numbers_that_were_rounded_are_no_spikes(rng):
    quiet = 0.05 + 3e-5 * rng.normal(size=(5000, 1, 3))
    rounded = np.round(quiet, 4)  # to 0.1 mm, most of them the same
    assert noise_of(rounded[:, 0]) == 0.0
    assert not despike(rounded, np.ones((5000, 1), bool), 500.0).spikes.any()


def test_a_marker_of_which_too_little_is_known_is_left(rng):
    seen = ALL.copy()
    seen[MIN_DIFFERENCES + 2 :] = False
    path = thrown(slow(rng), 10, 1)
    assert not despike(path, seen, RATE).spikes.any()
    seen[MIN_DIFFERENCES + 2] = True
    assert despike(path, seen, RATE).spikes.sum() == 1


@pytest.mark.parametrize("place", [1e154, 1e300, -1e308])
def test_places_beyond_all_measure_are_borne(rng, place):
    path = slow(rng)
    path[200] = place
    found = despike(np.concatenate([path, slow(rng)], axis=1), ALL[:, [0, 0]], RATE)
    assert np.isfinite(found.positions).all()
    assert np.argwhere(found.spikes).tolist() in ([[200, 0]], [])


@pytest.mark.parametrize("shape", [(0, 1), (3, 2), (5, 0)])
def test_takes_of_hardly_anything_are_left(shape):
    found = despike(np.zeros((*shape, 3)), np.ones(shape, bool), RATE)
    assert found.positions.shape == (*shape, 3)
    assert not found.spikes.any()


@pytest.fixture(params=REAL)
def recorded(shared_data, request):
    """Positions, what is measured, rate, and how many samples are spikes."""
    given, spikes = REAL[request.param]
    take = files.read(shared_data / request.param, **given)
    return take.markers.positions, take.markers.measured, take.rate, spikes


def test_hardly_anything_is_found_in_recordings(recorded):
    positions, seen, rate, most = recorded
    assert despike(positions, seen, rate).spikes.sum() <= most
    for faster in (2, 3):  # the same motion in every second and third frame
        found = despike(positions[::faster], seen[::faster], rate / faster)
        assert found.spikes.sum() <= most


def test_spikes_thrown_into_recordings_are_found_and_hardly_anything_else(
    recorded, rng
):
    """3 cm in any direction, one to three frames, one after the other."""
    positions, seen, rate, _ = recorded
    before = despike(positions, seen, rate).spikes
    spoilt, hit = positions.copy(), np.zeros_like(seen)
    for t in range(8, len(seen) - 12, 12):
        frames, m = int(rng.integers(1, 4)), rng.integers(seen.shape[1])
        rows, aside = slice(t, t + frames), rng.normal(size=3)
        if seen[t - 2 : t + frames + 2, m].all() and not before[t - 4 : t + 8].any():
            spoilt[rows, m] += 0.03 * aside / np.linalg.norm(aside)
            hit[rows, m] = True
    found = despike(spoilt, seen, rate)
    least = 0.9 if rate < 100.0 else 0.99
    assert (found.spikes & hit).sum() >= least * hit.sum() > 100
    assert (found.spikes & ~hit & ~before).sum() <= 0.01 * hit.sum()
    away = np.linalg.norm(found.positions - positions, axis=2)[hit & found.spikes]
    assert np.median(away) < 1e-3
