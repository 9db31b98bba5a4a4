"""Places and Jacobians of trees against products of matrices and differences."""

import numpy as np
import pytest
from oracles import bone_transforms, random_pose, random_tree

from handclean.hand import model as hand_model
from handclean.hand.model import Model


def random_model(rng, bones=9, markers=12):
    tree = random_tree(rng, bones)
    return Model(
        tree=tree,
        labels=tuple(f"m{m}" for m in range(markers)),
        bone=rng.integers(0, bones, markers),
        at=rng.normal(scale=0.02, size=(markers, 3)),
    )


@pytest.mark.parametrize("bones", [1, 2, 5, 16])
def test_markers_and_joints_are_where_a_product_of_matrices_puts_them(rng, bones):
    model = random_model(rng, bones)
    poses = np.array([random_pose(rng, model.tree) for _ in range(4)])
    got = hand_model.marker_positions(model, poses)
    joints = hand_model.joint_positions(model.tree, poses)
    turns = hand_model.bone_rotations(model.tree, poses)
    for t, pose in enumerate(poses):
        world = bone_transforms(model.tree, pose)
        want = np.einsum("mij,mj->mi", world[model.bone, :3, :3], model.at)
        want += world[model.bone, :3, 3]
        np.testing.assert_allclose(got[t], want, atol=1e-12)
        np.testing.assert_allclose(joints[t], world[:, :3, 3], atol=1e-12)
        np.testing.assert_allclose(turns[t], world[:, :3, :3], atol=1e-12)


@pytest.mark.parametrize("bones", [1, 3, 16])
def test_jacobian_is_the_derivative_of_the_markers(rng, bones):
    model = random_model(rng, bones)
    pose = random_pose(rng, model.tree)
    got = hand_model.jacobian(model, pose)
    h = 1e-6
    for k in range(got.shape[2]):
        step = np.zeros(got.shape[2])
        step[k] = h
        there = np.array([hand_model.moved(pose, step), hand_model.moved(pose, -step)])
        ahead, behind = hand_model.marker_positions(model, there)
        np.testing.assert_allclose(got[:, :, k], (ahead - behind) / (2 * h), atol=1e-8)


def test_moving_the_root_moves_every_marker_alike(rng):
    model = random_model(rng)
    pose = random_pose(rng, model.tree)
    here = hand_model.marker_positions(model, pose[None])[0]
    pose[:3] += [1.0, -2.0, 0.5]
    there = hand_model.marker_positions(model, pose[None])[0]
    np.testing.assert_allclose(there - here, [[1.0, -2.0, 0.5]] * 12, atol=1e-12)


def test_mirroring_twice_changes_nothing_and_once_mirrors_the_markers(rng):
    tree = random_tree(rng, 6)
    model = Model(tree=tree, labels=("m",), bone=np.array([5]), at=np.zeros((1, 3)))
    other = Model(
        tree=tree.mirrored(), labels=("m",), bone=np.array([5]), at=np.zeros((1, 3))
    )
    pose = hand_model.neutral_pose(tree)
    pose[7:] = rng.normal(size=len(tree.hinges))
    left = hand_model.marker_positions(model, pose[None])
    right = hand_model.marker_positions(other, pose[None])
    np.testing.assert_allclose(right, left * [-1.0, 1.0, 1.0], atol=1e-12)
    np.testing.assert_array_equal(tree.mirrored().mirrored().axes, tree.axes)
