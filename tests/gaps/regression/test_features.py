"""What the other markers show, seen from the body they move with."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from handclean.gaps.body import motion_onto
from handclean.gaps.regression.features import (
    Seen,
    gaussian,
    impute,
    look,
    rigidity,
)
from handclean.gaps.tracks import Tracks
from handclean.kernels.body_frames import smooth_present, weighted_means
from handclean.numerics.procrustes import align


def seen_of(places, column, others):
    return Seen(
        column=column,
        features=others,
        always=others,
        weight=rigidity(places, column, others),
        rows=slice(0, len(places)),
    )


def test_frames_are_laid_as_the_slow_twin_lays_them():
    rng = np.random.default_rng(3)
    points, reference = rng.normal(size=(7, 5, 3)), rng.normal(size=(5, 3))
    weight = rng.uniform(0.1, 1.0, 5)
    points[2, 1] = np.nan
    points[4] = np.nan
    motion = motion_onto(points, reference, weight)
    body = motion.to_body(points)
    for t in (0, 1, 2, 3, 5, 6):
        there = np.isfinite(points[t, :, 0])
        found = align(points[t], reference, np.where(there, weight, 0.0))
        np.testing.assert_allclose(motion.turn[t], found.rotation, atol=1e-9)
        np.testing.assert_allclose(body[t, there], found.apply(points[t, there]))
    assert np.isnan(motion.shift[4]).all()


def test_means_in_time_are_scipys():
    rng = np.random.default_rng(4)
    series = rng.normal(size=(60, 4))
    out = np.empty((60, 4))
    weighted_means(series, np.arange(60), gaussian(4.0), out)
    expected = gaussian_filter1d(series, 4.0, axis=0, mode="nearest")
    np.testing.assert_allclose(out, expected, atol=1e-12)


def test_smoothing_keeps_what_is_missing_and_leans_on_what_is_there():
    points = np.ones((20, 2, 3))
    points[5:9, 0] = np.nan
    out = np.empty(points.shape)
    smooth_present(points, gaussian(1.0), out)
    assert np.isnan(out[5:9, 0]).all()
    np.testing.assert_allclose(out[:5, 0], 1.0)
    np.testing.assert_allclose(out[:, 1], 1.0)


def test_near_rigid_markers_count_most():
    rng = np.random.default_rng(5)
    hidden = rng.normal(scale=0.02, size=(400, 3))
    stiff, loose = hidden + 0.03, rng.normal(scale=0.02, size=(400, 3))
    positions = np.stack([hidden, stiff, loose], axis=1)
    weight = rigidity(positions, 0, np.array([1, 2]))
    assert weight[0] == 1.0
    assert 1e-3 / 1.001 <= weight[1] < 0.1


def test_what_is_missing_for_a_while_is_guessed_and_meets_its_ends():
    rng = np.random.default_rng(7)
    base = np.cumsum(rng.normal(scale=1e-3, size=(500, 2, 3)), axis=0)
    third = 0.7 * base[:, [0]] + 0.2 * base[:, [1]]
    body = np.concatenate([base, third], axis=1)
    truth = body.copy()
    body[200:260, 2] = np.nan
    whole = np.ones(500, dtype=bool)
    found = impute(body, np.array([0, 1]), whole)
    np.testing.assert_array_equal(found[:200], truth[:200])
    off = np.linalg.norm(found[200:260, 2] - truth[200:260, 2], axis=1)
    held = np.linalg.norm(truth[199, 2] - truth[200:260, 2], axis=1)
    assert off.max() < 0.2 * held.max()
    assert off[0] < 1e-3
    assert off[-1] < 1e-3


def test_a_window_is_the_same_wherever_the_take_is(turned):
    rng = np.random.default_rng(8)
    positions = 0.1 * rng.normal(size=(1, 6, 3)) + np.cumsum(
        rng.normal(scale=1e-3, size=(300, 6, 3)), axis=0
    )
    windows = []
    for places in (positions, turned(positions)):
        tracks = Tracks(positions=places, rate=120.0, bones=np.full(6, -1))
        others = np.arange(1, 6)
        seen = seen_of(places, 0, others)
        windows.append(look(tracks, seen))
    one, other = windows
    size = [np.linalg.norm(w.features, axis=1) for w in windows]
    np.testing.assert_allclose(size[0], size[1], rtol=1e-8)
    assert one.noise == pytest.approx(other.noise, rel=0.5)


@pytest.mark.parametrize(("together", "smoothing"), [(True, 0.0), (False, 1.0)])
def test_what_shakes_together_is_not_smoothed(bending, together, smoothing):
    rng = np.random.default_rng(9)
    shaking = rng.normal(scale=1e-3, size=(2400, 1 if together else 8, 3))
    tracks = Tracks(positions=bending + shaking, rate=120.0, bones=np.full(8, -1))
    others = np.arange(8)[:7]
    seen = seen_of(tracks.positions, 7, others)
    assert look(tracks, seen).smoothing == smoothing
