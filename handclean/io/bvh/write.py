"""Joint trees and their motion as BVH, all motions of a take in one file.

Lengths are centimetres, the frames of all joints are parallel in the zero posture (the
hand's x, y, z axes), and joints are named as in the joint tree. The laboratory is
turned so that y is up, as most programs that read BVH take it to be, or another axis
that was asked for. The first angle of a root is the one about that axis, so that a hand
that lies on a table is far from gimbal lock, and so that reading tells which is up.
"""

from itertools import chain
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UnknownNameError
from handclean.hand.template import FINGERS, bone_frame, distal_length
from handclean.io.bvh.hierarchy import PLACES
from handclean.io.shared.rotations import (
    about_line,
    euler_from_matrix,
    matrix_from_quaternion,
)
from handclean.io.shared.upright import upright
from handclean.io.shared.writing import (
    NO_TREE,
    held_poses,
    motions_of,
    rows,
    write_lines,
)
from handclean.recording import Motion, Recording
from handclean.remarks import Remark, remark
from handclean.tree import MIRROR, JointTree

_ORDER = "zxy"
"""Euler order of joints."""

_ROOT_ORDERS = {"x": "xzy", "y": "yxz", "z": "zxy"}
"""Euler order of roots, by the axis that points up."""

WORLD = "world"
"""Joint on which several motions hang."""


def write_bvh(
    path: Path, recording: Recording, *, bvh_up: str = "+y"
) -> tuple[Remark, ...]:
    """Write all motions of a take as one BVH file.

    One motion is one ROOT; several hang on a ROOT called ``world`` and their joints'
    names begin with ``MOTION_``. BVH cannot leave a frame out: where a motion is
    missing, its last pose is held.

    Parameters
    ----------
    bvh_up : axis that points up in the file, "+y" or the like.

    Returns
    -------
    what the format cannot hold, one line each

    Raises
    ------
    FileError
        If there is no motion, or a motion has no skeleton or is missing throughout.
    """
    motions = motions_of(path, recording)
    several = len(motions) > 1
    order = _ROOT_ORDERS[bvh_up[1]]
    turn, remarks = _turned(recording.up_axis, bvh_up)
    hierarchy: list[str] = []
    blocks: list[Floats] = []
    if several:
        hierarchy += [f"ROOT {WORLD}", "{", *_joint_lines(np.zeros(3), order, 1)]
        blocks.append(np.zeros((recording.frames, 6)))
    for name, motion in motions.items():
        tree = _tree_of(path, recording, name, motion)
        held, missing = held_poses(motion.poses)
        if missing == len(held):
            raise FileError(path, f"cannot be written: motion '{name}' is all missing")
        if missing:
            text = f"{missing} frames without a pose of '{name}' hold the last one"
            remarks.append(remark("not-kept", text, model=name, count=missing))
        hierarchy += _bone_lines(tree, f"{name}_" if several else "", several, order)
        blocks += _root_channels(held, turn, order)
        blocks += _bone_channels(tree, motion.names, held)
    hierarchy += ["}"] * several
    motion_lines = [
        "MOTION",
        f"Frames: {recording.frames}",
        f"Frame Time: {1.0 / recording.rate:.12g}",
    ]
    table = np.column_stack(blocks)
    body = rows(table, [9] * table.shape[1], " ")
    write_lines(path, chain(["HIERARCHY"], hierarchy, motion_lines, body))
    return tuple(remarks)


def _turned(up_axis: str, wanted: str) -> tuple[Floats, list[Remark]]:
    """(3, 3) rotation of the laboratory that the file is in, and what to say of it."""
    turn = upright(up_axis or "+z", wanted)
    if not up_axis:
        text = "the take does not say which way is up: z is taken"
        return turn, [remark("not-kept", text)]
    if up_axis == wanted:
        return turn, []
    text = f"turned, so that {up_axis} of the take is {wanted} of the file"
    return turn, [remark("not-kept", f"{text} (convert --bvh-up)")]


