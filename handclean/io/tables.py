"""CSV in and out: one row per frame, for spreadsheets and short programs.

A CSV file that handclean writes begins with one comment line, ``# handclean csv`` and
a JSON object: ``rate_hz``, ``unit`` (of lengths), ``first_frame``, ``start_time_s``,
``up_axis`` and ``motions``, the hinge names of each motion. Then the column names:

``frame, time_s``
    The frame's number and its time [s], as the source counts both.
``NAME_X, NAME_Y, NAME_Z, NAME_origin``
    A marker's place, blank where missing, and where the sample comes from (0 missing,
    1 measured, 2 filled, 3 rejected, 4 smoothed). Points that no model explains are
    ``*0``, ``*1`` ...
``root_tx, root_ty, root_tz`` and ``root_qw, root_qx, root_qy, root_qz``
    Where the root of a motion is and its unit quaternion, root to laboratory.
hinge names
    Joint angles [degrees].
trusted
    1 where the frame's posture is trusted, else 0; if the take says so.

If there are several motions their columns begin with ``MOTION:``. Other people's CSV
files have three columns per marker, ``NAME-X``, ``NAME_X``, ``NAME.X`` or ``NAME X``,
and perhaps a frame number and a time [s]; what they do not say, options must.
"""

import csv
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from handclean.arrays import Bytes, Floats
from handclean.errors import FileError
from handclean.io.clock import rate_of, start_of
from handclean.io.grid import Lines, read_numbers
from handclean.io.reading import (
    Reading,
    check_labels,
    check_unique,
    finite,
    in_metres,
    load_text,
    place_rows,
    settle_rate,
    settle_unit,
    sort_out,
    text,
    zeros_are_missing,
)
from handclean.io.writing import Columns, columns_of, rows, write_lines
from handclean.recording import Motion, Origin, Recording

_MARK = "# handclean csv"
_PLACE = ("root_tx", "root_ty", "root_tz")
_TURN = ("root_qw", "root_qx", "root_qy", "root_qz")
_TRUSTED = "trusted"
_AXIS = re.compile(r"(?P<name>.*)[-_ .:](?P<axis>[XYZxyz])")
_DECIMAL_COMMA = re.compile(rb"-?\d+,\d+(?![\d,.])")
_FRAME = {"frame", "frames", "frameno", "framenumber"}
_TIME = {"time", "times", "timesec", "timeseconds"}
_UP = {"", "+x", "-x", "+y", "-y", "+z", "-z"}


class _Layout(NamedTuple):
    """Which column holds what."""

    frame: int | None
    time: int | None
    markers: dict[str, list[int]]
    origins: dict[str, int]
    motions: dict[str, list[str]]
    extra: list[str]
    at: dict[str, int]


def read_csv(
    path: Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
) -> Reading:
    """Read a CSV file of markers, or of markers and angles if handclean wrote it.

    Parameters
    ----------
    rate_hz, unit : what the file does not say; must agree where it does.
    lenient : leave out a last row that was cut off.

    Raises
    ------
    FileError
        If it is not such a file.
    UsageError
        If the rate or the unit is not known, or an option contradicts the file.
    """
    lines = Lines(path, load_text(path))
    traps: list[str] = []
    own = _comment(path, lines)
    names, delimiter = _column_names(path, lines)
    layout = _layout(path, names, own)
    length = settle_unit(path, own.get("unit"), unit)
    if rate_hz is None and "rate_hz" not in own and layout.time is None:
        settle_rate(path, None, None)
    grid = read_numbers(lines, len(names), delimiter, traps, lenient=lenient)
    if layout.frame is None:
        numbers = np.arange(len(grid), dtype=float) + own.get("first_frame", 1)
    else:
        numbers = grid[:, layout.frame]
    stated = own.get("rate_hz")
    if stated is None and layout.time is not None:
        stated = rate_of(numbers, grid[:, layout.time], rate_hz, traps)
    rate = settle_rate(path, stated, rate_hz)
    start = own.get("start_time_s", 0.0)
    if layout.time is not None and "start_time_s" not in own:
        start = start_of(grid[:, layout.time], numbers, rate, f"{rate:g} Hz", traps)
    if layout.extra:
        traps.append(f"not a marker's, left out: {', '.join(layout.extra[:20])}")
    first, values = place_rows(path, numbers, grid, traps)
    markers, points = None, None
    if layout.markers:
        positions = values[:, [c for cs in layout.markers.values() for c in cs]]
        positions = in_metres(positions, length).reshape(len(values), -1, 3)
        if not own:
            zeros_are_missing(positions, traps)
        origin = _origins(path, values, layout)
        markers, points = sort_out(positions, list(layout.markers), origin)
    recording = Recording(
        rate=rate,
        frames=len(values),
        first_frame=first,
        start_time=start,
        up_axis=own.get("up_axis", ""),
        markers=markers,
        unlabelled=points,
        motions={
            name: _motion(path, values, layout, name, length) for name in layout.motions
        },
    )
    return Reading(recording=recording, unit=length, traps=tuple(traps))


