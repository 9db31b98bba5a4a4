"""The points of an opened C3D file as markers, unlabelled points and what was met."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Bytes
from handclean.errors import UsageError
from handclean.io.c3d.columns import as_slice
from handclean.io.c3d.filled_list import apply_marks, read_marks
from handclean.io.c3d.remarks import some_of
from handclean.io.c3d.samples import (
    Coding,
    Samples,
    Tally,
    block_of,
    decode,
    marked_there,
    new_samples,
)
from handclean.io.c3d.structure import Structure
from handclean.recording import Origin, Points, Trajectories
from handclean.remarks import Remark, remark

BLOCK_SAMPLES = 1 << 15
"""Samples decoded at once: they stay in the cache (chosen)."""


@dataclass(frozen=True, kw_only=True)
class PointColumns:
    """Which columns are what; (n,) indices."""

    labels: list[str]
    markers: NDArray[np.intp]
    loose: NDArray[np.intp]
    outputs: NDArray[np.intp]


def sort_columns(structure: Structure, patterns: Sequence[str]) -> PointColumns:
    """Part markers, unlabelled columns and model outputs by their labels.

    Raises
    ------
    UsageError
        If a pattern is no regular expression.
    """
    try:
        loose = [re.compile(pattern) for pattern in patterns]
    except re.error as error:
        raise UsageError(f"unlabelled: {error.pattern!r} is no expression") from None
    labels = structure.head.labels(structure.points)
    outputs = structure.head.outputs()
    kind = [
        2 if label in outputs else int(any(p.search(label) for p in loose))
        for label in labels
    ]
    by_kind = [np.flatnonzero(np.array(kind) == k) for k in range(3)]
    return PointColumns(
        labels=labels, markers=by_kind[0], loose=by_kind[1], outputs=by_kind[2]
    )


def decode_points(
    structure: Structure,
    coding: Coding,
    columns: PointColumns,
    tally: Tally,
    zeros_are_missing: bool,
    believe_coordinates: bool = False,
) -> tuple[Trajectories | None, Points | None]:
    """Markers and unlabelled points of all frames.

    Parameters
    ----------
    believe_coordinates : where every point is marked missing, take those that have
        coordinates, with residuals and cameras unknown.
    """
    frames = structure.layout.held
    found = new_samples(frames, len(columns.markers))
    source = np.empty((frames, len(columns.markers)), np.int32)
    loose = _Loose(frames * len(columns.loose))
    step = max(BLOCK_SAMPLES // max(structure.points, 1), 1)
    words = structure.frames[:, : 4 * structure.points]
    picked, picked_loose = as_slice(columns.markers), as_slice(columns.loose)
    tally.believed = believe_coordinates and _none_there(structure, coding, columns)
    with np.errstate(all="ignore"):
        for begin in range(0, frames if structure.points else 0, step):
            rows = slice(begin, min(begin + step, frames))
            block = words[rows].reshape(-1, structure.points, 4)
            if len(columns.markers):
                here = decode(
                    coding.numbers(block[:, picked]),
                    coding,
                    block_of(found, rows),
                    tally,
                    columns.markers,
                    zeros_are_missing,
                )
                source[rows] = np.where(here, columns.markers.astype(np.int32), -1)
            if len(columns.loose):
                some = new_samples(len(block), len(columns.loose))
                here = decode(
                    coding.numbers(block[:, picked_loose]),
                    coding,
                    some,
                    tally,
                    columns.loose,
                    zeros_are_missing,
                )
                loose.add(begin, here, some, columns.loose)
    if structure.points and not tally.recorded:
        found.origin[found.origin == Origin.FILLED] = Origin.MEASURED
        if marks := read_marks(structure.head.section):
            points = words.reshape(-1, structure.points, 4)
            tally.listed = apply_marks(
                marks, points, coding, columns.markers, found.origin
            )
    return _markers(found, source, columns), loose.points()


def _none_there(structure: Structure, coding: Coding, columns: PointColumns) -> bool:
    """Whether every point, of markers or not, is marked missing."""
    places = np.concatenate([columns.markers, columns.loose])
    step = max(BLOCK_SAMPLES // max(structure.points, 1), 1)
    with np.errstate(all="ignore"):
        for begin in range(0, len(structure.frames), step):
            fourth = structure.frames[begin : begin + step, 4 * places + 3]
            if marked_there(coding.numbers(fourth)).any():
                return False
    return True


def _markers(
    found: Samples, source: NDArray[np.int32], columns: PointColumns
) -> Trajectories | None:
    if not len(columns.markers):
        return None
    return Trajectories(
        positions=found.positions,
        labels=tuple(columns.labels[i] for i in columns.markers),
        model=("",) * len(columns.markers),
        origin=found.origin,
        source=source,
        residual=found.residual,
        cameras=found.cameras,
    )


class _Loose:
    """Collects unlabelled points; room for all is reserved, not touched."""

    def __init__(self, most: int) -> None:
        self.count = 0
        self.most = most
        self.frame = np.empty(most, np.int32)
        self.source = np.empty(most, np.int32)
        self.positions = np.empty((most, 3))
        self.residual = np.empty(most, np.float32)
        self.cameras: Bytes = np.empty(most, np.uint8)

    def add(
        self,
        begin: int,
        here: NDArray[np.bool_],
        some: Samples,
        columns: NDArray[np.intp],
    ) -> None:
        """Append the points of a block that begins at a frame."""
        frame, column = np.nonzero(here)
        rows = slice(self.count, self.count + len(frame))
        self.frame[rows] = frame + begin
        self.source[rows] = columns[column]
        self.positions[rows] = some.positions[here]
        self.residual[rows] = some.residual[here]
        self.cameras[rows] = some.cameras[here]
        self.count = rows.stop

    def points(self) -> Points | None:
        """Return what was collected, None if there was no room for any."""
        if not self.most:
            return None
        rows = slice(0, self.count)
        return Points(
            frame=self.frame[rows],
            source=self.source[rows],
            positions=self.positions[rows],
            residual=self.residual[rows],
            cameras=self.cameras[rows],
        )


def decisions(tally: Tally, labels: list[str], zeros_are_missing: bool) -> list[Remark]:
    """Remark on what decoding decided about samples."""
    remarks: list[Remark] = []
    if tally.zeros:
        names = some_of([labels[i] or f"point {i}" for i in tally.zeros])
        taken = "missing" if zeros_are_missing else "measured"
        total = sum(tally.zeros.values())
        remarks.append(
            remark(
                "missing",
                f"{total} points at (0, 0, 0) count as {taken}: {names}",
                samples=total,
            )
        )
    if tally.not_finite:
        remarks.append(
            remark(
                "missing",
                f"{tally.not_finite} points with NaN or infinity count as missing",
                samples=tally.not_finite,
            )
        )
    if tally.computed and tally.recorded:
        remarks.append(
            remark(
                "filled",
                f"{tally.computed} points have residual 0 where others have one: they "
                "were interpolated or computed and do not count as measured",
                samples=tally.computed,
            )
        )
    if tally.listed > 0:
        remarks.append(
            remark(
                "filled",
                f"{tally.listed} points are listed in HANDCLEAN:FILLED: they were "
                "filled and do not count as measured",
                samples=tally.listed,
            )
        )
    if tally.listed < 0:
        remarks.append(
            remark(
                "filled",
                "HANDCLEAN:FILLED lists other samples than these: which of them were "
                "filled is not known",
            )
        )
    if tally.believed:
        remarks.append(
            remark(
                "missing",
                f"every point is marked missing; {tally.computed} that have "
                "coordinates are believed, as --believe-coordinates has it",
                samples=tally.computed,
            )
        )
    if tally.strange:
        remarks.append(
            remark(
                "missing",
                f"{tally.strange} points with a senseless fourth word are missing",
                samples=tally.strange,
            )
        )
    if tally.with_place and tally.invalid == tally.samples:
        remarks.append(
            remark(
                "missing",
                f"every point is marked missing, though {tally.with_place} have "
                "coordinates; --believe-coordinates takes these",
                samples=tally.with_place,
            )
        )
    return remarks


def taken_as_is(tally: Tally, coding: Coding) -> list[Remark]:
    """Remark on what decoding met and took as it is."""
    remarks: list[Remark] = []
    if tally.computed and not (tally.recorded or tally.believed):
        remarks.append(remark("header", "all residuals are 0: they were not recorded"))
    if tally.unsigned:
        remarks.append(
            remark(
                "header",
                f"{tally.unsigned} points are marked missing by an unsigned word",
            )
        )
    if tally.fractional:
        remarks.append(
            remark("header", f"{tally.fractional} fourth words are not whole numbers")
        )
    if tally.with_place and tally.invalid < tally.samples:
        remarks.append(
            remark(
                "missing",
                f"{tally.with_place} points marked missing have coordinates",
                samples=tally.with_place,
            )
        )
    if tally.extreme:
        remarks.append(
            remark(
                "implausible",
                f"{tally.extreme} coordinates are at the end of 16 bits "
                f"({32767 * coding.scale:g}): they may have overflown",
            )
        )
    return remarks
