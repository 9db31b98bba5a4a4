from dataclasses import replace

import numpy as np
import pytest
from scanned import coarse_start
from scipy.spatial.transform import Rotation

from handclean.hand.model import joint_positions
from handclean.hand.skinning import posed
from handclean.hand.template import FINGERS, bone_frame, distal_length, template
from handclean.subject.scan.alignment import Aligned, Template, relaxed
from handclean.subject.scan.rebuild import aimed, rebuilt
from handclean.tree import MIRROR


@pytest.fixture(params=["left", "right"])
def tree(request):
    return template(request.param)


def a_pose(tree, rng):
    pose = np.zeros(7 + len(tree.hinges))
    pose[:3] = rng.normal(scale=0.2, size=3)
    pose[[4, 5, 6, 3]] = Rotation.random(rng=rng).as_quat()
    pose[7:] = relaxed(tree)[0] + np.radians(rng.uniform(-15, 15, len(tree.hinges)))
    return pose


def ends(tree, pose, joints):
    """Points in the fingers' ends, found by hanging a bone there."""
    rows = [tree.bone(f"{finger}_distal") for finger in FINGERS]
    mirror = MIRROR if tree.side == "right" else np.ones(3)
    reach = np.array(
        [distal_length(tree, f) * bone_frame(f)[:, 1] * mirror for f in FINGERS]
    )
    longer = replace(
        tree,
        bones=(*tree.bones, *(f"{f}_end" for f in FINGERS)),
        joints=(*tree.joints, *(f"{f}_end" for f in FINGERS)),
        parents=np.concatenate([tree.parents, rows]),
        offsets=np.vstack([tree.offsets, reach]),
    )
    return joint_positions(longer, pose[None])[0]


def test_joints_of_the_template_itself_give_it_and_its_pose_back(tree, rng):
    pose = a_pose(tree, rng)
    points = ends(tree, pose, joint_positions(tree, pose[None])[0])
    found, there = aimed(tree, pose, points)
    np.testing.assert_allclose(found.offsets, tree.offsets, atol=1e-12)
    np.testing.assert_allclose(found.axes, tree.axes, atol=1e-12)
    np.testing.assert_allclose(there[7:], pose[7:], atol=1e-9)
    np.testing.assert_allclose(there[:3], pose[:3], atol=1e-12)
    assert abs(there[3:7] @ pose[3:7]) == pytest.approx(1.0, abs=1e-12)


def test_any_joints_are_reproduced_exactly(tree, rng):
    pose = a_pose(tree, rng)
    points = ends(tree, pose, joint_positions(tree, pose[None])[0])
    points += rng.normal(scale=0.003, size=points.shape)
    found, there = aimed(tree, pose, points)
    expected = points[: len(tree.bones)]
    np.testing.assert_allclose(
        joint_positions(found, there[None])[0], expected, atol=1e-12
    )


def test_fingers_are_straight_in_the_zero_posture_but_for_sideways_bends(tree, rng):
    """A bone lies in the plane across its axis, as near to the template's as it can."""
    pose = a_pose(tree, rng)
    points = ends(tree, pose, joint_positions(tree, pose[None])[0])
    points += rng.normal(scale=0.002, size=points.shape)
    found, _ = aimed(tree, pose, points)
    for b in range(1, len(tree.bones)):
        up = tree.parents[b]
        if up <= 0:
            continue
        along = found.offsets[b] / np.linalg.norm(found.offsets[b])
        hinge = np.flatnonzero(found.hinge_bone == up)[-1]
        rest = tree.offsets[b] / np.linalg.norm(tree.offsets[b])
        assert abs(found.axes[hinge] @ along) < 1e-9
        across = np.cross(found.axes[hinge], along)
        assert abs(across @ rest) < 1e-9
        assert along @ rest > np.cos(0.35)


def test_bent_fingers_keep_their_turn_beyond_half_a_circle(tree, rng):
    """A hinge bent to its limit is not taken for one bent the other way."""
    pose = a_pose(tree, rng)
    pose[7:] = np.clip(pose[7:], *tree.limits.T)
    pose[7 + tree.hinges.index("index_pip_flexion")] = np.radians(115.0)
    points = ends(tree, pose, joint_positions(tree, pose[None])[0])
    _, there = aimed(tree, pose, points)
    np.testing.assert_allclose(there[7:], pose[7:], atol=1e-9)


def test_a_larger_hand_gets_larger_joints_and_its_skin_back(rng):
    start = coarse_start("right")
    rows = np.zeros(1, dtype=np.int64)
    model = Template(tree=start.tree, surface=start.surface, landmarks=rows)
    pose = a_pose(start.tree, rng)
    aligned = Aligned(template=model, pose=pose, landmark_m=0.0)
    fitted = 1.2 * (aligned.vertices() - pose[:3]) + pose[:3]
    found = rebuilt(aligned, fitted)
    np.testing.assert_allclose(found.tree.offsets, 1.2 * start.tree.offsets, atol=1e-9)
    again = posed(found.surface, found.tree, found.pose[None])[0]
    np.testing.assert_allclose(again, fitted, atol=1e-9)
    for finger, length in found.tips.items():
        assert length == pytest.approx(1.2 * distal_length(start.tree, finger))


def test_the_fitted_skin_comes_back_whatever_it_is(rng):
    """Un-posing loses nothing: in the pose found, the subject has the fitted skin."""
    start = coarse_start("left")
    rows = np.zeros(1, dtype=np.int64)
    model = Template(tree=start.tree, surface=start.surface, landmarks=rows)
    pose = a_pose(start.tree, rng)
    aligned = Aligned(template=model, pose=pose, landmark_m=0.0)
    before = aligned.vertices()
    fitted = before + 0.003 * np.sin(before[:, [1, 2, 0]] / 0.02)
    found = rebuilt(aligned, fitted)
    again = posed(found.surface, found.tree, found.pose[None])[0]
    np.testing.assert_allclose(again, fitted, atol=1e-9)
    zero = found.surface.vertices - start.surface.vertices
    assert np.linalg.norm(zero, axis=1).mean() < 0.006
