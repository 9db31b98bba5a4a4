"""Which column of a CSV file holds what, by their names."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from handclean.errors import FileError
from handclean.io.shared.clock import SECONDS_SAID, Column, clock_of
from handclean.io.shared.reading import check_labels, is_loose
from handclean.io.shared.settle import METRES, named_unit
from handclean.io.text.csv_header import INDEX, Head
from handclean.remarks import Remark, remark

PLACE = ("root_tx", "root_ty", "root_tz")
TURN = ("root_qw", "root_qx", "root_qy", "root_qz")
TRUSTED = "trusted"

_OWN = re.compile(r"(?P<name>.*)_(?P<axis>[XYZ])", re.DOTALL)
_OTHERS = re.compile(r"(?P<name>.*)[-_ .:](?P<axis>[XYZWxyzw])", re.DOTALL)
_AFTER = re.compile(r"(?P<of>.*[-_ .:][XYZxyz])[-_ ./]?(?P<unit>mm|cm|dm|m)", re.DOTALL)
_FRAME = {"frame", "frames", "frameno", "framenumber", "framenum", "framenr"}
_NO_PLACE = "|".join(
    (
        "vel velocity velocities speed acc accel acceleration accelerations jerk",
        "angvel angacc omega gyro quat quats quaternion quaternions rot rotation",
        "rotations euler orientation ori angle angles force forces moment moments",
        "torque residual residuals err error errors std sigma var variance",
    )
).replace(" ", "|")
_WORD = re.compile(
    rf"(?:.*(?:[-_ .:]|(?-i:(?<=[A-Za-z0-9])(?=[A-Z][a-z]))))?(?:{_NO_PLACE})\d*"
    rf"|(?:{_NO_PLACE})[-_ .:].*",
    re.IGNORECASE | re.DOTALL,
)
_FOREIGN = ("in", "inch", "inches", "ft", "foot", "feet", "yd", "yard", "yards")
_NAME_CHARACTERS = 40
"""Characters of a column's name that a message shows (chosen)."""


class Layout(NamedTuple):
    """Which column holds what.

    Attributes
    ----------
    clock : what the column of times says of itself.
    unit : of the markers' lengths, as names say it; None if they do not.
    extra : names of columns that are left out.
    """

    frame: int | None
    time: int | None
    clock: Column
    markers: dict[str, list[int]]
    unit: str | None
    origins: dict[str, int]
    motions: dict[str, list[str]]
    extra: list[str]
    at: dict[str, int]


def head_of(name: str, motions: Mapping[str, object]) -> str:
    """Return what a motion's columns begin with."""
    return "" if len(motions) == 1 else f"{name}:"


def own_layout(path: Path, head: Head, own: dict[str, Any]) -> Layout:
    """Find out which column of a file of ours holds what.

    Raises
    ------
    FileError
        If a marker lacks an axis, a motion a column, there is neither, or units
        stand in a line of their own.
    """
    names = head.names
    if any(head.units):
        right = "its first line says the unit"
        raise FileError(path, "has a line of units below its names", right)
    at = {name: column for column, name in enumerate(names)}
    motions = dict(own.get("motions", {}))
    used: set[str] = set()
    for name, hinges in motions.items():
        start = head_of(name, motions)
        for hinge in hinges:
            if start + hinge not in at:
                raise FileError(path, f"has no column '{start + hinge}'")
        used |= {start + column for column in (*hinges, *PLACE, *TURN, TRUSTED)}
    frame = time = None
    axes: dict[str, dict[str, int]] = {}
    origins: dict[str, int] = {}
    extra = []
    for column, name in enumerate(names):
        if name in used:
            continue
        if found := _OWN.fullmatch(name):
            axes.setdefault(found["name"], {})[found["axis"]] = column
        elif name.endswith("_origin"):
            origins[name.removesuffix("_origin")] = column
        elif frame is None and name == "frame":
            frame = column
        elif time is None and name == "time_s":
            time = column
        else:
            extra.append(short(name))
    markers = whole(path, axes)
    if not motions:
        check_labels(path, list(markers))
    clock = SECONDS_SAID
    return Layout(frame, time, clock, markers, None, origins, motions, extra, at)


def others_layout(path: Path, head: Head) -> Layout:
    """Find out which column of somebody else's file holds what.

    Raises
    ------
    FileError
        If a marker lacks an axis or has one twice, units differ, or there are no
        markers.
    """
    names = head.names
    frame = time = None
    clock = Column(1.0, False)
    axes: dict[str, dict[str, int]] = {}
    units: dict[str, list[str]] = {}
    extra: list[str] = []
    strange: list[str] = []
    for column, (name, below) in enumerate(zip(names, head.units, strict=True)):
        found = None
        base, unit = _unit_of(name)
        stated = [one for one in (unit, below) if one]
        said = clock_of(path, name, below)
        if frame is None and re.sub(r"[^a-z]", "", name.lower()[:40]) in _FRAME:
            frame = column
        elif time is None and said is not None:
            time, clock = column, said
        elif (found := _OTHERS.fullmatch(base)) and all(map(named_unit, stated)):
            _put(path, axes, (found["name"], found["axis"].upper()), column, names)
            units.setdefault(found["name"], []).extend(stated)
        elif name not in ("", INDEX):
            extra.append(short(f"{name} [{below}]" if below else name))
            strange += stated if found else []
    for name in _no_places(axes):
        extra += [short(names[column]) for column in axes.pop(name).values()]
        del units[name]
    if frame is None and names[:1] in ([""], [INDEX]):
        frame = 0
    markers = whole(path, axes)
    if not markers:
        right = "its columns should be called NAME_X, NAME_Y, NAME_Z"
        if strange:
            right = f"the unit '{short(strange[0])}' is none of mm, cm, dm, m"
        raise FileError(path, "has no markers", right)
    check_labels(path, list(markers))
    length = one_unit(path, [unit for mine in units.values() for unit in mine])
    for unit in strange:
        if unit.lower() in _FOREIGN:
            wrong = f"its columns are in {length or 'no unit'} and in {unit}"
            raise FileError(path, wrong, "they should be in one")
    return Layout(frame, time, clock, markers, length, {}, {}, extra, {})


