"""The head of a CSV file: comments, what parts the cells, the names of the columns.

Names stand in one line, or in two: markers above, axes below (pandas, DeepLabCut,
spreadsheets with one cell over three columns), perhaps a line of units under them,
of lengths and of times, with blanks where it says none.
"""

import csv
import json
import re
from pathlib import Path
from typing import Any, NamedTuple

from handclean.errors import FileError
from handclean.io.shared.clock import SECONDS, time_column
from handclean.io.shared.lines import Lines
from handclean.io.shared.missing import is_missing
from handclean.io.shared.reading import check_unique, text
from handclean.io.shared.settle import METRES
from handclean.io.text.decimal_commas import refuse_decimal_commas

MARK = "# handclean csv"
"""What the comment of ours begins with."""

_UP = {"", "+x", "-x", "+y", "-y", "+z", "-z"}
_PLACE = re.compile(r"[-_.:][XYZxyz]")
_AXIS = re.compile(r"([xyz])\d*", re.IGNORECASE)
_LINE_BYTES = 1_000_000
"""[bytes] of a line among the first that are looked at (chosen)."""

_MOST_HEADER_LINES = 6
"""Lines below the first one in which numbers begin at the latest (chosen)."""

INDEX = "index"
"""Name given to a first column of two header lines that has none of its own."""


class Head(NamedTuple):
    """What the lines before the numbers say.

    Attributes
    ----------
    names : of the columns, "" for one without.
    units : of the columns, as a line of them says, "" where it does not.
    delimiter : what parts the cells.
    """

    names: list[str]
    units: list[str]
    delimiter: bytes


def own_comment(path: Path, lines: Lines) -> dict[str, Any]:
    """Read leading comment lines; what handclean's own says.

    One that a spreadsheet put in quotes says nothing any more.

    Raises
    ------
    FileError
        If that is broken.
    """
    own: dict[str, Any] = {}
    while (line := lines.peek()) is not None and line.startswith((b"#", b'"#')):
        said = text(line)
        if said.startswith(MARK):
            try:
                own = json.loads(said[len(MARK) :])
            except (ValueError, RecursionError):
                raise FileError(path, f"its line '{MARK}' is broken") from None
            if not (isinstance(own, dict) and _sound(own)):
                raise FileError(path, f"its line '{MARK}' is broken")
        lines.next()
    return own


def _sound(own: dict[str, Any]) -> bool:
    """Whether handclean's comment has the parts it should have."""
    rate, first, motions = (own.get(k) for k in ("rate_hz", "first_frame", "motions"))
    start = own.get("start_time_s", 0.0)
    return (
        isinstance(rate, (int, float))
        and 1e-9 < rate < 1e9
        and isinstance(first, int)
        and abs(first) < 2**31
        and isinstance(start, (int, float))
        and abs(start) < 1e12
        and isinstance(own.get("unit"), str)
        and own.get("up_axis") in _UP
        and isinstance(motions, dict)
        and all(
            isinstance(names, list) and all(isinstance(name, str) for name in names)
            for names in motions.values()
        )
    )


def read_head(path: Path, lines: Lines) -> Head:
    """Read the line, or lines, of column names; cells may be quoted.

    Raises
    ------
    FileError
        If they are numbers, or two columns have one name.
    """
    while _is_idle(line := lines.peek() or b"") and lines.peek(1) is not None:
        lines.next()
    delimiter = delimiter_of(line, lines.peek(1) or b"")
    names = cells_of(lines, delimiter)
    if any(names) and all(is_number(name) for name in names if name):
        raise FileError(
            lines.where,
            "holds numbers where the names of the columns should be",
            "begin with a line such as frame,time_s,NAME_X,NAME_Y,NAME_Z",
        )
    names, units = _stacked(lines, delimiter, names)
    _refuse_other_marks(lines, names)
    refuse_decimal_commas(lines, delimiter)
    while names and not names[-1]:
        names.pop()
    check_unique(path, "columns", [name for name in names if name])
    units = (units + [""] * len(names))[: len(names)]
    return Head(names, units, delimiter)


def _is_idle(line: bytes) -> bool:
    """Whether a line before the names says nothing; ``sep=;`` is for Excel only."""
    return not line.strip(b" ,;\t") or bool(re.fullmatch(rb'"?sep=."?', line.strip()))


def _refuse_other_marks(lines: Lines, names: list[str]) -> None:
    """Refuse a table whose cells are parted by something that parts none here.

    Raises
    ------
    FileError
    """
    if len(names) != 1:
        return
    for mark, name in (("|", "'|'"), (None, "blanks")):
        cells = names[0].split(mark)
        if sum(1 for cell in cells if _PLACE.fullmatch(cell.strip()[-2:])) >= 3:
            right = "save it with commas, semicolons or tabs"
            raise FileError(lines.path, f"its cells are parted by {name}", right)


