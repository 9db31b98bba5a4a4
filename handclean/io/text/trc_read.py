"""TRC: marker trajectories as text, of Motion Analysis and OpenSim.

Six header lines: file type; keys; values; marker names, each above three columns;
X1 Y1 Z1 X2 ...; blank. Then one row per frame: number, time, coordinates, blank where
missing. Reading takes what programs write: coordinate names counted from 0, tabs at
line ends, frame counts that are wrong, rows whose blank end was cut off, cells parted
by blanks, commas or semicolons, decimal commas between tabs or semicolons. Raw files
of Motion Analysis have no names, or cells beyond them: as many points a row as there
are, without a name.
`handclean.io.text.trc_write` writes them.
"""

import re
from functools import partial
from pathlib import Path

import numpy as np

from handclean.arrays import Ints32
from handclean.errors import FileError
from handclean.io.shared.clock import start_of
from handclean.io.shared.grid import Beyond, Form, read_numbers
from handclean.io.shared.lines import Lines
from handclean.io.shared.missing import blank_out
from handclean.io.shared.reading import (
    Reading,
    check_labels,
    open_text,
    place_rows,
    sort_out,
    text,
)
from handclean.io.shared.settle import (
    METRES,
    in_metres,
    positive,
    settle_rate,
    settle_unit,
)
from handclean.io.text.decimal_commas import (
    cells_with_commas,
    read_decimal_commas,
    refuse_decimal_commas,
)
from handclean.recording import Points, Recording
from handclean.remarks import Remark, remark

OWN = "handclean.trc"
"""What the first line of a file of ours ends in."""

_FIRST_LINE = "name in the first line"


def read_trc(
    path: Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
) -> Reading:
    """Read a TRC file.

    Parameters
    ----------
    rate_hz, unit : options that must agree with the file.
    lenient : leave out a last row that was cut off.

    Raises
    ------
    FileError
        If it is not a TRC file.
    UsageError
        If an option contradicts it.
    """
    lines = Lines(path, partial(open_text, path))
    remarks: list[Remark] = []
    stated, numbers = _header(path, lines)
    rate = settle_rate(path, positive(path, "DataRate", stated["DataRate"]), rate_hz)
    length = settle_unit(path, stated["Units"], unit, remarks)
    labels = _labels(path, lines, stated, remarks)
    beyond = Beyond()
    form = _form(lines, len(labels), beyond)
    read_decimal_commas(lines, form.delimiter, numbers, remarks)
    grid = read_numbers(lines, form, remarks, lenient=lenient)
    if not beyond.row:
        check_labels(path, labels)
    _check_count(stated["NumFrames"], len(grid), remarks)
    said = f"DataRate, {rate:g} Hz"
    start = start_of(grid[:, 1], grid[:, 0], rate, said, remarks)
    first, values = place_rows(path, grid[:, 0], grid[:, 2:], remarks)
    positions = values.reshape(len(values), -1, 3)
    if stated[_FIRST_LINE] != OWN:
        blank_out(positions, METRES[length.lower()], remarks)
    markers, points = sort_out(in_metres(positions, length), labels)
    if beyond.row:
        numbers = (grid[:, 0] - grid[0, 0]).astype(np.int32)
        more = _without_names(beyond, numbers, len(labels), length, remarks)
        points = _together(points, more)
    recording = Recording(
        rate=rate,
        frames=len(values),
        first_frame=first,
        start_time=start,
        markers=markers,
        unlabelled=points,
    )
    return Reading(recording=recording, unit=length, remarks=tuple(remarks))


def _parted_by(line: bytes) -> bytes | None:
    """What parts the cells of a line: tabs, else semicolons, commas, or blanks."""
    if b"\t" in line:
        return b"\t"
    if b";" in line:
        return b";"
    words = line.split()
    commas = line.count(b",") >= len(words) or any(w.endswith(b",") for w in words)
    return b"," if commas and words else None


