"""Which samples were filled, in a C3D file whose residuals were not recorded.

A fourth word of 0 says that a point was computed. In files in which every word is 0 it
says nothing, so a filled sample could not be told from the measured ones beside it,
whose words are not handclean's to change. Such a file gets a group of handclean's own,
which other programs pass over::

    HANDCLEAN:FILLED       integers of 16 bits without a sign, 4 for each run of filled
                           samples: the point (from 1), its first frame (from 0; low
                           word, high word), frames; and FILLED2, FILLED3 ...
    HANDCLEAN:FILLED_CRC   two words, low first: CRC-32 of the coordinates, 32-bit
                           floats as the file counts them, run by run

The sum tells, where another program has cut, moved or computed the points since, that
the list is not of these samples; then it is not believed.
"""

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Bytes, Floats, runs
from handclean.io.c3d.columns import Columns
from handclean.io.c3d.draft import BLOCK_SAMPLES, Source
from handclean.io.c3d.edit import with_shorts, with_text, without_group
from handclean.io.c3d.numbers import Words
from handclean.io.c3d.parameters import BLOCK_BYTES, MOST_PARAMETER_BLOCKS, Section
from handclean.io.c3d.samples import SHORT_MAX, Coding
from handclean.recording import Origin, Recording

GROUP = "HANDCLEAN"
_ABOUT = "samples that were filled, of a file without residuals: point, frame, frames"
_SPARED_BYTES = 1024
"""Bytes of a parameter section that are left for what else is added to it (chosen)."""

Runs = NDArray[np.int64]
"""(R, 3) point and first frame from 0, frames."""


@dataclass(frozen=True, kw_only=True)
class Marks:
    """Runs of filled samples and the sum of their coordinates."""

    runs: Runs
    crc: int


NO_MARKS = Marks(runs=np.zeros((0, 3), np.int64), crc=0)


def is_unrecorded(source: Source) -> bool:
    """Whether no fourth word of a source's points is above 0, and one is 0."""
    labels, outputs = source.head.labels(source.points), source.head.outputs()
    points = [column for column, label in enumerate(labels) if label not in outputs]
    if source.frames is None or not points:
        return False
    some = False
    step = max(BLOCK_SAMPLES // source.points, 1)
    for begin in range(0, len(source.frames), step):
        fourth = source.words(slice(begin, begin + step))[:, points, 3]
        with np.errstate(all="ignore"):
            word = source.coding.numbers(fourth)
            if np.any((word > 0) & (word <= SHORT_MAX)):
                return False
            some = some or bool(np.any(word == 0))
    return some


def marks_of(recording: Recording, columns: Columns, coding: Coding) -> Marks:
    """Find the filled samples of a recording in the columns of a file to be written."""
    at, index = columns.markers
    found, sums = [], 0
    if recording.markers is not None:
        computed = np.isin(recording.markers.origin, (Origin.FILLED, Origin.SMOOTHED))
        for column, marker in zip(at.tolist(), index.tolist(), strict=True):
            places = recording.markers.positions[:, marker]
            here = computed[:, marker] & np.isfinite(places.sum(axis=1))
            for start, stop in runs(here):
                found.append((column, start, stop - start))
                words = coding.words(places[start:stop] * (1.0 / coding.step))
                sums = _summed(sums, words, coding)
    table = np.array(found, dtype=np.int64).reshape(-1, 3)
    return Marks(runs=table, crc=sums)


def with_marks(section: Section, marks: Marks) -> Section | None:
    """Put marks in the place of those a section has; None if there is no room.

    A section that says the same already is handed back as it is.
    """
    if _same(read_marks(section), marks):
        return section
    section = without_group(section, GROUP)
    if not len(marks.runs):
        return section
    rows = [row for run in marks.runs.tolist() for row in _rows(*run)]
    room = (
        MOST_PARAMETER_BLOCKS * BLOCK_BYTES
        - _SPARED_BYTES
        - sum(len(e.raw) for e in section.entries)
    )
    taken = {entry.group for entry in section.entries}
    if 8 * len(rows) + 32 * (len(rows) // 255 + 1) > room or len(taken) >= 127:
        return None
    section = with_text(section, GROUP, "ABOUT", _ABOUT)
    for number in range(-(-len(rows) // 255)):
        part = np.array(rows[255 * number : 255 * (number + 1)])
        name = f"FILLED{number + 1}" if number else "FILLED"
        section = with_shorts(
            section, GROUP, name, part.ravel().tolist(), (4, len(part))
        )
    crc = [marks.crc % 65536, marks.crc // 65536]
    return with_shorts(section, GROUP, "FILLED_CRC", crc)


def _rows(column: int, start: int, count: int) -> list[tuple[int, int, int, int]]:
    """A run as the file has it, in parts of 65535 frames at most."""
    return [
        (column + 1, at % 65536, at // 65536, min(65535, start + count - at))
        for at in range(start, start + count, 65535)
    ]


def _same(old: Marks | None, new: Marks) -> bool:
    if old is None:
        return not len(new.runs)
    rows = [row for run in new.runs.tolist() for row in _rows(*run)]
    table = np.array([(c - 1, lo + 65536 * hi, n) for c, lo, hi, n in rows], np.int64)
    return old.crc == new.crc and np.array_equal(old.runs, table.reshape(-1, 3))


def read_marks(section: Section) -> Marks | None:
    """Return the marks of a section, None if it has none."""
    parts: list[Floats] = []
    for number in range(1, 1 << 16):
        name = f"FILLED{number}" if number > 1 else "FILLED"
        values = section.numbers(GROUP, name, unsigned=True)
        if not len(values):
            break
        parts.append(values[: len(values) // 4 * 4])
    crc = section.numbers(GROUP, "FILLED_CRC", unsigned=True)
    if (
        not parts
        or len(crc) != 2
        or not np.isfinite(np.concatenate([*parts, crc])).all()
    ):
        return None
    table = np.concatenate(parts).reshape(-1, 4).astype(np.int64)
    found = np.column_stack([table[:, 0] - 1, table[:, 1] + 65536 * table[:, 2]])
    low, high = crc.astype(np.int64).tolist()
    return Marks(runs=np.column_stack([found, table[:, 3]]), crc=low + 65536 * high)


def apply_marks(
    marks: Marks, words: Words, coding: Coding, columns: NDArray[np.intp], origin: Bytes
) -> int:
    """Mark samples as filled; return how many, -1 if the marks are of other samples.

    Parameters
    ----------
    words : (T, C, 4) of the file's points.
    columns : (M,) those that are markers.
    origin : (T, M), changed.
    """
    frames = len(words)
    marker = np.full(words.shape[1], -1)
    marker[columns] = np.arange(len(columns))
    sums, where = 0, []
    for column, start, count in marks.runs.tolist():
        inside = (
            0 <= column < len(marker) and count > 0 and 0 <= start <= frames - count
        )
        if not inside or marker[column] < 0:
            return -1
        rows = slice(start, start + count)
        if np.any(origin[rows, marker[column]] != Origin.MEASURED):
            return -1
        sums = _summed(sums, words[rows, column, :3], coding)
        where.append((rows, marker[column]))
    if sums != marks.crc:
        return -1
    for rows, index in where:
        origin[rows, index] = Origin.FILLED
    return int(marks.runs[:, 2].sum())


def _summed(sums: int, words: Words, coding: Coding) -> int:
    """CRC-32 that goes on with the coordinates of some samples; -0 counts as 0."""
    numbers = coding.numbers(words).astype(np.float32) + np.float32(0.0)
    return zlib.crc32(np.ascontiguousarray(numbers, "<f4").tobytes(), sums)
