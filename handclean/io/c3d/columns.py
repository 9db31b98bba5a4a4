"""Which columns a written C3D file has, and what fills them.

A recording that came from a C3D file keeps that file's columns in their order: markers
by their label, unlabelled ones while a point is left in them (or if there never was
one), model outputs always. A column goes when its marker is gone or when all its points
have become something else. New markers come behind the labelled ones, before the
unlabelled; points that have no column of their own share new ones, named ``*N``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Floats, Ints
from handclean.errors import FileError
from handclean.recording import Motion, Points, Recording

MOST_COLUMNS = 65535
"""Points of a C3D: what its header's 16 bits can count."""

Indices = NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column to write.

    Attributes
    ----------
    home : the source's column it stands for, -1 if new.
    marker, output : index of the marker or angle triple that fills it, -1 if none.
    """

    label: str
    description: str = ""
    home: int = -1
    marker: int = -1
    output: int = -1


@dataclass(frozen=True, kw_only=True)
class Columns:
    """All columns to write.

    Attributes
    ----------
    columns : in order.
    point_column : (P,) the column of each unlabelled point.
    raw : (n,) columns copied whole from the source: its model outputs.
    """

    columns: tuple[Column, ...]
    point_column: Indices
    raw: Indices

    @cached_property
    def homes(self) -> tuple[Indices, Indices]:
        """Columns that stand for one of the source, and for which."""
        return _those([c.home for c in self.columns])

    @cached_property
    def markers(self) -> tuple[Indices, Indices]:
        """Columns that hold a marker, and which."""
        return _those([c.marker for c in self.columns])

    @cached_property
    def outputs(self) -> tuple[Indices, Indices]:
        """Columns that hold joint angles, and which."""
        return _those([c.output for c in self.columns])

    @property
    def unchanged(self) -> bool:
        """Whether these are the source's columns, one by one."""
        return all(c.home == i for i, c in enumerate(self.columns))


def _those(values: list[int]) -> tuple[Indices, Indices]:
    array = np.array(values, dtype=np.intp)
    at = np.flatnonzero(array >= 0)
    return at, array[at]


def as_slice(columns: Indices) -> slice | Indices:
    """Neighbouring columns as a slice, which needs no copy; others as they are."""
    if len(columns) and (np.diff(columns) == 1).all():
        return slice(int(columns[0]), int(columns[-1]) + 1)
    return columns


@dataclass(frozen=True, kw_only=True)
class Angles:
    """Joint angles as points: up to three per joint, in radians.

    Attributes
    ----------
    labels, descriptions : N joints; which angle each coordinate is.
    values : (T, N, 3) [rad], 0 for coordinates that a joint has not.
    """

    labels: tuple[str, ...] = ()
    descriptions: tuple[str, ...] = ()
    values: Floats


def angles_of(recording: Recording) -> Angles:
    """Gather the angles of all motions by joint: ``right:index_mcp``.

    Where a motion is not trusted its angles are NaN: C3D calls points invalid, no more.
    """
    labels: list[str] = []
    descriptions: list[str] = []
    parts: list[Floats] = []
    for name, motion in recording.motions.items():
        for joint, columns in _joints(motion).items():
            triple = np.zeros((len(motion.angles), 3))
            triple[:, : len(columns)] = motion.angles[:, columns]
            if motion.trusted is not None:
                triple[~motion.trusted] = np.nan
            parts.append(triple)
            labels.append(f"{name}:{joint}")
            kinds = [motion.names[c].removeprefix(f"{joint}_") for c in columns]
            descriptions.append(", ".join(kinds))
    values = np.stack(parts, axis=1) if parts else np.zeros((recording.frames, 0, 3))
    return Angles(labels=tuple(labels), descriptions=tuple(descriptions), values=values)


def _joints(motion: Motion) -> dict[str, list[int]]:
    """Columns of each joint: angle names up to their last word, three at most."""
    joints: dict[str, list[int]] = {}
    for column, name in enumerate(motion.names):
        joint = name.rsplit("_", 1)[0]
        if len(joints.get(joint, [])) == 3:
            joint = name
        joints.setdefault(joint, []).append(column)
    return joints


