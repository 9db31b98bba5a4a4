"""Tables of numbers in text: fast where they are clean, exact words where not.

Blocks of whole lines are read at once by `handclean.io.shared.decimals`. A block that
is not plainly numbers is parsed line by line, which says where it is not. All goes from
the bytes, without decoding, into one flat array, so that memory stays within a small
multiple of the file's size whatever it claims.
"""

import math
from array import array
from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import FileError, Place
from handclean.io.shared import decimals
from handclean.io.shared.lines import Lines
from handclean.io.shared.missing import number_in
from handclean.io.shared.reading import text
from handclean.remarks import Remark, remark

_CELLS = 24_000
"""Cells that are read at once (chosen: half as many take 1.1 times as long)."""

_LARGEST = 1 << 18
"""[bytes] of the cells that are read at once, at most (chosen)."""

_INFINITE = 1e300
"""A number beyond this is as good as infinite: no unit can be changed (chosen)."""

_KEPT = 1 << 20
"""Numbers of an array that is asked for and given back before many blocks are read.
After that the C library of Linux keeps what smaller arrays give back; else it has every
array's pages from the system anew, which takes as long as all the rest (measured)."""

_BLANK = b" \t\v\f"


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
    ignored : columns that may hold anything; they are NaN.
    """

    columns: int
    delimiter: bytes | None
    ends: Collection[int] = ()
    beyond: Beyond | None = None
    numbered: bool = False
    ignored: Collection[int] = ()


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
    rows = _Rows(form=form)
    size = min(_CELLS * len(lines.peek() or b" ") // form.columns, _LARGEST)
    if len(lines.block(4 * _LARGEST)) > 2 * _LARGEST:
        np.zeros(_KEPT)
    while (block := lines.block(size)) or lines.peek() is not None:
        if block and rows.add_block(lines, block):
            continue
        for _ in range(block.count(b"\n") or 1):
            if (error := rows.add_line(lines)) is None:
                continue
            saved = len(rows.values) // form.columns
            if lines.peek() is not None:
                raise error
            if not lenient:
                hint = f"a cut file? --lenient saves {saved} rows"
                raise FileError(lines.path, _after(error), hint)
            remarks.append(
                remark("damage", f"the last line was left out: {_after(error)}")
            )
    if not rows.values:
        raise FileError(lines.path, "has no frames")
    if rows.short:
        remarks.append(
            remark(
                "missing",
                f"{rows.short} rows end early: what they lack counts as missing",
                rows=rows.short,
            )
        )
    grid = np.frombuffer(rows.values, dtype=np.float64).reshape(-1, form.columns)
    infinite = (grid > _INFINITE) | (grid < -_INFINITE)
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


@dataclass
class _Rows:
    """Rows that were read, and how many of them ended early."""

    form: Form
    values: "array[float]" = field(default_factory=lambda: array("d"))
    short: int = 0

    def add_block(self, lines: Lines, block: bytes) -> bool:
        """Read whole lines at once; False, and nothing read, if not all are rows."""
        if self.form.delimiter is None:
            return False
        form = self.form
        assert form.delimiter is not None
        table = decimals.table(block, form.columns, form.delimiter, form.ignored)
        if table is None:
            return False
        lines.skip(block, len(table))
        self.values.frombytes(table.data.cast("B"))
        return True

    def add_line(self, lines: Lines) -> FileError | None:
        """Read the next line; return what is wrong with it, if so."""
        form, line = self.form, lines.next()
        nothing = _BLANK + (form.delimiter or b"") if form.numbered else _BLANK
        if line is None or not line.strip(nothing):
            return None
        try:
            row, cut = _row(lines, line, form, len(self.values) // form.columns)
        except FileError as error:
            return error
        if cut and not (self.short or lines.ended):
            return _of_length(lines, len(line.split(form.delimiter)), form)
        self.values.extend(row)
        self.short += cut
        return None


def _after(error: FileError) -> str:
    """What is wrong in which line, for a message that names the file."""
    part = error.where.part.strip() if isinstance(error.where, Place) else ""
    return f"{part}: {error.wrong}" if part else error.wrong


def _row(lines: Lines, line: bytes, form: Form, row: int) -> tuple[list[float], bool]:
    """Return a row's numbers, and whether its end was cut off."""
    cells = line.split(form.delimiter, form.columns)
    for column in form.ignored:
        cells[column : column + 1] = [b""] if column < len(cells) else []
    if len(cells) == form.columns and not form.ignored and b"_" not in line:
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
