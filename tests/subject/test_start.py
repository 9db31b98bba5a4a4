"""Size, side and first poses, from nothing."""

import numpy as np
import pytest
from people import as_take, person
from scipy.spatial.transform import Rotation

from handclean.errors import HandcleanError, UsageError
from handclean.hand.model import marker_positions
from handclean.subject.adjust import residuals
from handclean.subject.frames import gather, thinned
from handclean.subject.start import first_poses, guess, scaled


def few(one, count=12):
    frames = gather([one.take], one.set.labels)
    return frames.only(thinned(frames, count))


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("size", [0.6, 0.8, 1.0, 1.3])
def test_the_size_of_any_hand_is_found_and_its_side_is_clear(side, size):
    one = person(5, "han19", side=side, size=size, frames=120, noise=0.001)
    found = guess(one.set, few(one), side)
    assert found.size == pytest.approx(size, rel=0.12)
    assert found.side == side
    assert found.clear


@pytest.mark.parametrize("name", ["maycock26", "schroeder17", "xu19", "dfki13"])
def test_a_left_hand_is_refused_where_a_right_one_is_asked_for(name):
    one = person(6, name, side="left", frames=120)
    with pytest.raises(UsageError) as caught:
        guess(one.set, few(one), "right")
    assert f"marker set {name}: the take shows a left hand" in str(caught.value)
    assert "--side left" in str(caught.value)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1000.0, "1000 times too large; is the unit right (--unit)?"),
        (10.0, "10 times too large"),
        (0.001, "1000 times too small"),
        (2.5, "hands of 110 to 250 mm are known; are labels and set right?"),
    ],
)
def test_what_is_not_of_a_hands_size_is_refused_in_plain_words(factor, words):
    one = person(7, "han19", frames=60)
    take = as_take(factor * one.take.markers.positions, one.set.labels)
    frames = gather([take], one.set.labels)
    with pytest.raises(HandcleanError) as caught:
        guess(one.set, frames.only(thinned(frames, 12)), "left")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_poses_are_found_from_scratch_in_any_orientation(rng):
    one = person(8, "maycock26", frames=40, noise=0.0)
    frames = gather([one.take], one.set.labels)
    poses, costs = first_poses(one.model, frames.targets, frames.seen)
    away = residuals(one.model, poses, frames.targets, frames.seen)
    assert np.nanmedian(away) < 0.002  # held towards the middle posture a little
    assert np.nanmax(away) < 0.01

    turn = Rotation.from_rotvec([1.0, -2.0, 0.7])
    flat = frames.targets.reshape(-1, 3)
    moved = turn.apply(flat) + np.array([5.0, -3.0, 2.0])
    moved = moved.reshape(frames.targets.shape)
    _, there = first_poses(one.model, moved, frames.seen)
    np.testing.assert_allclose(there, costs, rtol=1e-3, atol=1e-3)


def test_a_scaled_model_has_its_markers_scaled_in_every_pose(rng):
    one = person(9, "xu19", frames=5)
    poses = one.poses.copy()
    poses[:, :3] = 0.0
    want = 1.3 * marker_positions(one.model, poses)
    got = marker_positions(scaled(one.model, 1.3), poses)
    np.testing.assert_allclose(got, want, atol=1e-12)
