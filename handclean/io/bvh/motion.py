"""BVH: a hierarchy of joints and how they moved, read from text.

A joint's channels are places (which stand for its offset) and angles in degrees about
axes that are carried along, in the order in which they are listed. BVH has no unit of
length.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import FileError
from handclean.io.bvh.hierarchy import MOST_NUMBER, PLACES, TURNS, Hierarchy
from handclean.io.shared.grid import Form, read_numbers
from handclean.io.shared.lines import Lines
from handclean.io.shared.reading import load_text, text
from handclean.io.shared.rotations import (
    matrix_from_euler,
)
from handclean.io.shared.settle import positive
from handclean.numerics.rotations import rotated
from handclean.remarks import Remark, remark

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
    first_turn : "x", "y" or "z", about which the root turns first; "" if it does not.
    remarks : what was odd about the file.
    """

    names: tuple[str, ...]
    parents: Ints
    offsets: Floats
    places: Floats
    turns: Floats
    ends: Floats
    rate: float
    first_turn: str = ""
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
        first_turn=next((TURNS[k] for k in tree.channels[0] if k in TURNS), ""),
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