def _tree_of(path: Path, recording: Recording, name: str, motion: Motion) -> JointTree:
    """Return the bones that a motion moves, all of whose hinges it has."""
    if name not in recording.skeletons:
        wrong = f"cannot be written: motion '{name}' has no joint tree"
        raise FileError(path, wrong, NO_TREE)
    tree = recording.skeletons[name]
    for hinge in tree.hinges:
        if hinge not in motion.names:
            raise UnknownNameError(path, "joint angle", hinge, motion.names)
    return tree


def _joint_lines(offset: Floats, root_order: str, depth: int) -> list[str]:
    """OFFSET [m, written in cm] and CHANNELS of one joint; of a root with its order."""
    turns = [f"{axis.upper()}rotation" for axis in root_order or _ORDER]
    channels = [*PLACES, *turns] if root_order else turns
    tabs = "\t" * depth
    return [
        tabs + "OFFSET " + " ".join(f"{100 * x:.9f}" for x in offset),
        tabs + f"CHANNELS {len(channels)} " + " ".join(channels),
    ]


def _bone_lines(tree: JointTree, head: str, depth: int, order: str) -> list[str]:
    """Hierarchy of a tree, the root ``depth`` joints deep."""
    below = _children(tree)
    lines: list[str] = []
    left = [(0, depth, "")]
    while left:
        bone, depth, end = left.pop()
        if end:
            lines.append(end)
            continue
        tabs = "\t" * depth
        kind = "ROOT" if depth == 0 else "JOINT"
        lines += [f"{tabs}{kind} {head}{tree.joints[bone]}", tabs + "{"]
        lines += _joint_lines(tree.offsets[bone], "" if bone else order, depth + 1)
        left.append((bone, depth, tabs + "}"))
        left += [(child, depth + 1, "") for child in reversed(below[bone])]
        if not below[bone]:
            tip = " ".join(f"{100 * x:.9f}" for x in _tip(tree, bone))
            lines += [f"{tabs}\tEnd Site", tabs + "\t{", f"{tabs}\t\tOFFSET {tip}"]
            lines.append(tabs + "\t}")
    return lines


def _children(tree: JointTree) -> list[list[int]]:
    """Bones that hang on each bone."""
    below: list[list[int]] = [[] for _ in tree.bones]
    for bone, up in enumerate(tree.parents.tolist()):
        if up >= 0:
            below[up].append(bone)
    return below


def _tip(tree: JointTree, bone: int) -> Floats:
    """(3,) [m] the end of a bone on which none hangs, in its frame."""
    finger, _, segment = tree.bones[bone].partition("_")
    if tree.kind != "hand" or segment != "distal" or finger not in FINGERS:
        return np.zeros(3)
    along = bone_frame(finger)[:, 1] * (MIRROR if tree.side == "right" else 1.0)
    return distal_length(tree, finger) * along


def _root_channels(poses: Floats, turn: Floats, order: str) -> list[Floats]:
    """Channel values of a tree's root in a laboratory that is turned."""
    rotation = turn @ matrix_from_quaternion(poses[:, 3:7])
    return [100.0 * (poses[:, :3] @ turn.T), _angles(rotation, order)]


def _bone_channels(
    tree: JointTree, hinges: tuple[str, ...], poses: Floats
) -> list[Floats]:
    """Channel values of the bones below the root in the order of their lines."""
    angles = dict(zip(hinges, poses[:, 7:].T, strict=True))
    blocks: list[Floats] = []
    for bone in _depth_first(tree)[1:]:
        turn = np.tile(np.eye(3), (len(poses), 1, 1))
        for hinge in np.flatnonzero(tree.hinge_bone == bone):
            turn = turn @ about_line(tree.axes[hinge], angles[tree.hinges[hinge]])
        blocks.append(_angles(turn, _ORDER))
    return blocks


def _angles(turn: Floats, order: str) -> Floats:
    """(T, 3) [degrees] Euler angles without jumps."""
    unwrapped: Floats = np.degrees(np.unwrap(euler_from_matrix(turn, order), axis=0))
    return unwrapped


def _depth_first(tree: JointTree) -> list[int]:
    """Bones in the order of their lines."""
    below, left, found = _children(tree), [0], []
    while left:
        found.append(left.pop())
        left += reversed(below[found[-1]])
    return found