def _comment(path: Path, lines: Lines) -> dict[str, Any]:
    """Read leading comment lines; what handclean's own says."""
    own: dict[str, Any] = {}
    while (line := lines.peek()) is not None and line.startswith(b"#"):
        said = text(line)
        if said.startswith(_MARK):
            try:
                own = json.loads(said[len(_MARK) :])
            except (ValueError, RecursionError):
                raise FileError(path, f"its line '{_MARK}' is broken") from None
            if not (isinstance(own, dict) and _sound(own)):
                raise FileError(path, f"its line '{_MARK}' is broken")
        lines.next()
    return own


def _sound(own: dict[str, Any]) -> bool:
    """Whether handclean's comment has the parts it should have."""
    rate, first, motions = (own.get(k) for k in ("rate_hz", "first_frame", "motions"))
    start = own.get("start_time_s", 0.0)
    return (
        isinstance(rate, (int, float))
        and 0 < rate < 1e9
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


def _column_names(path: Path, lines: Lines) -> tuple[list[str], bytes]:
    """Read the header line; its cells may be quoted."""
    line = lines.peek() or b""
    delimiter = _delimiter(line, lines.peek(1) or b"")
    names = [text(cell) for cell in lines.cells(delimiter)]
    if any(names) and all(_is_number(name) for name in names if name):
        raise FileError(
            lines.where,
            "holds numbers where the names of the columns should be",
            "begin with a line such as frame,time_s,NAME_X,NAME_Y,NAME_Z",
        )
    if delimiter != b"," and (found := _DECIMAL_COMMA.search(lines.peek() or b"")):
        shown = found[0].decode()
        wrong = f"has numbers with a decimal comma ('{shown}')"
        raise FileError(lines.path, wrong, "save it with decimal points")
    if b'"' in line:
        try:
            [names] = csv.reader([text(line)], delimiter=delimiter.decode())
        except (csv.Error, ValueError):
            raise FileError(lines.where, "is no line of column names") from None
    names = [name.strip() for name in names]
    while names and not names[-1]:
        names.pop()
    check_unique(path, "columns", names)
    return names, delimiter


def _delimiter(header: bytes, row: bytes) -> bytes:
    """Find what parts the cells: what parts as many of a row as there are names.

    Of several the comma last, as it may stand in names and in numbers.
    """

    def order(delimiter: bytes) -> tuple[bool, int]:
        both = (line.rstrip().rstrip(delimiter) for line in (header, row))
        names, cells = (line.count(delimiter) for line in both)
        agree = 0 < names == cells
        return agree, 0 if agree and delimiter == b"," else names

    return max((b",", b";", b"\t"), key=order)


def _is_number(name: str) -> bool:
    try:
        float(name.replace(",", "."))
    except ValueError:
        return False
    return name.strip().lower() not in {"nan", "inf", "infinity"}


def _layout(path: Path, names: list[str], own: dict[str, Any]) -> _Layout:
    """Find out which column holds what.

    Raises
    ------
    FileError
        If a marker lacks an axis, a motion a column, or there is neither.
    """
    at = {name: column for column, name in enumerate(names)}
    motions = dict(own.get("motions", {}))
    used: set[str] = set()
    for name, hinges in motions.items():
        head = _head(name, motions)
        for hinge in hinges:
            if head + hinge not in at:
                raise FileError(path, f"has no column '{head + hinge}'")
        used |= {head + column for column in (*hinges, *_PLACE, *_TURN, _TRUSTED)}
    frame = time = None
    markers: dict[str, dict[str, int]] = {}
    origins: dict[str, int] = {}
    extra = []
    for column, name in enumerate(names):
        plain = re.sub(r"[^a-z]", "", name.lower())
        found = _AXIS.fullmatch(name)
        if name in used:
            continue
        if found:
            markers.setdefault(found["name"], {})[found["axis"].upper()] = column
        elif own and name.endswith("_origin"):
            origins[name.removesuffix("_origin")] = column
        elif frame is None and plain in _FRAME:
            frame = column
        elif time is None and plain in _TIME:
            time = column
        else:
            extra.append(name)
    for name, axes in markers.items():
        if lacking := [axis for axis in "XYZ" if axis not in axes]:
            raise FileError(path, f"marker '{name}' has no {lacking[0]} column")
    if not motions:
        check_labels(path, list(markers))
    triples = {name: [axes[axis] for axis in "XYZ"] for name, axes in markers.items()}
    return _Layout(frame, time, triples, origins, motions, extra, at)


def _head(name: str, motions: Mapping[str, object]) -> str:
    """What a motion's columns begin with."""
    return "" if len(motions) == 1 else f"{name}:"


def _origins(path: Path, values: Floats, layout: _Layout) -> Bytes | None:
    """(T, M) where each sample comes from, if the file says so."""
    if not layout.origins:
        return None
    origin = np.zeros((len(values), len(layout.markers)), dtype=np.uint8)
    for m, name in enumerate(layout.markers):
        column = layout.origins.get(name)
        seen = finite(values[:, layout.markers[name]])
        origin[:, m] = seen
        if column is None:
            continue
        known = np.isin(values[:, column], [int(origin) for origin in Origin])
        if not np.all(known | np.isnan(values[:, column])):
            raise FileError(path, f"column '{name}_origin' should hold 0 to 4")
        origin[:, m] = np.where(known, values[:, column], 0)
        origin[~seen & (origin[:, m] != Origin.REJECTED), m] = Origin.MISSING
        origin[seen & (origin[:, m] == Origin.MISSING), m] = Origin.MEASURED
    return origin


def _motion(
    path: Path, values: Floats, layout: _Layout, name: str, unit: str
) -> Motion:
    """Cut one motion out of the table."""
    head = _head(name, layout.motions)

    def block(names: Iterable[str]) -> Floats | None:
        columns = [layout.at.get(head + column) for column in names]
        found = [column for column in columns if column is not None]
        return values[:, found] if len(found) == len(columns) else None

    hinges = layout.motions[name]
    degrees, place, turn = block(hinges), block(_PLACE), block(_TURN)
    assert degrees is not None
    if turn is not None:
        with np.errstate(over="ignore"):
            length = np.linalg.norm(turn, axis=1, keepdims=True)
        if np.any(np.abs(length - 1) > 1e-3):
            raise FileError(path, f"motion '{name}': a quaternion's length is not 1")
        turn = turn / length
    trusted = block((_TRUSTED,))
    if trusted is not None and not np.isin(trusted, (0.0, 1.0)).all():
        raise FileError(path, f"column '{head}{_TRUSTED}' should hold 0 or 1")
    return Motion(
        names=tuple(hinges),
        angles=np.radians(degrees),
        translation=None if place is None else in_metres(place, unit),
        rotation=turn,
        trusted=None if trusted is None else trusted[:, 0] > 0.5,
    )


def write_csv(path: Path, recording: Recording) -> tuple[str, ...]:
    """Write markers and angles as CSV, lengths in millimetres, angles in degrees.

    Returns
    -------
    what the format cannot hold, one line each

    Raises
    ------
    FileError
        If there is nothing to write, or two columns would have one name.
    """
    has_points = recording.unlabelled is not None and len(recording.unlabelled.frame)
    columns = None
    if recording.markers is not None or has_points or not recording.motions:
        columns = columns_of(path, recording)
    names, decimals, blocks = _table(recording, columns)
    check_unique(path, "columns", names)
    write_lines(path, _lines(recording, names, decimals, blocks))
    return columns.notes if columns else ()


def _table(
    recording: Recording, columns: Columns | None
) -> tuple[list[str], list[int], list[Floats]]:
    """Return names, digits and blocks of columns, side by side."""
    names, decimals = ["frame", "time_s"], [0, 6]
    numbers = recording.first_frame + np.arange(recording.frames, dtype=float)
    blocks = [numbers[:, None], recording.clock[:, None]]
    if columns is not None:
        for m, label in enumerate(columns.labels):
            names += [f"{label}_{axis}" for axis in "XYZ"] + [f"{label}_origin"]
            decimals += [6, 6, 6, 0]
            blocks.append(1e3 * columns.positions[:, m])
            blocks.append(columns.origin[:, [m]].astype(float))
    for name, motion in recording.motions.items():
        head = _head(name, recording.motions)
        if motion.translation is not None:
            names += [head + column for column in _PLACE]
            decimals += [6] * 3
            blocks.append(1e3 * motion.translation)
        if motion.rotation is not None:
            names += [head + column for column in _TURN]
            decimals += [12] * 4
            blocks.append(motion.rotation)
        names += [head + hinge for hinge in motion.names]
        decimals += [9] * len(motion.names)
        blocks.append(np.degrees(motion.angles))
        if motion.trusted is not None:
            names.append(head + _TRUSTED)
            decimals.append(0)
            blocks.append(motion.trusted[:, None].astype(float))
    return names, decimals, blocks


def _lines(
    recording: Recording, names: list[str], decimals: list[int], blocks: list[Floats]
) -> Iterator[str]:
    said = {
        "rate_hz": recording.rate,
        "unit": "mm",
        "first_frame": recording.first_frame,
        "start_time_s": recording.start_time,
        "up_axis": recording.up_axis,
        "motions": {name: list(m.names) for name, m in recording.motions.items()},
    }
    yield f"{_MARK} {json.dumps(said, ensure_ascii=False)}"
    line = StringIO()
    csv.writer(line, lineterminator="").writerow(names)
    yield line.getvalue()
    yield from rows(np.column_stack(blocks), decimals, ",")
