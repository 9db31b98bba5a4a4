"""A simulated hand is tracked through frames with gaps, ghosts and few points."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.labels.track.frames import track_frames
from handclean.labels.track.state import FOLLOWED, RETURNED, empty_result

FRAMES = 60


def motion(hand, frames=FRAMES):
    """(T, 7 + D) a hand that goes 2 mm a frame, turns and closes."""
    first, last = hand.pose(0.1), hand.pose(0.6, (0.22, 0.2, 0.3))
    share = np.linspace(0.0, 1.0, frames)[:, None]
    poses = (1.0 - share) * first + share * last
    turn = Rotation.from_rotvec(share * [0.0, 0.0, 0.5]).as_quat()
    poses[:, 3:7] = np.roll(turn, 1, axis=1)
    return poses


def track(hand, sequence, frames, first_pose, by=1):
    """Track through all frames' points; return the result and where it ended."""
    state, stats = hand.state(first_pose), hand.stats()
    result = empty_result(len(frames), hand.markers, len(hand.target.mean))
    first, stop = (0, len(frames)) if by > 0 else (len(frames) - 1, -1)
    take = sequence(frames)
    end = track_frames(take, first, stop, by, state, stats, hand.tracker, result)
    return result, end


def labels(hand, frames, names, result):
    """(T, M) the true marker of each label, -1 for points of none, -2 for no label."""
    name = np.concatenate(names)
    assert len(name) == sum(map(len, frames))
    return np.where(result.chosen >= 0, name[result.chosen], -2)


def shuffled(points, names, rng):
    order = rng.permutation(len(points))
    return points[order], names[order]


@pytest.mark.parametrize("by", [1, -1])
def test_every_marker_is_tracked_forwards_and_backwards(hand, sequence, by, rng):
    poses = motion(hand)
    names = [rng.permutation(hand.markers) for _ in poses]
    frames = [p[n] for p, n in zip(hand.points(poses), names, strict=True)]
    result, end = track(hand, sequence, frames, poses[0 if by > 0 else -1], by)
    assert end == (FRAMES if by > 0 else -1)
    found = labels(hand, frames, names, result)
    np.testing.assert_array_equal(found, np.tile(np.arange(hand.markers), (FRAMES, 1)))
    assert (result.outcome == FOLLOWED).all()
    assert result.tracked.all()
    assert (result.confidence > 0.9).mean() > 0.9
    assert result.rms.max() < 1e-3
    np.testing.assert_allclose(result.pose[:, :3], poses[:, :3], atol=1e-3)


def test_a_hidden_marker_has_no_label_and_gets_its_own_back(hand, sequence):
    poses = motion(hand)
    frames, names = [], []
    for t, points in enumerate(hand.points(poses)):
        kept = np.delete(np.arange(hand.markers), [3] if 20 <= t < 35 else [])
        frames.append(points[kept])
        names.append(kept)
    result, _ = track(hand, sequence, frames, poses[0])
    found = labels(hand, frames, names, result)
    assert (found[20:35, 3] == -2).all()
    assert (found[35:, 3] == 3).all()
    assert result.outcome[35, 3] == RETURNED
    assert (result.outcome[36:, 3] == FOLLOWED).all()
    others = np.delete(np.arange(hand.markers), 3)
    np.testing.assert_array_equal(found[:, others], np.tile(others, (FRAMES, 1)))


def test_a_ghost_beside_a_hidden_marker_gets_no_label(hand, sequence, rng):
    poses = motion(hand)
    frames, names = [], []
    for t, points in enumerate(hand.points(poses)):
        name = np.arange(hand.markers)
        if 20 <= t < 30:
            points = points.copy()
            points[11] += [0.0, 0.02, 0.025]  # where the marker is not
            name[11] = -1
        points, name = shuffled(points, name, rng)
        frames.append(points)
        names.append(name)
    result, _ = track(hand, sequence, frames, poses[0])
    found = labels(hand, frames, names, result)
    assert (found != -1).all()
    assert (found[30:] == np.arange(hand.markers)).all()


def test_frames_without_points_are_waited_through(hand, sequence):
    poses = motion(hand)
    frames = list(hand.points(poses))
    for t in range(20, 24):
        frames[t] = frames[t][:2]
    result, end = track(hand, sequence, frames, poses[0])
    assert end == FRAMES
    np.testing.assert_array_equal(np.flatnonzero(~result.tracked), np.arange(20, 24))
    np.testing.assert_array_equal(result.pose[23], result.pose[19])
    assert (result.chosen[24:] >= 0).all()


def test_a_hand_that_stays_away_is_lost(hand, sequence):
    poses = motion(hand)
    frames = list(hand.points(poses))
    for t in range(20, FRAMES):
        frames[t] = frames[t][:2]
    _, end = track(hand, sequence, frames, poses[0])
    assert end == 20 + int(hand.setup.rules.lost_after)


def test_a_hand_that_is_elsewhere_is_lost_at_once(hand, sequence):
    poses = motion(hand)
    frames = list(hand.points(poses))
    frames[30:] = [points + 1.0 for points in frames[30:]]
    result, end = track(hand, sequence, frames, poses[0])
    assert end == 30
    assert not result.tracked[30:].any()


def test_the_order_of_points_does_not_matter(hand, sequence, rng):
    poses = motion(hand, 20)
    frames = list(hand.points(poses))
    orders = [rng.permutation(hand.markers) for _ in frames]
    result, _ = track(hand, sequence, frames, poses[0])
    mixed = [points[order] for points, order in zip(frames, orders, strict=True)]
    again, _ = track(hand, sequence, mixed, poses[0])
    np.testing.assert_array_equal(again.pose, result.pose)
    np.testing.assert_array_equal(
        labels(hand, mixed, orders, again),
        labels(hand, frames, [np.arange(hand.markers)] * 20, result),
    )


def test_labels_do_not_change_when_everything_moves(hand, sequence, rng):
    poses = motion(hand, 20)
    frames = list(hand.points(poses))
    turn, shift = Rotation.random(rng=rng), np.array([1.0, 2.0, 3.0])
    moved, first = [turn.apply(points) + shift for points in frames], poses[0].copy()
    first[:3] = turn.apply(first[:3]) + shift
    quaternion = turn * Rotation.from_quat(np.roll(first[3:7], -1))
    first[3:7] = np.roll(quaternion.as_quat(), 1)
    result, _ = track(hand, sequence, frames, poses[0])
    again, _ = track(hand, sequence, moved, first)
    np.testing.assert_array_equal(again.chosen, result.chosen)
    np.testing.assert_allclose(again.pose[:, 7:], result.pose[:, 7:], atol=1e-4)