def _header(path: Path, lines: Lines) -> tuple[dict[str, str], bytes]:
    """Read the key lines, the first three; the values by key, and their line.

    The line is blank where its commas part the values.
    """
    kind = re.split(rb"[\s,;]+", (lines.next() or b"").strip(), maxsplit=3)
    if kind[0] == b'"PathFileType"':
        raise FileError(path, "has its cells in quotes", "save it without")
    if kind[0] != b"PathFileType":
        right = "a TRC file begins with 'PathFileType'"
        raise FileError(path, "is not a TRC file", right)
    delimiter = _parted_by(lines.peek() or b"")
    keys = [text(cell) for cell in lines.cells(delimiter) if cell]
    line = b"" if delimiter == b"," else lines.peek() or b""
    if delimiter is None:
        refuse_decimal_commas(lines, None)
    commas = cells_with_commas(line, delimiter)
    cells = [cell for cell in lines.cells(delimiter) if cell]
    values = [text(c.replace(b",", b".") if c in commas else c) for c in cells]
    stated = {_FIRST_LINE: text(kind[-1]), **dict(zip(keys, values, strict=False))}
    for key in ("DataRate", "NumFrames", "NumMarkers", "Units"):
        if key not in stated:
            raise FileError(path, f"its header has no {key}")
    return stated, line


def _labels(
    path: Path, lines: Lines, stated: dict[str, str], remarks: list[Remark]
) -> list[str]:
    """Read the marker names and the line of coordinate names below them."""
    delimiter = _parted_by(lines.peek() or b"")
    cells = lines.cells(delimiter)
    if len(cells) < 2 or not cells[0].lower().startswith(b"frame"):
        raise FileError(lines.where, "should begin with 'Frame#' and 'Time'")
    labels = [text(cell) for cell in cells[2::3]]
    while labels and not labels[-1]:
        labels.pop()
    named = [text(cell) for cell in cells[2:] if cell]
    claim = stated["NumMarkers"]
    if delimiter is None or any(cells[3::3]) or any(cells[4::3]):
        if claim != str(len(named)):
            wrong = "a marker's name should stand above its X only"
            if delimiter is None:
                wrong = f"names {len(named)} markers, NumMarkers says {claim[:20]}"
            raise FileError(lines.where, wrong, "tabs should part them")
        labels = named
    if labels:
        check_labels(path, labels)
    if claim != str(len(labels)):
        remarks.append(
            remark(
                "header", f"NumMarkers says {claim}, {len(labels)} markers are named"
            )
        )
    under = lines.peek()
    if under is not None and under.strip(b" \t,;")[:1] in (b"X", b"x"):
        if under.strip(b" \t,;")[:2] in (b"X0", b"x0"):
            remarks.append(
                remark("header", "coordinates are counted from X0 instead of X1")
            )
        lines.next()
    return labels


def _form(lines: Lines, markers: int, beyond: Beyond) -> Form:
    """Say what rows look like, by the first; blank lines before it are read."""
    while (line := lines.peek()) is not None and not line.strip(b" \t,;"):
        lines.next()
    delimiter = _parted_by(line or b"")
    columns = 2 + 3 * markers
    ends = () if delimiter is None else range(2, columns, 3)
    return Form(
        columns=columns, delimiter=delimiter, ends=ends, beyond=beyond, numbered=True
    )


def _without_names(
    beyond: Beyond, frames: Ints32, named: int, unit: str, remarks: list[Remark]
) -> Points:
    """Points that stand beyond the names of the markers, as many a row as there are.

    Parameters
    ----------
    frames : (N,) frame of each row.
    named : how many markers have names.
    """
    row, place, places = beyond.arrays()
    blank_out(places, METRES[unit.lower()], remarks)
    seen = np.isfinite(places).all(axis=1)
    row, place, places = row[seen], place[seen], places[seen]
    if len(row):
        most = np.bincount(row).max()
        remarks.append(
            remark(
                "labels",
                f"{len(row)} points, up to {most} in a row, are without a name",
                points=len(row),
            )
        )
    return Points(
        frame=frames[row],
        source=(named + place).astype(np.int32),
        positions=in_metres(places, unit),
    )


def _together(one: Points | None, other: Points) -> Points | None:
    """Return both by frame."""
    if one is None or not len(other.frame):
        return other if len(other.frame) else one
    frame = np.concatenate([one.frame, other.frame])
    order = np.argsort(frame, kind="stable")
    return Points(
        frame=frame[order],
        source=np.concatenate([one.source, other.source])[order],
        positions=np.concatenate([one.positions, other.positions])[order],
    )


def _check_count(claim: str, rows: int, remarks: list[Remark]) -> None:
    if claim != str(rows):
        remarks.append(
            remark(
                "header",
                f"NumFrames says {claim}, there are {rows} rows",
                stated=claim[:20],
                rows=rows,
            )
        )
