"""The smoother against a filter that goes forward and back."""

import numpy as np
import pytest

from handclean.gaps.family import kalman, linear
from handclean.gaps.family.donors import Group
from handclean.gaps.family.kalman import solve_chain
from handclean.gaps.tracks import Refused


def forward_and_back(rows, matrices, noise, walk):
    """Oracle: Kalman filter with an open start, then Rauch, Tung and Striebel."""
    first = matrices[0]
    doubt = noise * np.linalg.inv(first.T @ first)
    state = doubt @ first.T @ rows[0] / noise
    kept = [(state, doubt, state, doubt)]
    for z, c in zip(rows[1:], matrices[1:], strict=True):
        guess, guessed = state, doubt + walk
        gain = guessed @ c.T @ np.linalg.inv(c @ guessed @ c.T + noise * np.eye(len(z)))
        state = guess + gain @ (z - c @ guess)
        doubt = guessed - gain @ c @ guessed
        kept.append((state, doubt, guess, guessed))
    states = [kept[-1][0]]
    for now, later in zip(kept[-2::-1], kept[:0:-1], strict=True):
        back = now[1] @ np.linalg.inv(later[3])
        states.append(now[0] + back @ (states[-1] - later[2]))
    return np.array(states[::-1])


def test_the_band_gives_what_forward_and_back_give(rng):
    frames, size = 25, 3
    whole = rng.normal(size=(8, size))
    matrices = [whole if t < 5 or t >= 18 else whole[:5] for t in range(frames)]
    rows = [rng.normal(size=len(c)) for c in matrices]
    root = rng.normal(size=(size, size))
    walk, noise = root @ root.T + 0.1 * np.eye(size), 0.3
    expected = forward_and_back(rows, matrices, noise, walk)
    stiffness = np.linalg.inv(walk)
    links = np.r_[1.0, np.full(frames - 2, 2.0), 1.0]
    diagonal = np.array([c.T @ c for c in matrices]) / noise
    diagonal += links[:, None, None] * stiffness
    right = np.array([c.T @ z for c, z in zip(matrices, rows, strict=True)]) / noise
    found = solve_chain(diagonal, -stiffness, right)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_subspace_steps_and_noise_are_those_of_the_frames(bodies, rng):
    whole = bodies.whole(rng, 300, noise=1e-4, bend=0.003)
    tracks = bodies.without(whole, (3, 150, 180))
    frames = np.r_[0:150, 180:300]
    donors = np.setdiff1d(np.arange(8), 3)
    walk = kalman.learn_walk(tracks, 3, Group(markers=donors, frames=frames))
    rows, _ = kalman._body_rows(tracks, frames, np.append(donors, 3), whole[0, donors])
    _, sizes, ways = np.linalg.svd(rows - rows.mean(axis=0), full_matrices=False)
    kept = int(np.flatnonzero(np.cumsum(sizes) >= 0.9975 * sizes.sum())[0]) + 1
    assert walk.directions.shape == (24, kept)
    turned = walk.directions.T @ ways[:kept].T  # the same directions, but for signs
    np.testing.assert_allclose(np.abs(turned), np.eye(kept), atol=1e-6)
    left = np.sum(sizes[kept:] ** 2) / len(frames) / 24
    assert walk.noise == pytest.approx(left + kalman.NOISE_SD_M**2, rel=1e-9)
    steps = np.diff(rows, axis=0)
    steps = np.delete(steps, 149, axis=0) @ walk.directions  # not across the gap
    expected = steps.T @ steps / len(steps) + kalman.LEAST_STEP_M**2 * np.eye(kept)
    np.testing.assert_allclose(np.linalg.inv(walk.stiffness), expected, atol=1e-14)


def test_a_gap_is_filled_as_a_smoother_over_the_frames_around_it(bodies, rng):
    whole = bodies.whole(rng, 300, noise=1e-4)
    tracks = bodies.without(whole, (3, 150, 180))
    donors = np.setdiff1d(np.arange(8), 3)
    frames = np.r_[0:150, 180:300]
    walk = kalman.learn_walk(tracks, 3, Group(markers=donors, frames=frames))
    around = np.arange(150 - 11, 180 + 11)  # an end and 0.1 s on each side
    rows, motion = kalman._body_rows(tracks, around, walk.markers, walk.reference)
    rows = rows - walk.mean
    seen = [~np.isnan(row) for row in rows]
    states = forward_and_back(
        [row[s] for row, s in zip(rows, seen, strict=True)],
        [walk.directions[s] for s in seen],
        walk.noise,
        np.linalg.inv(walk.stiffness),
    )
    local = walk.mean[-3:] + states @ walk.directions[-3:].T
    expected = motion.to_laboratory(local)[10:-10]
    path = walk.path(bodies.gap(3, 150, 180))
    np.testing.assert_allclose(path, expected, atol=1e-8)


def test_it_beats_a_straight_line_where_markers_move_together(bodies, rng):
    whole = bodies.whole(rng, 400, noise=1e-4, bend=0.003)
    gap, tracks = bodies.gap(3, 200, 260), bodies.without(whole, ([3, 6], 200, 260))
    off = {}
    for filler in (kalman, linear):
        path = filler.prepare(tracks)(gap).places
        off[filler] = np.linalg.norm(path - whole[200:260, 3], axis=1).mean()
    assert off[kalman] < 0.05 * off[linear]


def test_frames_that_never_follow_each_other_are_refused(bodies, rng):
    whole = bodies.whole(rng, 200)
    whole[1::2, 3] = np.nan
    tracks = bodies.tracks(whole)
    with pytest.raises(Refused, match="no two frames in a row"):
        kalman.prepare(tracks)(bodies.gap(3, 21, 22))