def _unit_of(name: str) -> tuple[str, str]:
    """Part a unit in brackets, or behind the axis, from a column's name."""
    for opening, closing in ("[]", "()", "{}"):
        if name.endswith(closing) and opening in name:
            base, _, unit = name[:-1].rpartition(opening)
            return base.rstrip(" _"), unit.strip()
    if found := _AFTER.fullmatch(name):
        return found["of"], found["unit"]
    if (found := _OTHERS.fullmatch(name)) and found["name"].endswith(("]", ")", "}")):
        of, unit = _unit_of(found["name"])
        if unit.lower() in METRES:
            return f"{of}_{found['axis']}", unit
    return name, ""


def _put(
    path: Path,
    axes: dict[str, dict[str, int]],
    key: tuple[str, str],
    column: int,
    names: list[str],
) -> None:
    """Note a marker's axis; two columns for one axis are an error."""
    name, axis = key
    mine = axes.setdefault(name, {})
    if axis in mine:
        one, other = short(names[mine[axis]]), short(names[column])
        how = "differ in case only" if one.lower() == other.lower() else "are one place"
        wrong = f"columns '{one}' and '{other}' {how}"
        raise FileError(path, wrong, f"one of them should be {axis} of '{short(name)}'")
    mine[axis] = column


def note_axis(
    path: Path,
    axes: dict[str, dict[str, int]],
    label: str,
    axis: str,
    column: int,
) -> str:
    """Note a marker's axis; one without a name of its own becomes ``*COLUMN``.

    Returns
    -------
    the label that was taken

    Raises
    ------
    FileError
        If a marker's name stands twice.
    """
    if label and axis in axes.get(label, {}):
        if not is_loose(label):
            wrong = f"2 markers are called '{short(label)}'"
            raise FileError(path, wrong, "names should be unique")
        label = ""
    label = label or f"*{column - 'XYZ'.index(axis)}"
    axes.setdefault(label, {})[axis] = column
    return label


def _no_places(axes: Mapping[str, Mapping[str, int]]) -> list[str]:
    """List the names that are of velocities, rotations or the like, beside places."""
    turns = [name for name, mine in axes.items() if "W" in mine]
    words = [n for n in axes if n not in turns and (_WORD.fullmatch(n) or _of(n, axes))]
    return turns + (words if len(turns) + len(words) < len(axes) else [])


def _of(name: str, axes: Mapping[str, object]) -> bool:
    """Whether a name is another's with a letter for velocity or the like behind it."""
    return name[-1:].lower() in ("v", "a", "q", "w") and (
        name[-2:-1] in ("-", "_", " ", ".", ":") and name[:-2] in axes
    )


def whole(path: Path, axes: dict[str, dict[str, int]]) -> dict[str, list[int]]:
    """Return the three columns of each marker.

    Raises
    ------
    FileError
        If one lacks an axis.
    """
    for name, mine in axes.items():
        if lacking := [axis for axis in "XYZ" if axis not in mine]:
            raise FileError(path, f"marker '{short(name)}' has no {lacking[0]} column")
    return {name: [mine[axis] for axis in "XYZ"] for name, mine in axes.items()}


def one_unit(path: Path, units: list[str]) -> str | None:
    """Return the unit that all columns have, None where none says one.

    Raises
    ------
    FileError
        If they differ.
    """
    metres = {METRES[(named_unit(unit) or unit).lower()]: unit for unit in units}
    if len(metres) > 1:
        shown = " and in ".join(sorted(metres.values()))
        raise FileError(path, f"its columns are in {shown}", "they should be in one")
    return units[0] if units else None


def like_another(labels: list[str]) -> list[Remark]:
    """Say which markers' names differ in case only."""
    seen: dict[str, str] = {}
    pairs = []
    for label in labels:
        other = seen.setdefault(label.casefold(), label)
        if other != label:
            pairs.append(f"'{short(other)}' and '{short(label)}'")
    if not pairs:
        return []
    text = f"markers whose names differ in case only: {', '.join(pairs[:5])}"
    return [remark("labels", text)]


def short(name: str) -> str:
    """Return a name as messages show it."""
    return name if len(name) <= _NAME_CHARACTERS else name[:_NAME_CHARACTERS] + "..."
