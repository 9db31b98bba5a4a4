"""Tables of numbers in text: fast where they are clean, exact words where not.

Lines are parsed one by one from the bytes, without decoding, into one flat array, so
that memory stays within a small multiple of the file's size whatever it claims.
"""

import math
from array import array
from collections.abc import Collection
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import FileError, Place
from handclean.io.shared.missing import number_in
from handclean.io.shared.reading import text
from handclean.remarks import Remark, remark

MOST_COLUMNS = 100_000
"""Columns of a table, at most (chosen)."""

_BLANK = b" \t\v\f"


class Lines:
    """The lines of a text, one after another, with their numbers (from 1)."""

    def __init__(self, path: Path, content: bytes) -> None:
        self.path = path
        self.number = 0
        self.ended = True
        """Whether the line read last had an end; a file that was cut may lack it."""
        self._stream = BytesIO(content)

    @property
    def where(self) -> Place:
        """The file and the line read last, for messages."""
        return Place(self.path, f" line {self.number}")

    def next(self) -> bytes | None:
        """Return the next line without its end, None after the last."""
        line = self._stream.readline()
        if not line:
            return None
        self.number += 1
        self.ended = line.endswith(b"\n")
        return line.rstrip(b"\n")

    def peek(self, after: int = 0) -> bytes | None:
        """Return the next line, or one ``after`` it, and leave all to be read."""
        place = self._stream.tell()
        for _ in range(after + 1):
            line = self._stream.readline()
        self._stream.seek(place)
        return line.rstrip(b"\n") if line else None

    def cells(self, delimiter: bytes | None) -> list[bytes]:
        """Return the next line's cells, stripped.

        Raises
        ------
        FileError
            If there is no further line, or it has more columns than any recording.
        """
        line = self.next()
        if line is None:
            raise FileError(self.path, f"ends after line {self.number}")
        cells = line.split(delimiter, MOST_COLUMNS)
        if len(cells) > MOST_COLUMNS:
            raise FileError(self.where, f"has more than {MOST_COLUMNS} columns")
        return [cell.strip() for cell in cells]


@dataclass
class Beyond:
    """Numbers beyond a table's columns, three for each point without a name.

    Attributes
    ----------
    row : (P,) of the table; place : (P,) within the row, from 0.
    numbers : (3 P,)
    """

    row: "array[int]" = field(default_factory=lambda: array("q"))
    place: "array[int]" = field(default_factory=lambda: array("q"))
    numbers: "array[float]" = field(default_factory=lambda: array("d"))

    def arrays(self) -> tuple[Ints, Ints, Floats]:
        """(P,) rows, (P,) places and (P, 3) numbers."""
        return (
            np.array(self.row, dtype=np.int64),
            np.array(self.place, dtype=np.int64),
            np.array(self.numbers, dtype=np.float64).reshape(-1, 3),
        )


@dataclass(frozen=True, kw_only=True)
class Form:
    """What rows look like.

    Attributes
    ----------
    columns : how many numbers a row has.
    delimiter : what parts the cells; None for white space.
    ends : how many cells a row may have, too, where blanks at its end were cut off.
    beyond : collects what stands beyond the columns; None: they must be blank.
    numbered : whether a column counts frames, so that a row of blanks is none.
    """

    columns: int
    delimiter: bytes | None
    ends: Collection[int] = ()
    beyond: Beyond | None = None
    numbered: bool = False


