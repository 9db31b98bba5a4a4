"""CSV of Vicon Nexus: sections, of which the trajectories are read.

A file has one section or several (Devices, Model Outputs, Trajectories ...), each
after a blank line. A section is

    Trajectories
    100                                    the rate [Hz]
    ,,Hand:RTH1,,,Hand:RIN1,,              names, each above its first column
    Frame,Sub Frame,X,Y,Z,X,Y,Z
    ,,mm,mm,mm,mm,mm,mm
    101,0,10.5,20.25,30.125,,,             the trial's own numbers of frames

A missing sample is blank. A trajectory without a name, or ``*3``, is one of no marker.
Velocities and accelerations may stand beside the places (X', X''); they are left out.
"""

from collections.abc import Mapping
from pathlib import Path

from handclean.errors import FileError
from handclean.io.shared.clock import Column
from handclean.io.shared.lines import Lines
from handclean.io.shared.reading import text
from handclean.io.shared.settle import named_unit, positive
from handclean.io.text.csv_columns import Layout, note_axis, one_unit, short, whole
from handclean.io.text.csv_header import (
    bare_unit,
    cells_of,
    delimiter_of,
    is_number,
)
from handclean.io.text.decimal_commas import refuse_decimal_commas
from handclean.io.text.described import Described, subjects_of
from handclean.remarks import Remark, listed, remark

PROGRAM = "Vicon Nexus"

_TITLES = (
    *("Trajectories", "Devices", "Joints", "Segments", "Model Outputs", "Events"),
    *("Bones", "Objects", "Force Plates", "Trajectory Count"),
)
"""Of sections, as Nexus 1 and 2 and Tracker write them."""

_READ = "Trajectories"
_MARKS = b'",;\t '
_AXES = ("X", "Y", "Z")
_SHOWN_SECTIONS = 12
"""Titles that a message names (chosen)."""


def is_nexus(lines: Lines) -> bool:
    """Whether the next line is a section's title, and a number alone comes below."""
    title = text((lines.peek() or b"")[:100].strip(_MARKS))
    known = title.lower() in {one.lower() for one in _TITLES}
    return known and is_number(text((lines.peek(1) or b"")[:100].strip(_MARKS)))


def describe_nexus(path: Path, lines: Lines) -> Described:
    """Read the head of the trajectories; what stands in other sections is left out.

    Raises
    ------
    FileError
        If there are none, or two sections of them, or their head is not as above.
    """
    found = lines.titles(_TITLES, _MARKS)
    others = [one.title for one in found if one.title != _READ]
    mine = [one for one in found if one.title == _READ]
    if not mine:
        wrong = f"is a CSV of {PROGRAM} with {listed(others, _SHOWN_SECTIONS)} only"
        raise FileError(path, wrong, "export the trial's trajectories, too")
    if len(mine) > 1:
        wrong = f"has {len(mine)} sections of trajectories"
        raise FileError(path, wrong, "one trial belongs in one file")
    after = [one.number - 1 for one in found if one.number > mine[0].number]
    lines.narrow(mine[0].number, min(after, default=None))
    remarks: list[Remark] = []
    if others:
        shown = listed(others, _SHOWN_SECTIONS)
        said = f"sections of {PROGRAM} that are left out: {shown}"
        remarks.append(remark("left-out", said, sections=others))
    return _trajectories(path, lines, others, remarks)


def _trajectories(
    path: Path, lines: Lines, others: list[str], remarks: list[Remark]
) -> Described:
    """Read the five lines above the rows."""
    lines.next()
    rate_hz = positive(
        path,
        "the rate below 'Trajectories'",
        text((lines.next() or b"").strip(_MARKS)),
    )
    delimiter = delimiter_of(lines.peek() or b"", lines.peek(1) or b"")
    names = cells_of(lines, delimiter)
    axes = cells_of(lines, delimiter)
    if axes[0].lower() not in ("frame", "frame#", "frames"):
        wrong = f"begins with '{short(axes[0])}'"
        raise FileError(lines.where, wrong, "a line Frame,Sub Frame,X,Y,Z belongs here")
    while axes and not axes[-1]:
        axes.pop()
    units = [text(c).strip('" ') for c in (lines.peek() or b"").split(delimiter)]
    if any(map(is_number, units)):
        units = []
    else:
        lines.next()
    units = [bare_unit(unit) for unit in units]
    refuse_decimal_commas(lines, delimiter)
    layout = _layout(path, names, axes, units)
    said: dict[str, object] = {"rate_hz": rate_hz}
    facts: Mapping[str, object] = {
        "subjects": subjects_of(layout.markers),
        "sections": [_READ, *others],
    }
    return Described(
        layout=layout,
        names=axes,
        delimiter=delimiter,
        said=said,
        program=PROGRAM,
        facts=facts,
        remarks=tuple(remarks),
    )


def _layout(path: Path, names: list[str], axes: list[str], units: list[str]) -> Layout:
    """Find out which column holds what: a name counts up to the next one."""
    columns: dict[str, dict[str, int]] = {}
    extra: list[str] = []
    label = ""
    names += [""] * (len(axes) - len(names))
    for k, axis in enumerate(axes[1:], 1):
        is_new = axis in columns.get(label, {}) and not names[k]
        label = "" if is_new else names[k] or label
        if axis.upper() in _AXES:
            label = note_axis(path, columns, label, axis.upper(), k)
        elif axis and not axis.lower().startswith("sub"):
            extra.append(short(f"{label} {axis}"))
    markers = whole(path, columns)
    if not markers:
        raise FileError(path, "has no markers", "names belong above X, Y and Z")
    units += [""] * (len(axes) - len(units))
    unit = _unit(path, [units[k] for mine in markers.values() for k in mine])
    return Layout(0, None, Column(1.0, False), markers, unit, {}, {}, extra, {})


def _unit(path: Path, units: list[str]) -> str | None:
    """Return the unit of places, None where none is said; one may be unknown."""
    said = list(dict.fromkeys(unit for unit in units if unit))
    if all(map(named_unit, said)):
        return one_unit(path, said)
    if len(said) > 1:
        raise FileError(path, f"its columns are in {listed(said)}", "one unit belongs")
    return said[0]
