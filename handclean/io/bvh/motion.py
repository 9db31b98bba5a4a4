"""BVH: a hierarchy of joints as text, in by any program, out of our joint trees.

A joint's channels are places (which stand for its offset) and angles in degrees about
axes that are carried along, in the order in which they are listed. BVH has no unit of
length. We write centimetres, the frames of all joints parallel in the zero posture
(the hand's x, y, z axes), the joints named as in the joint tree.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import FileError, UnknownNameError
from handclean.hand.template import FINGERS, bone_frame, distal_length
from handclean.io.bvh.hierarchy import MOST_NUMBER, PLACES, TURNS, Hierarchy
from handclean.io.shared.grid import Form, Lines, read_numbers
from handclean.io.shared.reading import load_text, text
from handclean.io.shared.rotations import (
    about_line,
    euler_from_matrix,
    matrix_from_euler,
    matrix_from_quaternion,
)
from handclean.io.shared.settle import positive
from handclean.io.shared.writing import (
    NO_TREE,
    held_poses,
    motions_of,
    rows,
    write_lines,
)
from handclean.numerics.rotations import rotated
from handclean.recording import Recording
from handclean.remarks import Remark, remark
from handclean.tree import MIRROR, JointTree

_ORDER = "zxy"
"""Euler order in which we write."""

WORLD = "world"
"""Joint on which several motions hang."""

_EXACT_DIGITS = 10
"""A frame time of more digits is taken for exact, not for a whole rate rounded
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class BvhMotion:
    """A hierarchy of J joints and how it moved.

    Attributes
    ----------
    names : J joint names, parents before children.
    parents : (J,) the joint each hangs on, -1 for a root.
    offsets : (J, 3) [unit of the file] from the parent, in its frame.
    places : (T, J, 3) [unit of the file] the same, frame by frame.
    turns : (T, J, 3, 3) rotation of each joint, to its parent's frame.
    ends : (J, 3) [unit of the file] end site of each joint in its frame, NaN if none.
    rate : [Hz].
    remarks : what was odd about the file.
    """

    names: tuple[str, ...]
    parents: Ints
    offsets: Floats
    places: Floats
    turns: Floats
    ends: Floats
    rate: float
    remarks: tuple[Remark, ...] = ()

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.turns)

    @cached_property
    def index(self) -> Mapping[str, int]:
        """Which joint has a name."""
        return {name: joint for joint, name in enumerate(self.names)}

    def forward(self) -> tuple[Floats, Floats]:
        """Return where the joints are: (T, J, 3) and (T, J, 3, 3) to the laboratory."""
        return self._laboratory

    @cached_property
    def _laboratory(self) -> tuple[Floats, Floats]:
        places, turns = self.places.copy(), self.turns.copy()
        for j, up in enumerate(self.parents):
            if up >= 0:
                step = rotated(turns[:, up], self.places[:, j])
                places[:, j] = places[:, up] + step
                turns[:, j] = turns[:, up] @ self.turns[:, j]
        return places, turns


def read_bvh(path: Path, *, lenient: bool = False) -> BvhMotion:
    """Read a BVH file.

    Parameters
    ----------
    lenient : read what is there of a file that was cut off.

    Raises
    ------
    FileError
        If it is not a BVH file.
    """
    lines = Lines(path, load_text(path))
    remarks: list[Remark] = []
    tree = Hierarchy(lines)
    claim, rate = _motion_header(path, lines)
    width = sum(map(len, tree.channels))
    if not width:
        raise FileError(path, "has no channels")
    values = read_numbers(
        lines, Form(columns=width, delimiter=None), remarks, lenient=lenient
    )
    frames, joints = len(values), len(tree.names)
    if np.isnan(values).any():
        raise FileError(path, "a channel is not a number")
    if np.abs(values).max(initial=0.0) > MOST_NUMBER:
        raise FileError(path, "a channel is too large a number")
    if frames * joints > 2 * values.size + 1000:
        raise FileError(path, "most of its joints have no channels")
    if frames != claim:
        said = f"Frames says {claim}, there are {frames} rows"
        if frames < claim and not lenient:
            raise FileError(path, said, f"a cut file? --lenient saves {frames} frames")
        remarks.append(remark("header", said, stated=claim, rows=frames))
    offsets, ends = np.array(tree.offsets), np.full((joints, 3), np.nan)
    for joint, end in tree.ends.items():
        ends[joint] = end
    places, turns = _unroll(tree, values, offsets)
    return BvhMotion(
        names=tuple(tree.names),
        parents=np.array(tree.parents, dtype=np.int64),
        offsets=offsets,
        places=places,
        turns=turns,
        ends=ends,
        rate=rate,
        remarks=tuple(remarks),
    )


