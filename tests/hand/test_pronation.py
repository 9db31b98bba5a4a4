"""The thumb's fifth rotation."""

import numpy as np

from handclean.hand.model import bone_rotations, joint_positions, neutral_pose
from handclean.hand.pronation import PRONATION, with_pronation
from handclean.hand.template import template


def turned(side, angle):
    tree = with_pronation(template(side))
    pose = neutral_pose(tree)
    pose[7 + tree.hinges.index(PRONATION)] = angle
    return tree, pose[None]


def test_pronation_turns_the_thumb_about_itself_and_moves_no_joint():
    tree, pose = turned("left", 0.7)
    still = joint_positions(tree, neutral_pose(tree)[None])
    np.testing.assert_allclose(joint_positions(tree, pose), still, atol=1e-12)
    turns = bone_rotations(tree, pose)[0]
    angle = np.arccos((np.trace(turns[tree.bone("thumb_distal")]) - 1.0) / 2.0)
    np.testing.assert_allclose(angle, 0.7, atol=1e-9)
    np.testing.assert_allclose(turns[tree.bone("index_distal")], np.eye(3), atol=1e-12)


def test_both_hands_pronate_as_mirror_images():
    left, right = with_pronation(template("left")), with_pronation(template("right"))
    np.testing.assert_allclose(right.mirrored().axes, left.axes, atol=1e-12)


def test_pronation_turns_the_pad_to_the_fingers():
    tree, pose = turned("left", 0.7)
    pad = -np.array([np.sin(np.pi / 3) * 0.766, -np.sin(np.pi / 3) * 0.643, 0.5])
    moved = bone_rotations(tree, pose)[0, tree.bone("thumb_distal")] @ pad
    assert moved[2] > pad[2] + 0.1  # up, to the pads of bent fingers


def test_a_hand_that_pronates_is_left_as_it_is():
    tree = with_pronation(template("right"))
    assert with_pronation(tree) is tree
