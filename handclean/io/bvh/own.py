"""Reading back what `handclean.io.bvh.write` wrote: the numbers that went in.

The frames of all joints are parallel in the zero posture, so there are no rest
rotations to be found; the motion is what hinges did, so there is nothing to clean. The
file does not say the hinge axes, which a subject has of its own, but the motion does:

one hinge
    Every rotation is about the axis.
two hinges
    ``R = Rot(a1, angle1) Rot(a2, angle2)`` leaves ``a1^T R a2 = a1^T a2`` whatever the
    angles are, four unknown tilts and one equation per frame (Gauss-Newton from the
    template's axes; tilts of which the motion says nothing stay 0). Then angle1 turns
    a2 to R a2 about a1, and angle2 is what is left.

A bone that stands still, or whose first hinge does, may leave tilts open that its
angles depend on; such bones are named.

Where no axes near the template's explain the motion to the last digits (somebody has
edited the file), the template's are taken, and what they cannot hold is reported.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.template import template
from handclean.io.bvh.hinge_fit import BoneFit, fit_of, left_over, principal, twist
from handclean.io.bvh.hinge_fit import two_hinges as nearest_two
from handclean.io.bvh.motion import BvhMotion
from handclean.io.bvh.write import WORLD
from handclean.io.shared.joint_map import JointMap
from handclean.io.shared.rotations import (
    about_line,
    quaternion_from_matrix,
    rotation_angle,
)
from handclean.recording import Motion
from handclean.tree import JointTree, rigid_tree

_EXACT_RAD = 1e-7
"""[rad] axes that leave no more than this are those of the file's hinges (chosen: above
rounding)."""

_MOST_TILT_RAD = np.radians(40.0)
"""[rad] axes further than this from the template's are no hand's (chosen)."""

_MOVING_RMS_RAD = 1e-6
"""[rad] RMS motion from which an axis is found; texts have nine digits of a degree
(chosen)."""

_LEAST_SINGULAR_SHARE = 1e-8
"""[-] singular values below this share of the largest say nothing (chosen)."""

_OPEN_TILT_SINGULAR_VALUE = 2e-5
"""[-] singular values below this, with texts of nine digits, leave a tilt open
(chosen)."""

_GAUSS_NEWTON_STEPS = 30
"""Steps that are taken; they converge in a few (chosen)."""


@dataclass(frozen=True, kw_only=True)
class OwnMotion:
    """One hand or object out of a file that handclean wrote.

    Attributes
    ----------
    name : of the motion; the side, where the file holds one hand only.
    tree : the hand, with the file's offsets and the axes found; or an object.
    fits : what its hinges leave of each bone's motion.
    unsure : bones whose motion says too little of the axes that their angles are about.
    """

    name: str
    tree: JointTree
    motion: Motion
    fits: dict[str, BoneFit]
    unsure: tuple[str, ...] = ()


def heads_of(bvh: BvhMotion, joint_map: JointMap) -> list[str]:
    """What the joints' names begin with, for each hand in which all joints are there.

    "" for a file of one motion, else ``MOTION_``.
    """
    root = joint_map.bones["hand"]
    heads = [name.removesuffix(root) for name in bvh.names if name.endswith(root)]
    joints = joint_map.bones.values()
    return [h for h in heads if all(h + joint in bvh.index for joint in joints)]


def own_hands(bvh: BvhMotion, joint_map: JointMap) -> list[OwnMotion]:
    """Return the hands of a file; none if its joints do not hang on each other as ours.

    Parameters
    ----------
    joint_map : one that is ``exact``.
    """
    found = [_own_hand(bvh, joint_map, head) for head in heads_of(bvh, joint_map)]
    return [hand for hand in found if hand is not None]


def own_objects(bvh: BvhMotion, joint_map: JointMap) -> list[OwnMotion]:
    """Return the rigid objects of a file: single joints beside the hands."""
    roots = np.flatnonzero(bvh.parents < 0)
    if len(roots) != 1 or bvh.names[roots[0]] != WORLD:
        return []
    hands = tuple(heads_of(bvh, joint_map))
    return [
        _own_object(bvh, joint_map, int(joint))
        for joint in np.flatnonzero(bvh.parents == roots[0])
        if joint not in bvh.parents and not bvh.names[joint].startswith(hands)
    ]


def _own_object(bvh: BvhMotion, joint_map: JointMap, joint: int) -> OwnMotion:
    tree = rigid_tree()
    name = bvh.names[joint].removesuffix("_root")
    angles = np.zeros((bvh.frames, 0))
    motion = _motion(bvh, joint_map, joint, (), angles)
    return OwnMotion(name=name, tree=tree, motion=motion, fits={})


def _motion(
    bvh: BvhMotion,
    joint_map: JointMap,
    root: int,
    hinges: tuple[str, ...],
    angles: Floats,
) -> Motion:
    places, turns = bvh.forward()
    return Motion(
        names=hinges,
        angles=angles,
        translation=joint_map.unit_m * places[:, root],
        rotation=quaternion_from_matrix(turns[:, root]),
    )


def _own_hand(bvh: BvhMotion, joint_map: JointMap, head: str) -> OwnMotion | None:
    left = template("left", forearm=True)
    if head + left.joints[-1] not in bvh.index:
        left = template("left")
    at = [
        bvh.index[head + joint_map.bones.get(bone, joint)]
        for bone, joint in zip(left.bones, left.joints, strict=True)
    ]
    if any(bvh.parents[at[b]] != at[left.parents[b]] for b in range(1, len(at))):
        return None
    offsets = joint_map.unit_m * bvh.offsets[at]
    offsets[0] = 0.0
    index, little = left.bone("index_proximal"), left.bone("little_proximal")
    thumbwards = offsets[index, 0] > offsets[little, 0]
    tree = left if thumbwards else left.mirrored()
    size = _reach(offsets, tree) / _reach(tree.offsets, tree)
    tree = replace(tree, offsets=offsets, subject="", scale=size)
    angles = np.zeros((bvh.frames, len(tree.hinges)))
    axes, fits, unsure = tree.axes.copy(), {}, []
    for b in range(1, len(at)):
        hinges = np.flatnonzero(tree.hinge_bone == b)
        turn = bvh.turns[:, at[b]]
        axes[hinges], angles[:, hinges] = _hinged(turn, tree.axes[hinges])
        left_by = left_over(turn, angles[:, hinges], axes[hinges], np.eye(3))
        fits[tree.bones[b]] = fit_of(left_by, axes[hinges], tree.axes[hinges])
        if len(hinges) == 2 and _is_open(turn, axes[hinges], angles[:, hinges]):
            unsure.append(tree.bones[b])
    motion = _motion(bvh, joint_map, at[0], tree.hinges, angles)
    name = head.removesuffix("_") or tree.side
    tree = replace(tree, axes=axes)
    return OwnMotion(
        name=name, tree=tree, motion=motion, fits=fits, unsure=tuple(unsure)
    )


def _reach(offsets: Floats, tree: JointTree) -> float:
    """[m] wrist to the last joint of the middle finger, along its bones."""
    bones = [tree.bone(f"middle_{part}") for part in ("proximal", "middle", "distal")]
    return float(np.linalg.norm(offsets[bones], axis=1).sum())


def _hinged(turn: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """(1 or 2, 3) axes and (T, 1 or 2) [rad] angles of (T, 3, 3) rotations."""
    if len(axes) == 1:
        found = principal(turn, axes[0], _MOVING_RMS_RAD, np.eye(3))[None]
        angles = twist(turn, found[0])[:, None]
    else:
        found = _two_axes(turn, axes)
        angles = _two_angles(turn, found)
    lean = np.sum(found * axes, axis=1).min()
    left = rotation_angle(left_over(turn, angles, found, np.eye(3)))
    if lean > np.cos(_MOST_TILT_RAD) and left.max() < _EXACT_RAD:
        return found, angles
    if len(axes) == 1:
        return axes, twist(turn, axes[0])[:, None]
    return axes, nearest_two(turn, axes)


def _two_axes(turn: Floats, axes: Floats) -> Floats:
    """(2, 3) axes near the given ones between which no rotation changes the angle."""
    for _ in range(_GAUSS_NEWTON_STEPS):
        slopes = _slopes(turn, axes)
        wrong = turn @ axes[1] @ axes[0] - axes[1] @ axes[0]
        step: Floats = np.linalg.lstsq(slopes, -wrong, rcond=_LEAST_SINGULAR_SHARE)[0]
        axes = _tilted(axes, step)
        if np.abs(step).max() < 1e-13:
            break
    return axes


def _slopes(turn: Floats, axes: Floats) -> Floats:
    """(T, 4) how ``a1^T R a2 - a1^T a2`` changes with two tilts of each axis."""
    change = turn - np.eye(3)
    first = change @ axes[1] @ _across(axes[0])
    return np.column_stack([first, axes[0] @ change @ _across(axes[1])])


def _tilted(axes: Floats, tilt: Floats) -> Floats:
    """(2, 3) unit axes tilted by (4,) [rad], for small tilts."""
    moved = [
        axis + _across(axis) @ part
        for axis, part in zip(axes, np.split(tilt, 2), strict=True)
    ]
    return np.array([axis / np.linalg.norm(axis) for axis in moved])


def _is_open(turn: Floats, axes: Floats, angles: Floats) -> bool:
    """Whether angles depend on a tilt of the axes that the motion does not show."""
    slopes = np.vstack([_slopes(turn, axes), np.zeros((4, 4))])  # four rows at least
    _, says, tilts = np.linalg.svd(slopes, full_matrices=False)
    for tilt in tilts[says < _OPEN_TILT_SINGULAR_VALUE]:
        other = _two_angles(turn, _tilted(axes, 1e-4 * tilt))
        if np.abs(other - angles).max() > 1e-3 * 1e-4:
            return True
    return False


def _across(axis: Floats) -> Floats:
    """(3, 2) two unit vectors across a unit vector and each other."""
    helper: Ints | Floats = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(axis, helper)
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first)])


def _two_angles(turn: Floats, axes: Floats) -> Floats:
    """(T, 2) [rad] angles of rotations that two hinges hold."""
    turned = turn @ axes[1]
    sine = np.cross(axes[1], turned) @ axes[0]
    cosine = turned @ axes[1] - (axes[0] @ axes[1]) * (turned @ axes[0])
    first = np.arctan2(sine, cosine)
    second = twist(about_line(axes[0], -first) @ turn, axes[1])
    return np.column_stack([first, second])
