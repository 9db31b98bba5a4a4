from dataclasses import replace

import numpy as np
import pytest
from scanned import coarse_start
from scipy.spatial.transform import Rotation

from handclean.errors import HandcleanError, UsageError
from handclean.hand.model import joint_positions, marker_positions
from handclean.hand.skinning import posed
from handclean.hand.surface import vertex_normals
from handclean.subject.scan.alignment import (
    Template,
    relaxed,
    riding,
    to_cloud,
    to_landmarks,
)
from handclean.subject.scan.cloud import Cloud


@pytest.fixture(scope="module")
def template():
    start = coarse_start("right")
    rows = np.array(list(start.landmarks.values()), dtype=np.int64)
    return Template(tree=start.tree, surface=start.surface, landmarks=rows)


def some_pose(tree, rng):
    pose = np.zeros(7 + len(tree.hinges))
    pose[:3] = rng.normal(scale=0.2, size=3)
    pose[[4, 5, 6, 3]] = Rotation.random(rng=rng).as_quat()
    pose[7:] = relaxed(tree)[0] + np.radians(rng.uniform(-8, 8, len(tree.hinges)))
    return pose


def test_landmarks_alone_find_size_place_and_posture(template, rng):
    true = template.sized(1.13)
    pose = some_pose(true.tree, rng)
    there = posed(true.surface, true.tree, pose[None])[0]
    found = to_landmarks(template, there[true.landmarks])
    assert found.template.tree.scale == pytest.approx(1.13, rel=0.02)
    assert found.landmark_m < 0.002
    joints = joint_positions(found.template.tree, found.pose[None])[0]
    expected = joint_positions(true.tree, pose[None])[0]
    assert np.linalg.norm(joints - expected, axis=1).max() < 0.006


def test_closest_points_improve_on_noisy_landmarks(template, rng):
    true = template.sized(0.92)
    pose = some_pose(true.tree, rng)
    there = posed(true.surface, true.tree, pose[None])[0]
    cloud = Cloud(points=there, normals=vertex_normals(there, true.surface.faces))
    places = there[true.landmarks] + rng.normal(
        scale=0.004, size=(len(template.landmarks), 3)
    )
    start = to_landmarks(template, places)
    found = to_cloud(start, places, cloud, 12, 0.012, 0.9)
    off = [
        np.linalg.norm(one.vertices() - there, axis=1).mean() for one in (start, found)
    ]
    assert off[1] < 0.6 * off[0]
    assert off[1] < 0.0015
    assert found.template.tree.scale == pytest.approx(0.92, rel=0.02)


def test_a_left_hand_is_told_from_a_right_one(template, rng):
    pose = some_pose(template.tree, rng)
    there = posed(template.surface, template.tree, pose[None])[0][template.landmarks]
    mirrored = there * [-1.0, 1.0, 1.0]
    with pytest.raises(UsageError, match="--side left"):
        to_landmarks(template, mirrored)
    to_landmarks(template.mirrored(), mirrored)


@pytest.mark.parametrize(
    ("factor", "word"), [(1000.0, "--unit"), (0.001, "--unit"), (2.5, "named right")]
)
def test_landmarks_of_no_hands_size_are_refused(template, rng, factor, word):
    there = factor * template.surface.vertices[template.landmarks]
    with pytest.raises(HandcleanError, match=word):
        to_landmarks(template, there)


def test_riding_vertices_are_where_the_skin_is_and_turn_with_their_bone(template, rng):
    pose = some_pose(template.tree, rng)
    rows = np.arange(0, len(template.surface.vertices), 97)
    model = riding(template, pose, rows)
    skin = posed(template.surface, template.tree, pose[None])[0][rows]
    np.testing.assert_allclose(marker_positions(model, pose[None])[0], skin, atol=1e-12)
    rigid = template.surface.weights[rows].max(axis=1) > 1.0 - 1e-9
    other = some_pose(template.tree, rng)
    skin = posed(template.surface, template.tree, other[None])[0][rows]
    moved = marker_positions(model, other[None])[0]
    assert rigid.any()
    np.testing.assert_allclose(moved[rigid], skin[rigid], atol=1e-9)


def test_sizing_moves_skin_and_skeleton_together(template, rng):
    pose = some_pose(template.tree, rng)
    pose[:3] = 0.0
    large = template.sized(1.4)
    np.testing.assert_allclose(
        posed(large.surface, large.tree, pose[None]),
        1.4 * posed(template.surface, template.tree, pose[None]),
        atol=1e-12,
    )
    back = replace(large.sized(1 / 1.4), landmarks=template.landmarks)
    np.testing.assert_allclose(back.tree.offsets, template.tree.offsets, atol=1e-15)
