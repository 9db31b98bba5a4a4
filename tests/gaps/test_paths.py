"""Paths of joints through gaps, and what they take their velocities from."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from handclean.gaps.paths import (
    lay_paths,
    quaternions,
    rotation_vectors,
    try_bridging,
)
from handclean.gaps.runs import Limits
from handclean.tree import POSE_HEAD

LIMITS = Limits(longest=20, seed=5, rate=100.0)


def test_a_path_does_not_begin_with_the_velocity_of_a_joint_that_was_lost(scenes):
    """Known for five frames after 45 in which markers said nothing of it."""
    tree = scenes.model.tree
    poses = np.zeros((100, POSE_HEAD + len(tree.hinges)))
    poses[:, 3] = 1.0
    hinge = tree.hinges.index("index_pip_flexion")
    column = POSE_HEAD + hinge
    poses[:, column] = 0.3 + 0.004 * np.arange(100.0)  # [rad]
    truth = poses[:, column].copy()
    poses[:45, column] = 0.9
    is_open, root = np.zeros((100, len(tree.hinges)), dtype=bool), np.zeros(100, bool)
    is_open[50:58, hinge] = True
    lost = np.zeros_like(is_open)
    lost[:45, hinge] = True
    off = []
    for marked in (lost, np.zeros_like(lost)):
        given = is_open, root, marked, LIMITS
        tried = try_bridging(poses, *given, coupled=False)
        laid = lay_paths(tree, poses, *given, tried)
        assert not laid.clusters[0].refused
        off.append(np.abs(laid.poses[50:58, column] - truth[50:58]).max())
    assert off[0] < 1e-9
    assert off[1] > 1e-3


@given(
    seed=st.integers(0, 10**6), longest=st.sampled_from([0.0, 1e-12, 1e-6, 1.0, 3.1])
)
def test_rotation_vectors_and_quaternions_are_scipys(seed, longest):
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(5, 3))
    vectors *= longest / np.linalg.norm(vectors, axis=1, keepdims=True)
    turns = Rotation.from_rotvec(vectors)
    theirs = np.roll(turns.as_quat(), 1, axis=1)
    assert quaternions(vectors) == pytest.approx(theirs, abs=1e-14)
    for same in (theirs, -theirs):
        assert rotation_vectors(same) == pytest.approx(vectors, rel=1e-9, abs=1e-15)
