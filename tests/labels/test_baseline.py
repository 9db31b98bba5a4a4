"""The baseline follows what moves smoothly, and loses what comes back elsewhere."""

import numpy as np

from handclean.labels.baseline import follow_points
from handclean.recording import Recording, trajectories


def walk(rng, frames=30, markers=4):
    start = 0.1 * np.arange(markers)[:, None] * np.ones(3)
    step = rng.normal(scale=0.002, size=(markers, 3))
    return start + np.arange(frames)[:, None, None] * step


def take(paths, rng):
    shuffled = np.array([frame[rng.permutation(len(frame))] for frame in paths])
    names = tuple(f"*{n}" for n in range(paths.shape[1]))
    return Recording(
        rate=100.0, frames=len(paths), markers=trajectories(shuffled, names)
    )


def test_steady_markers_are_followed_whatever_the_order_of_points(rng):
    paths = walk(rng)
    found = follow_points(take(paths, rng), ("a", "b", "c", "d"), paths[0])
    np.testing.assert_array_equal(found.positions, paths)


def test_a_marker_that_comes_back_elsewhere_is_lost(rng):
    paths = walk(rng)
    paths[10:20, 2] = np.nan
    paths[20:, 2] += 0.05
    found = follow_points(take(paths, rng), ("a", "b", "c", "d"), paths[0])
    assert np.isnan(found.positions[10:, 2]).all()
    np.testing.assert_array_equal(found.positions[:, [0, 1, 3]], paths[:, [0, 1, 3]])