def cells_of(lines: Lines, delimiter: bytes) -> list[str]:
    """Read a line of names."""
    line = lines.peek() or b""
    names = [text(cell) for cell in lines.cells(delimiter)]
    if b'"' in line:
        try:
            [names] = csv.reader([text(line)], delimiter=delimiter.decode())
        except (csv.Error, ValueError):
            raise FileError(lines.where, "is no line of column names") from None
    return [name.strip() for name in names]


def head_rows(lines: Lines, deepest: int) -> list[list[str]]:
    """Cells of the next lines, parted by what parts most of them; none is read."""
    peeked = (lines.peek(after) for after in range(deepest))
    head = [text(line[:_LINE_BYTES]) for line in peeked if line is not None]
    mark = max(",;\t", key="".join(head).count)
    rows: list[list[str]] = []
    for line in head:
        try:
            row = next(csv.reader([line], delimiter=mark), [])
        except csv.Error:
            row = line.split(mark)
        rows.append([cell.strip() for cell in row] or [""])
    return rows


def delimiter_of(header: bytes, row: bytes) -> bytes:
    """Find what parts the cells: what parts as many of a row as there are names.

    Of several the comma last, as it may stand in names and in numbers.
    """

    def order(delimiter: bytes) -> tuple[bool, int]:
        both = (line.rstrip().rstrip(delimiter) for line in (header, row))
        names, cells = (line.count(delimiter) for line in both)
        agree = 0 < names == cells
        return agree, 0 if agree and delimiter == b"," else names

    return max((b",", b";", b"\t"), key=order)


def is_number(name: str) -> bool:
    """Whether a cell is a number, perhaps with a decimal comma."""
    try:
        float(name.replace(",", "."))
    except ValueError:
        return False
    return name.strip().lower() not in {"nan", "inf", "infinity"}


def _stacked(
    lines: Lines, delimiter: bytes, first: list[str]
) -> tuple[list[str], list[str]]:
    """Read further header lines, if one of them has axes under names, or units.

    Returns
    -------
    one name for each column, as one line would have them; and units
    """
    block, below = [first], 0
    for after in range(_MOST_HEADER_LINES):
        row = [text(c).strip().strip('"') for c in _split(lines.peek(after), delimiter)]
        numbers = [is_number(cell) for cell in row]
        blank = all(n or is_missing(c) for n, c in zip(numbers, row, strict=True))
        if blank or (below and (any(numbers) or _axes(row) >= 3)):
            break
        block.append(row)
        below = below or (len(block) if _axes(row) >= 3 else 0)
    if below:
        names = _joined(block[below - 2], block[below - 1])
    elif len(block) == 2 and units_in(block[1]):
        names, below = first, 1
    else:
        return first, []
    for _ in block[1:]:
        lines.next()
    units = next(filter(units_in, block[below:]), [])
    return names, [bare_unit(unit) for unit in units]


def _joined(named: list[str], axes: list[str]) -> list[str]:
    """Join names and the axes below them; a name may stand over its first axis only."""
    begin = next(k for k, cell in enumerate(axes) if _AXIS.fullmatch(cell))
    named = named + [""] * (len(axes) - len(named))
    names, last = [], ""
    for column, (name, axis) in enumerate(zip(named, axes, strict=False)):
        if column < begin:
            names.append(_lead(name, axis, column))
            continue
        last = name or last
        found = _AXIS.fullmatch(axis)
        names.append(f"{last}_{found[1] if found else axis}" if axis and last else "")
    return names


def _lead(name: str, axis: str, column: int) -> str:
    """Name a column before the first marker: a frame's number or a time."""
    if bare_unit(axis).lower() in SECONDS and time_column(name):
        return f"{name} [{bare_unit(axis)}]"
    if column == 0 and axis.lower() in ("", "coords", "coord", "axis", "bodyparts"):
        counts = name.lower().startswith("frame") or time_column(name)
        return name if counts else INDEX
    return axis or name


def _split(line: bytes | None, delimiter: bytes) -> list[bytes]:
    return [] if line is None else line.split(delimiter)


def _axes(row: list[str]) -> int:
    """Count cells that are an axis, if nearly all of them are."""
    count = sum(1 for cell in row if _AXIS.fullmatch(cell))
    return count if count >= 0.5 * sum(1 for cell in row if cell) else 0


def units_in(row: list[str]) -> bool:
    """Whether a line says units of lengths or times, and has no numbers."""
    units = [bare_unit(cell).lower() for cell in row]
    known = any(unit in METRES or unit in SECONDS for unit in units)
    return known and not any(map(is_number, row))


def bare_unit(cell: str) -> str:
    """Return a unit without brackets around it; "" for a cell that says none."""
    unit = cell[1:-1].strip() if cell[:1] + cell[-1:] in ("[]", "()", "{}") else cell
    return "" if is_missing(unit) else unit
