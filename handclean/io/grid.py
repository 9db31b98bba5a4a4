"""Tables of numbers in text: fast where they are clean, exact words where not.

Lines are parsed one by one from the bytes, without decoding, into one flat array, so
that memory stays within a small multiple of the file's size whatever it claims.
"""

import math
from array import array
from io import BytesIO
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, Place

MOST_COLUMNS = 100_000


class Lines:
    """The lines of a text, one after another, with their numbers (from 1)."""

    def __init__(self, path: Path, content: bytes) -> None:
        self.path = path
        self.number = 0
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


def read_numbers(
    lines: Lines,
    columns: int,
    delimiter: bytes | None,
    traps: list[str],
    *,
    lenient: bool = False,
) -> Floats:
    """Read the rest of the lines as rows of numbers.

    Blank lines are skipped, blank cells and ``nan`` are NaN, cells beyond ``columns``
    must be blank.

    Parameters
    ----------
    columns : how many numbers a row has.
    delimiter : what parts the cells; None for white space.
    traps : infinite numbers and a row left out are appended.
    lenient : leave out a last row that cannot be read, as a cut file has it.

    Returns
    -------
    (N, columns), N > 0

    Raises
    ------
    FileError
        With the line and column of what is not a number; or if there is no row.
    """
    values = array("d")
    while (line := lines.next()) is not None:
        if not line.strip():
            continue
        try:
            values.extend(_row(lines, line, columns, delimiter))
        except FileError as error:
            if lines.peek() is not None:
                raise
            saved = len(values) // columns
            if not lenient:
                hint = f"a cut file? --lenient saves {saved} rows"
                raise FileError(lines.path, _after(error), hint) from None
            traps.append(f"the last line was left out: {_after(error)}")
    if not values:
        raise FileError(lines.path, "has no frames")
    grid = np.frombuffer(values, dtype=np.float64).reshape(-1, columns).copy()
    infinite = np.isinf(grid)
    if infinite.any():
        grid[infinite] = np.nan
        traps.append(f"{infinite.sum()} infinite numbers count as missing")
    return grid


def _after(error: FileError) -> str:
    """What is wrong in which line, for a message that names the file."""
    part = error.where.part.strip() if isinstance(error.where, Place) else ""
    return f"{part}: {error.wrong}" if part else error.wrong


def _row(
    lines: Lines, line: bytes, columns: int, delimiter: bytes | None
) -> list[float]:
    cells = line.split(delimiter, columns)
    if len(cells) == columns and b"_" not in line:
        try:
            return list(map(float, cells))
        except ValueError:
            pass
    if len(cells) > columns:
        if cells.pop().strip(b" \t\v\f" + (delimiter or b"")):
            wrong = f"has more than {columns} cells"
            raise FileError(lines.where, wrong, "as many as the header has")
    elif len(cells) < columns:
        wrong = f"has {len(cells)} cells"
        raise FileError(lines.where, wrong, f"the header has {columns} columns")
    return [_number(lines, i, cell.strip()) for i, cell in enumerate(cells, 1)]


def _number(lines: Lines, column: int, cell: bytes) -> float:
    if not cell:
        return math.nan
    try:
        if b"_" not in cell:
            return float(cell.strip(b'"') or b"nan")
    except ValueError:
        pass
    shown = cell[:20].decode("utf-8", "replace")
    right = "use a decimal point" if b"," in cell else ""
    raise FileError(
        Place(lines.path, f" line {lines.number} column {column}"),
        f"'{shown}' is not a number",
        right,
    )