def plan_columns(
    recording: Recording,
    angles: Angles,
    labels: Sequence[str],
    outputs: set[str],
    loose: Mapping[int, bool],
    where: Path | str,
) -> Columns:
    """Decide on the columns.

    Parameters
    ----------
    labels : of the source's columns; none for a new file.
    outputs : labels of the source that are model outputs.
    loose : the source's columns that were read as unlabelled, and whether each has
        no point at all.

    Raises
    ------
    FileError
        If there are no columns, or more than the format can count.
    """
    homes = _marker_homes(recording, labels, outputs)
    columns: list[Column] = []
    loose_homes = _loose_homes(recording.unlabelled)
    marker_of = {home: m for m, home in enumerate(homes) if home >= 0}
    output_of = {label: i for i, label in enumerate(angles.labels)}
    for home, label in enumerate(labels):
        is_output = label in outputs
        is_loose = home in loose and (loose[home] or home in loose_homes)
        if home in marker_of or is_output or is_loose:
            columns.append(
                Column(
                    label=label,
                    home=home,
                    marker=marker_of.get(home, -1),
                    output=output_of.pop(label, -1) if is_output else -1,
                )
            )
    new = _new_markers(recording, homes)
    new += [
        Column(label=label, description=angles.descriptions[i], output=i)
        for label, i in output_of.items()
    ]
    if new:
        settled = [c.marker >= 0 or c.label in outputs for c in columns]
        parts = list(zip(columns, settled, strict=True))
        named = [c for c, is_settled in parts if is_settled]
        columns = named + new + [c for c, is_settled in parts if not is_settled]
    point_column, shared = _place_points(recording.unlabelled, columns, loose)
    taken = {c.label for c in columns}
    names = (f"*{n}" for n in range(MOST_COLUMNS + len(taken) + 1))
    free = (name for name in names if name not in taken)
    columns += [Column(label=next(free)) for _ in range(shared)]
    if not columns:
        raise FileError(where, "nothing to write: the take has no points")
    if len(columns) > MOST_COLUMNS:
        raise FileError(where, f"{len(columns)} columns are more than C3D can count")
    raw = [i for i, c in enumerate(columns) if c.label in outputs and c.output < 0]
    return Columns(
        columns=tuple(columns),
        point_column=point_column,
        raw=np.array(raw, dtype=np.intp),
    )


def _marker_homes(
    recording: Recording, labels: Sequence[str], outputs: set[str]
) -> list[int]:
    """Source column of each marker, by label; the n-th of a label for its n-th."""
    free: dict[str, list[int]] = {}
    for column, label in enumerate(labels):
        if label not in outputs:
            free.setdefault(label, []).append(column)
    if recording.markers is None:
        return []
    return [
        free[label].pop(0) if free.get(label) else -1
        for label in recording.markers.labels
    ]


def _new_markers(recording: Recording, homes: Sequence[int]) -> list[Column]:
    if recording.markers is None:
        return []
    named = zip(recording.markers.labels, recording.markers.model, strict=True)
    return [
        Column(label=label, description=model, marker=m)
        for m, (label, model) in enumerate(named)
        if homes[m] < 0
    ]


def _loose_homes(points: Points | None) -> set[int]:
    if points is None:
        return set()
    return set(np.unique(points.source[points.source >= 0]).tolist())


def _place_points(
    points: Points | None, columns: Sequence[Column], loose: Mapping[int, bool]
) -> tuple[Indices, int]:
    """(P,) column of each unlabelled point, and how many new columns that takes.

    A point stays in the unlabelled column it came from if that is here and holds no
    marker; of two in one frame the first stays. If nothing is here at all, as in a new
    file, source columns are kept as far as they are told apart. All others share new
    columns, each frame counting from the first.
    """
    if points is None or not len(points.frame):
        return np.zeros(0, dtype=np.intp), 0
    home = {
        c.home: i for i, c in enumerate(columns) if c.home in loose and c.marker < 0
    }
    if not any(c.home >= 0 for c in columns) and _told_apart(points):
        used, column = np.unique(points.source, return_inverse=True)
        return len(columns) + column.astype(np.intp), len(used)
    most = max(home, default=-1) + 1
    place = np.full(most + 1, -1, dtype=np.intp)  # the last for those that have none
    place[list(home)] = list(home.values())
    known = (points.source >= 0) & (points.source < most)
    placed = place[np.where(known, points.source, most)]
    placed[_again_in_a_frame(points)] = -1
    others = np.flatnonzero(placed < 0)
    frame: Ints = points.frame[others].astype(np.int64)
    rank = np.arange(len(others)) - np.searchsorted(frame, frame)
    placed[others] = len(columns) + rank
    return placed, int(rank.max()) + 1 if len(others) else 0


def _again_in_a_frame(points: Points) -> Indices:
    """Rows whose frame has an earlier row of the same source."""
    pairs = points.frame.astype(np.int64) * 2**32 + points.source
    if (np.diff(pairs) > 0).all():  # as they are read
        return np.zeros(0, dtype=np.intp)
    _, first = np.unique(pairs, return_index=True)
    again = np.ones(len(pairs), bool)
    again[first] = False
    return np.flatnonzero(again)


def _told_apart(points: Points) -> bool:
    """Whether source columns tell points of one frame apart and are not too many."""
    if points.source.min() < 0 or len(_again_in_a_frame(points)):
        return False
    most = int(np.bincount(points.frame).max())
    return len(np.unique(points.source)) <= 4 * most + 16