def read_numbers(
    lines: Lines, form: Form, remarks: list[Remark], *, lenient: bool = False
) -> Floats:
    """Read the rest of the lines as rows of numbers.

    Blank lines are skipped; blank cells, ``nan``, ``NULL`` and the like are NaN.

    Parameters
    ----------
    remarks : infinite numbers, rows that end early and a row left out are appended.
    lenient : leave out a last row that cannot be read, as a cut file has it.

    Returns
    -------
    (N, columns), N > 0

    Raises
    ------
    FileError
        With the line and column of what is not a number; or if there is no row.
    """
    values, short = array("d"), 0
    nothing = _BLANK + (form.delimiter or b"") if form.numbered else _BLANK
    while (line := lines.next()) is not None:
        if not line.strip(nothing):
            continue
        try:
            row, cut = _row(lines, line, form, len(values) // form.columns)
            if cut and not (short or lines.ended):
                raise _of_length(lines, len(line.split(form.delimiter)), form)
        except FileError as error:
            if lines.peek() is not None:
                raise
            saved = len(values) // form.columns
            if not lenient:
                hint = f"a cut file? --lenient saves {saved} rows"
                raise FileError(lines.path, _after(error), hint) from None
            remarks.append(
                remark("damage", f"the last line was left out: {_after(error)}")
            )
            break
        values.extend(row)
        short += cut
    if not values:
        raise FileError(lines.path, "has no frames")
    if short:
        remarks.append(
            remark(
                "missing",
                f"{short} rows end early: what they lack counts as missing",
                rows=short,
            )
        )
    grid = np.frombuffer(values, dtype=np.float64).reshape(-1, form.columns).copy()
    infinite = np.isinf(grid)
    if infinite.any():
        grid[infinite] = np.nan
        remarks.append(
            remark(
                "missing",
                f"{infinite.sum()} infinite numbers count as missing",
                numbers=int(infinite.sum()),
            )
        )
    return grid


def _after(error: FileError) -> str:
    """What is wrong in which line, for a message that names the file."""
    part = error.where.part.strip() if isinstance(error.where, Place) else ""
    return f"{part}: {error.wrong}" if part else error.wrong


def _row(lines: Lines, line: bytes, form: Form, row: int) -> tuple[list[float], bool]:
    """Return a row's numbers, and whether its end was cut off."""
    cells = line.split(form.delimiter, form.columns)
    if len(cells) == form.columns and b"_" not in line:
        try:
            return list(map(float, cells)), False
        except ValueError:
            pass
    blank, rest, cut = _BLANK + (form.delimiter or b""), b"", False
    if len(cells) > form.columns:
        rest = cells.pop().rstrip(blank)
        if rest and form.beyond is None:
            wrong, right = f"has more than {form.columns} cells", _as_many(line, form)
            raise FileError(lines.where, wrong, right)
    elif len(cells) < form.columns:
        while cells and not cells[-1].strip():
            cells.pop()
        if len(cells) not in form.ends:
            raise _of_length(lines, len(cells), form)
        cells += [b""] * (form.columns - len(cells))
        cut = True
    numbers = [_number(lines, i, cell) for i, cell in enumerate(cells, 1)]
    if rest:
        _beyond(lines, rest, form, row)
    return numbers, cut


def _as_many(line: bytes, form: Form) -> str:
    if form.delimiter == b"," and line.count(b",") == 2 * form.columns - 1:
        return "as many as the header has; are its commas decimal ones?"
    return "as many as the header has"


def _of_length(lines: Lines, cells: int, form: Form) -> FileError:
    right = f"the header has {form.columns} columns"
    if form.delimiter is None:
        right += "; between blanks a missing cell cannot be told"
    return FileError(lines.where, f"has {cells} cells", right)


def _beyond(lines: Lines, rest: bytes, form: Form, row: int) -> None:
    """Read what stands beyond the columns as points without a name."""
    assert form.beyond is not None
    cells = rest.split(form.delimiter)
    if len(cells) % 3:
        raise FileError(
            lines.where,
            f"has more than {form.columns} cells, but not three for each point more",
            "as many as the header has, or whole points without a name",
        )
    first = form.columns + 1
    numbers = [_number(lines, first + k, cell) for k, cell in enumerate(cells)]
    for place in range(len(numbers) // 3):
        at = numbers[3 * place : 3 * place + 3]
        if all(map(math.isfinite, at)):
            form.beyond.row.append(row)
            form.beyond.place.append(place)
            form.beyond.numbers.extend(at)


def _number(lines: Lines, column: int, cell: bytes) -> float:
    if not cell.strip():
        return math.nan
    try:
        if b"_" not in cell:
            return float(cell)
    except ValueError:
        pass
    try:
        return number_in(cell)
    except ValueError:
        plain = text(cell).strip()
    raise FileError(
        Place(lines.path, f" line {lines.number} column {column}"),
        f"'{plain[:20]}' is not a number",
        "use a decimal point" if "," in plain else "",
    )
