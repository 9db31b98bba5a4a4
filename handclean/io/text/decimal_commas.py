"""Numbers with a decimal comma: read where the columns prove it, else refused.

Programs that follow the system's language write 0,25 for 0.25. Where tabs or semicolons
part the cells, a comma can be nothing else, unless it parts thousands: 1,250. So commas
are read as decimal ones if one of the first numbers has other than three digits behind
the comma, or a 0 or more than three digits before it, and no number has a point.
"""

import re
from collections.abc import Iterator

from handclean.errors import FileError
from handclean.io.shared.lines import Lines
from handclean.io.shared.reading import text
from handclean.remarks import Remark, remark

_COMMA = re.compile(rb"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_THOUSANDS = re.compile(rb"[-+]?[1-9]\d{0,2},\d{3}")
_POINT = re.compile(rb"\d\.|\.\d")
_POINT_NUMBER = re.compile(rb"[-+]?(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?")

_CELL_CHARACTERS = 64
"""Characters of a cell that are looked at for a decimal comma (chosen)."""

_RIGHT = "save it with decimal points"


def cells_with_commas(line: bytes, delimiter: bytes | None) -> list[bytes]:
    """Cells of a line that are numbers with a decimal comma.

    Where commas part the cells, only quoted ones can be.
    """
    cells = line.split(delimiter) if delimiter != b"," else line.split(b'"')[1::2]
    starts = (cell.strip()[:_CELL_CHARACTERS] for cell in cells)
    return [cell for cell in starts if _COMMA.fullmatch(cell)]


def refuse_decimal_commas(lines: Lines, delimiter: bytes | None) -> None:
    """Refuse numbers with a decimal comma in the next line, or in the one after.

    Raises
    ------
    FileError
    """
    for found in _ahead(lines, delimiter):
        raise FileError(lines.path, _with_commas(found), _RIGHT)


def read_decimal_commas(
    lines: Lines, delimiter: bytes | None, header: bytes, remarks: list[Remark]
) -> None:
    """Have the rest read with decimal commas, if it has some and nothing else.

    Parameters
    ----------
    delimiter : what parts the cells of the next line, the first of the rest.
    header : numbers of the header, where tabs or semicolons part them.

    Raises
    ------
    FileError
        If there are some, but blanks part the cells, the commas may part thousands, or
        another number has a decimal point.
    """
    mark = b"\t" if b"\t" in header else b";"
    found = [*cells_with_commas(header, mark), *_ahead(lines, delimiter)]
    if not found:
        return
    if delimiter not in (b"\t", b";"):
        raise FileError(lines.path, _with_commas(found[0]), _RIGHT)
    if all(_THOUSANDS.fullmatch(cell) for cell in found):
        wrong = f"has commas that part thousands or decimals ({_shown(found[0])})"
        raise FileError(lines.path, wrong, _RIGHT)
    for cell in header.split(mark):
        if _POINT_NUMBER.fullmatch(cell.strip()):
            raise _of_both_kinds(lines, found[0], cell.strip())

    def with_points(piece: bytes) -> bytes:
        if other := _POINT.search(piece):
            raise _of_both_kinds(lines, found[0], _cell_at(piece, other.start()))
        return piece.replace(b",", b".")

    lines.change_rest(with_points)
    remarks.append(
        remark("header", f"numbers have a decimal comma ({_shown(found[0])})")
    )


def _ahead(lines: Lines, delimiter: bytes | None) -> Iterator[bytes]:
    """Yield numbers with a decimal comma in the next two lines."""
    for after in range(2):
        yield from cells_with_commas(lines.peek(after) or b"", delimiter)


def _cell_at(piece: bytes, at: int) -> bytes:
    """Return the cell around a letter."""
    start = max(piece.rfind(mark, 0, at) for mark in (b"\t", b";", b"\n")) + 1
    return re.split(rb"[\t;\n]", piece[start : at + _CELL_CHARACTERS])[0].strip()


def _shown(cell: bytes) -> str:
    return f"'{text(cell)[:20]}'"


def _with_commas(cell: bytes) -> str:
    return f"has numbers with a decimal comma ({_shown(cell)})"


def _of_both_kinds(lines: Lines, cell: bytes, other: bytes) -> FileError:
    wrong = f"{_with_commas(cell)} and others with a point ({_shown(other)})"
    return FileError(lines.path, wrong, _RIGHT)
