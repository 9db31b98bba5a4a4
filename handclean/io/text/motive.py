"""CSV of OptiTrack Motive: measured markers are read, what is solved from them is not.

The first line states facts in pairs, the next is blank; then

    ,Type,Rigid Body,Rigid Body,...,Marker,Marker,Marker
    ,Name,Cup,Cup,...,Hand:RTH1,Hand:RTH1,Hand:RTH1
    ,ID,1DF2,1DF2,...,4E2,4E2,4E2
    ,Parent,...                                          in some versions
    ,,Rotation,Rotation,...,Position,Position,Position
    Frame,Time (Seconds),X,Y,...,X,Y,Z

The facts may have been left out, and so may the words Type, Name and ID; without the
lines of names a file is numbers alone (see `handclean.io.text.nameless`). A missing
sample is blank. "Marker" is what was measured. Rigid bodies, bones and their markers
are the model's opinion of where something should be: they are left out.
"""

import re
from pathlib import Path

from handclean.errors import FileError
from handclean.io.shared.clock import SECONDS_SAID, Column, time_column
from handclean.io.shared.lines import Lines
from handclean.io.shared.settle import positive
from handclean.io.text.csv_columns import Layout, note_axis, short, whole
from handclean.io.text.csv_header import (
    cells_of,
    delimiter_of,
    head_rows,
)
from handclean.io.text.decimal_commas import refuse_decimal_commas
from handclean.io.text.described import Described, subjects_of
from handclean.remarks import Remark, listed, remark

PROGRAM = "OptiTrack Motive"

_FIRST = "format version"
_MEASURED = {"marker", "labeled marker", "unlabeled marker", "raw marker"}
_KINDS = re.compile(
    r"(?:(?:un)?labeled |raw |active )?marker|(?:trained )?marker ?set(?: \w+)?"
    r"|rigid body(?: marker)?|(?:skeleton )?bone(?: marker)?|skeleton(?: marker)?",
    re.IGNORECASE,
)
_CONTENTS = {"position", "rotation"}

_HEAD_LINES = 12
"""Lines among which the line of axes stands (chosen)."""

_RATES = ("Export Frame Rate", "Capture Frame Rate")
_UNIT = "Length Units"
_ROWS = "Total Exported Frames"
_SHOWN_COLUMNS = 6
"""Names that a message shows (chosen)."""

_AXIS = re.compile(r"[XYZxyz]")


def is_motive(lines: Lines) -> bool:
    """Whether the next line states Motive's facts, or one below names its columns."""
    rows = _rows(lines)
    return rows[0][0].lower() == _FIRST or (
        rows[-1][0].lower() == "frame" and _kinds_in(rows) >= 0
    )


def _rows(lines: Lines) -> list[list[str]]:
    """Return the cells of the lines up to the one of axes."""
    rows = head_rows(lines, _HEAD_LINES)
    axes = next((k for k, row in enumerate(rows) if row[0].lower() == "frame"), None)
    return rows[: None if axes is None else axes + 1] or [[""]]


def _kinds_in(rows: list[list[str]]) -> int:
    """Return which row says kinds of columns, -1 if none does."""
    for number, row in enumerate(rows):
        cells = [cell for cell in row[2:] if cell]
        if cells and not row[0] and all(map(_KINDS.fullmatch, cells)):
            return number
        if row[1:2] == ["Type"] and not row[0]:
            return number
    return -1


def describe_motive(path: Path, lines: Lines) -> Described:
    """Read the head of a file of Motive.

    Raises
    ------
    FileError
        If it is not as above, or nothing in it was measured.
    """
    rows = _rows(lines)
    facts = _facts(rows[0])
    kinds = _kinds_in(rows)
    axes = rows[-1]
    if axes[0].lower() != "frame":
        wrong = f"is a CSV of {PROGRAM} without a line Frame,Time (Seconds),X,Y,Z"
        raise FileError(path, wrong, "export it anew, with its header")
    if kinds < 0:
        wrong = f"is a CSV of {PROGRAM} in which no column has a type and a name"
        raise FileError(path, wrong, "export it anew, with Markers switched on")
    for _ in rows[:-1]:
        lines.next()
    delimiter = delimiter_of(lines.peek() or b"", lines.peek(1) or b"")
    axes = cells_of(lines, delimiter)
    refuse_decimal_commas(lines, delimiter)
    names = next((row for row in rows if row[1:2] == ["Name"]), rows[kinds + 1])
    remarks: list[Remark] = []
    contents = rows[-2] if _CONTENTS & {cell.lower() for cell in rows[-2]} else []
    layout = _layout(path, axes, rows[kinds], names, contents)
    layout = layout._replace(unit=facts.get(_UNIT) or None)
    if left_out := _solved(rows[kinds], names):
        text = f"not measured but solved, left out: {listed(left_out, _SHOWN_COLUMNS)}"
        remarks.append(remark("left-out", text, columns=left_out))
    return Described(
        layout=layout,
        names=axes,
        delimiter=delimiter,
        said=_said(path, facts),
        program=PROGRAM,
        facts={"subjects": subjects_of(layout.markers), **facts},
        rows=int(facts[_ROWS]) if facts.get(_ROWS, "").isdecimal() else None,
        remarks=tuple(remarks),
    )


def _facts(row: list[str]) -> dict[str, str]:
    """Return the pairs of the first line, if it is one of facts."""
    if row[0].lower() != _FIRST:
        return {}
    pairs = zip(row[::2], row[1::2], strict=False)
    return {key[:100]: value[:200] for key, value in pairs if key}


def _said(path: Path, facts: dict[str, str]) -> dict[str, float]:
    for name in _RATES:
        if facts.get(name):
            return {"rate_hz": positive(path, name, facts[name])}
    return {}


def _layout(
    path: Path,
    axes: list[str],
    kinds: list[str],
    names: list[str],
    contents: list[str],
) -> Layout:
    """Find out which columns are places of measured markers, and the times."""
    times = [k for k, name in enumerate(axes) if k and time_column(name) is not None]
    clock = time_column(axes[times[0]]) if times else None
    columns: dict[str, dict[str, int]] = {}
    for k, axis in enumerate(axes):
        kind = kinds[k].lower() if k < len(kinds) else ""
        holds = contents[k].lower() if k < len(contents) else ""
        if kind not in _MEASURED or not _AXIS.fullmatch(axis):
            continue
        if holds not in ("", "position"):
            continue
        label = names[k] if k < len(names) else ""
        note_axis(path, columns, label, axis.upper(), k)
    markers = whole(path, columns)
    if not markers:
        found = sorted({kind.lower() for kind in kinds[2:] if kind})
        shown = listed(found, _SHOWN_COLUMNS)
        wrong = f"is a CSV of {PROGRAM} without markers ({shown} only)"
        raise FileError(path, wrong, "export it anew, with Markers switched on")
    column = clock or Column(1.0, False)
    if column.says:
        column = SECONDS_SAID
    return Layout(0, times[0] if times else None, column, markers, None, {}, {}, [], {})


def _solved(kinds: list[str], names: list[str]) -> list[str]:
    """List what is of another kind than measured, each once: "rigid body Cup"."""
    pairs = zip(kinds[2:], names[2:], strict=False)
    found = (
        short(f"{kind.lower()} {name}")
        for kind, name in pairs
        if kind and kind.lower() not in _MEASURED
    )
    return list(dict.fromkeys(found))