def _motion_header(path: Path, lines: Lines) -> tuple[int, float]:
    """Return how many frames the file claims and its rate [Hz]."""
    frames = [text(word) for word in lines.cells(None)]
    time = [text(word) for word in lines.cells(None)]
    if frames[:1] != ["Frames:"] or len(frames) != 2 or not frames[1].isdecimal():
        raise FileError(path, "has no line 'Frames: N' after MOTION")
    if time[:2] != ["Frame", "Time:"] or len(time) != 3:
        raise FileError(path, "has no line 'Frame Time: SECONDS'")
    seconds = positive(path, "Frame Time", time[2])
    rate = 1.0 / seconds
    whole = round(rate)
    exact = len(time[2].strip("0.")) > _EXACT_DIGITS
    near = whole > 0 and abs(rate - whole) <= (1e-10 if exact else 1e-4) * rate
    return int(frames[1][:15]), float(whole) if near else rate


def _unroll(tree: Hierarchy, values: Floats, offsets: Floats) -> tuple[Floats, Floats]:
    """(T, J, 3) places and (T, J, 3, 3) turns from (T, C) channel values."""
    frames, joints = len(values), len(tree.names)
    places = np.broadcast_to(offsets, (frames, joints, 3)).copy()
    turns = np.zeros((frames, joints, 3, 3))
    column = 0
    for j, kinds in enumerate(tree.channels):
        angles, order = [], ""
        for kind in kinds:
            if kind in PLACES:
                places[:, j, PLACES[kind]] = values[:, column]
            else:
                angles.append(column)
                order += TURNS[kind]
            column += 1
        turns[:, j] = matrix_from_euler(np.radians(values[:, angles]), order)
    return places, turns


def write_bvh(path: Path, recording: Recording) -> tuple[Remark, ...]:
    """Write all motions of a take as one BVH file.

    One motion is one ROOT; several hang on a ROOT called ``world`` and their joints'
    names begin with ``MOTION_``. BVH cannot leave a frame out: where a motion is
    missing, its last pose is held.

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
    hierarchy: list[str] = []
    blocks: list[Floats] = []
    remarks: list[Remark] = []
    if several:
        hierarchy += [f"ROOT {WORLD}", "{", *_joint_lines(np.zeros(3), True, 1)]
        blocks.append(np.zeros((recording.frames, 6)))
    for name, motion in motions.items():
        if name not in recording.skeletons:
            wrong = f"cannot be written: motion '{name}' has no joint tree"
            raise FileError(path, wrong, NO_TREE)
        tree = recording.skeletons[name]
        for hinge in tree.hinges:
            if hinge not in motion.names:
                raise UnknownNameError(path, "joint angle", hinge, motion.names)
        held, missing = held_poses(motion.poses)
        if missing == len(held):
            raise FileError(path, f"cannot be written: motion '{name}' is all missing")
        if missing:
            remarks.append(
                remark(
                    "not-kept",
                    f"{missing} frames without a pose of '{name}' hold the last one",
                    model=name,
                    count=missing,
                )
            )
        head = f"{name}_" if several else ""
        hierarchy += _bone_lines(tree, head, int(several))
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


def _joint_lines(offset: Floats, root: bool, depth: int) -> list[str]:
    """OFFSET [m, written in cm] and CHANNELS of one joint."""
    turns = [f"{axis.upper()}rotation" for axis in _ORDER]
    channels = [*PLACES, *turns] if root else turns
    tabs = "\t" * depth
    return [
        tabs + "OFFSET " + " ".join(f"{100 * x:.9f}" for x in offset),
        tabs + f"CHANNELS {len(channels)} " + " ".join(channels),
    ]


def _bone_lines(tree: JointTree, head: str, depth: int) -> list[str]:
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
        lines += _joint_lines(tree.offsets[bone], bone == 0, depth + 1)
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


def _bone_channels(
    tree: JointTree, hinges: tuple[str, ...], poses: Floats
) -> list[Floats]:
    """Channel values of a tree's bones in the order of their lines."""
    angles = dict(zip(hinges, poses[:, 7:].T, strict=True))
    blocks: list[Floats] = [100.0 * poses[:, :3]]
    for bone in _depth_first(tree):
        turn = matrix_from_quaternion(poses[:, 3:7])
        if bone:
            turn = np.tile(np.eye(3), (len(poses), 1, 1))
            for hinge in np.flatnonzero(tree.hinge_bone == bone):
                angle = angles[tree.hinges[hinge]]
                turn = turn @ about_line(tree.axes[hinge], angle)
        euler = euler_from_matrix(turn, _ORDER)
        blocks.append(np.degrees(np.unwrap(euler, axis=0)))
    return blocks


def _depth_first(tree: JointTree) -> list[int]:
    """Bones in the order of their lines."""
    below, left, found = _children(tree), [0], []
    while left:
        found.append(left.pop())
        left += reversed(below[found[-1]])
    return found
