"""A glove's readings as CSV, with a header or without."""

import json
import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, Place
from handclean.io.glove.readings_file import MARK, Piece, ReadingsFile
from handclean.io.shared.clock import SECONDS_SAID, Column, time_column
from handclean.io.shared.missing import number_in
from handclean.io.shared.reading import text as as_text

_FRAME = {"frame", "frames", "frameno", "framenumber", "sample"}
_LINE_CHARACTERS = 2**20
"""Characters of a line, at most (chosen)."""

_NAME_CHARACTERS = 40
"""Characters of a column's name that are looked at and shown (chosen)."""


@dataclass(frozen=True, kw_only=True)
class CsvReadings(ReadingsFile):
    """Readings in a CSV.

    Attributes
    ----------
    time_column : the column of times, -1 for none; clock : what it says of its unit.
    skipped : columns that hold no readings.
    head_lines : lines before the first reading.
    """

    row: ClassVar[str] = "line"
    clock_name: ClassVar[str] = "column of times"
    time_column: int = -1
    clock: Column = SECONDS_SAID
    skipped: tuple[int, ...] = ()
    head_lines: int = 0

    @property
    def has_times(self) -> bool:
        """Whether it has a column of times."""
        return self.time_column >= 0

    @property
    def says_time_unit(self) -> bool:
        """Whether it says in what unit its times are."""
        return self.clock.says

    def pieces(self, size: int) -> Iterator[Piece]:
        """Go through times, readings and numbers of lines."""
        width = self.columns + len(self.skipped)
        done, rows, numbers = 0, [], []
        with self.path.open("rb") as file:
            for number, line in enumerate(_lines(self.path, file), start=1):
                if number <= self.head_lines or not line.strip():
                    continue
                rows.append(_numbers(self.path, number, line, width))
                numbers.append(number)
                if len(rows) == size:
                    yield *self._split(np.array(rows), done), numbers
                    done, rows, numbers = done + len(rows), [], []
        if rows:
            yield *self._split(np.array(rows), done), numbers

    def _split(self, grid: Floats, done: int) -> tuple[Floats, Floats]:
        values = np.delete(grid, self.skipped, axis=1)
        if self.has_times:
            return grid[:, self.time_column] * self.clock.seconds, values
        return (done + np.arange(len(grid))) / self.rate, values


def open_csv(path: Path, sensors: int) -> CsvReadings:
    """Look at the head of a CSV.

    Parameters
    ----------
    sensors : of the glove; tells a column of times in files without a header.

    Raises
    ------
    FileError
        If it is not one of readings.
    """
    facts: dict[str, Any] = {}
    with path.open("rb") as file:
        lines = _lines(path, file)
        skipped = 0
        for line in lines:
            if b"\0" in line or b"\r" in line.rstrip(b"\r\n"):
                wrong = "is not lines of text with their ends as they should be"
                raise FileError(path, wrong, "save it as CSV in UTF-8")
            text = line.decode("utf-8", "replace").strip().lstrip("\ufeff")
            if text.startswith(MARK):
                facts = _facts(path, text.removeprefix(MARK))
            if text and not text.startswith(("#", '"#')):  # quoted by spreadsheets
                break
            skipped += 1
        else:
            raise FileError(path, "has no readings")
    for mark, name in ((";", "semicolons"), ("\t", "tabs")):
        if mark in text:
            right = "save it with commas and decimal points"
            raise FileError(path, f"its cells are parted by {name}", right)
    cells = [cell.strip().strip('"') for cell in text.split(",")]
    if all(_is_number(cell) for cell in cells):
        first = len(cells) == sensors + 1
        return CsvReadings(
            path=path,
            sensors=(),
            columns=len(cells) - first,
            rate=math.nan,
            facts=facts,
            time_column=0 if first else -1,
            skipped=(0,) if first else (),
            head_lines=skipped,
        )
    clocks = {k: said for k, cell in enumerate(cells) if (said := time_column(cell))}
    plain = [
        re.split(r"[(\[]", cell[:_NAME_CHARACTERS])[0].casefold() for cell in cells
    ]
    others = [k for k, name in enumerate(plain) if name.replace(" ", "") in _FRAME]
    leave = dict.fromkeys((*clocks, *others))
    names = tuple(cell for k, cell in enumerate(cells) if k not in leave)
    double = sorted(name for name, count in Counter(names).items() if count > 1)
    if double or "" in names:
        what = (
            f"'{double[0][:_NAME_CHARACTERS]}' twice"
            if double
            else "a column without a name"
        )
        raise FileError(
            path, f"has {what}", "every sensor should have a name of its own"
        )
    if not names:
        raise FileError(path, "has no column of readings")
    return CsvReadings(
        path=path,
        sensors=names,
        columns=len(names),
        rate=math.nan,
        facts=facts,
        time_column=next(iter(clocks), -1),
        clock=next(iter(clocks.values()), SECONDS_SAID),
        skipped=tuple(leave),
        head_lines=skipped + 1,
    )


def _facts(path: Path, text: str) -> dict[str, Any]:
    try:
        found = json.loads(text or "{}")
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise FileError(path, "its first line is damaged: no JSON object")
    return found


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _lines(path: Path, file: Any) -> Iterator[bytes]:
    number = 0
    while line := file.readline(_LINE_CHARACTERS):
        number += 1
        if len(line) == _LINE_CHARACTERS:
            raise FileError(
                Place(path, f" line {number}"), "is longer than any of readings"
            )
        yield line


def _numbers(path: Path, number: int, line: bytes, width: int) -> list[float]:
    cells = line.rstrip(b"\r\n").split(b",")
    if len(cells) != width:
        raise FileError(
            Place(path, f" line {number}"),
            f"has {len(cells)} cells",
            f"not {width} as above",
        )
    try:
        if b"_" not in line:
            return list(map(float, cells))
    except ValueError:
        pass
    return [_number(path, number, cell) for cell in cells]


def _number(path: Path, number: int, cell: bytes) -> float:
    try:
        return number_in(cell)
    except ValueError:
        wrong = f"'{as_text(cell[:20]).strip()}' is not a number"
        raise FileError(Place(path, f" line {number}"), wrong) from None
