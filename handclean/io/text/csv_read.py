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
perhaps with a unit, or names above the axes (`handclean.io.text.csv_header`); and
perhaps a frame number and a time (`handclean.io.shared.clock`); what they do not say,
options must. What stands for no place is missing (`handclean.io.shared.missing`),
columns of velocities and the like are left out (`handclean.io.text.csv_columns`).
"""

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bytes, Floats
from handclean.errors import FileError
from handclean.io.shared.clock import expect_possible, in_seconds, rate_of, start_of
from handclean.io.shared.grid import Form, read_numbers
from handclean.io.shared.lines import Lines
from handclean.io.shared.missing import blank_out
from handclean.io.shared.reading import Reading, finite, open_text, place_rows, sort_out
from handclean.io.shared.settle import (
    METRES,
    ask_for,
    in_metres,
    settle_rate,
    settle_unit,
)
from handclean.io.text.csv_columns import (
    PLACE,
    TRUSTED,
    TURN,
    Layout,
    head_of,
    like_another,
    others_layout,
    own_layout,
)
from handclean.io.text.csv_header import INDEX, own_comment, read_head
from handclean.io.text.described import Described
from handclean.io.text.nameless import describe_nameless
from handclean.io.text.vendors import describe_vendors
from handclean.recording import Motion, Origin, Points, Recording, Trajectories
from handclean.remarks import Remark, listed, remark

_SHOWN_COLUMNS = 12
"""Columns that a remark names (chosen)."""


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
    return read_table(path, rate_hz=rate_hz, unit=unit, lenient=lenient, bare=False)


def read_table(
    path: Path, *, rate_hz: float | None, unit: str | None, lenient: bool, bare: bool
) -> Reading:
    """Read a table as `read_csv` does.

    Parameters
    ----------
    bare : it may be numbers of places alone, without frames, times and names.
    """
    lines = Lines(path, partial(open_text, path))
    table = (
        describe_vendors(path, lines)
        or describe_nameless(lines, bare=bare)
        or _plain(path, lines)
    )
    layout, said = table.layout, table.said
    remarks = list(table.remarks)
    stated = said.get("unit") or layout.unit
    no_rate = rate_hz is None and "rate_hz" not in said and layout.time is None
    ask_for(path, rate=no_rate, unit=no_rate and (unit or stated) is None)
    grid = read_numbers(lines, _form(table), remarks, lenient=lenient)
    del lines  # and the text with them
    timing = _timing(path, grid, table, rate_hz, remarks)
    no_rate = timing.rate is None and rate_hz is None
    ask_for(path, rate=no_rate, unit=(unit or stated) is None)
    rate, length = (
        settle_rate(path, timing.rate, rate_hz),
        settle_unit(path, stated, unit, remarks),
    )
    remarks += _differs(table, len(grid))
    first, values = place_rows(path, timing.numbers, grid, remarks)
    markers, points = _placed(path, values, table, length, remarks)
    recording = Recording(
        rate=rate,
        frames=len(values),
        first_frame=first,
        start_time=timing.start,
        up_axis=said.get("up_axis", ""),
        markers=markers,
        unlabelled=points,
        motions={
            name: _motion(path, values, layout, name, length) for name in layout.motions
        },
        parameters={"CSV": dict(table.facts)} if table.facts else {},
    )
    told = {"program": table.program, **table.facts} if table.program else {}
    return Reading(recording=recording, unit=length, remarks=tuple(remarks), told=told)


def _plain(path: Path, lines: Lines) -> Described:
    """Read the head of a file of ours, or of any other with three columns a marker."""
    own = own_comment(path, lines)
    head = read_head(path, lines)
    layout = own_layout(path, head, own) if own else others_layout(path, head)
    return Described(
        layout=layout,
        names=head.names,
        delimiter=head.delimiter,
        said=own,
        is_own=bool(own),
        remarks=() if own else tuple(like_another(list(layout.markers))),
    )


def _form(table: Described) -> Form:
    """Say what rows look like: of somebody else's they may lack what is blank."""
    layout, columns = table.layout, len(table.names)
    used = {
        layout.frame,
        layout.time,
        *(c for cs in layout.markers.values() for c in cs),
    }
    return Form(
        columns=columns,
        delimiter=table.delimiter,
        ends=() if table.is_own else _ends(layout, columns),
        numbered=layout.frame is not None,
        ignored=() if table.is_own else sorted(set(range(columns)) - used),
    )


def _differs(table: Described, rows: int) -> list[Remark]:
    """Remark on columns that are left out, and on rows that the head denies."""
    found = []
    if extra := table.layout.extra:
        text = f"not a marker's place, left out: {listed(extra, _SHOWN_COLUMNS)}"
        found.append(remark("left-out", text, columns=list(extra)))
    if table.rows not in (None, rows):
        text = f"its head says {table.rows} frames, there are {rows} rows"
        found.append(remark("header", text, stated=table.rows, rows=rows))
    return found


_MOVED_NUMBERS = 1 << 15
"""Numbers of a table that are moved at once (chosen)."""


class _Timing(NamedTuple):
    """(N,) frame numbers, the rate [Hz] if the file says it, the first row's [s]."""

    numbers: Floats
    rate: float | None
    start: float


def _timing(
    path: Path,
    grid: Floats,
    table: Described,
    option: float | None,
    remarks: list[Remark],
) -> _Timing:
    """Find out when rows were.

    Raises
    ------
    FileError
        If its times run at a rate that no camera has.
    """
    layout, numbers = table.layout, _numbers(grid, table)
    rate, start = table.said.get("rate_hz"), table.said.get("start_time_s")
    if layout.time is None:
        return _Timing(numbers, rate, start or 0.0)
    times = in_seconds(
        path, numbers, grid[:, layout.time], layout.clock, option, remarks
    )
    if rate is None:
        rate = rate_of(numbers, times, option, remarks)
        expect_possible(path, rate, option, table.names[layout.time])
        begun = float(times[0]) if np.isfinite(times[0]) else 0.0
    else:
        begun = start_of(times, numbers, rate, f"{rate:g} Hz", remarks)
    return _Timing(numbers, rate, begun if start is None else start)


def _placed(
    path: Path, values: Floats, table: Described, unit: str, remarks: list[Remark]
) -> tuple[Trajectories | None, Points | None]:
    """Cut the markers out of the table; in ours nothing stands for no place."""
    layout = table.layout
    if not layout.markers:
        return None, None
    columns = [c for cs in layout.markers.values() for c in cs]
    origin = _origins(path, values, layout)
    if table.is_own or columns != list(range(columns[0], columns[-1] + 1)):
        places = values[:, columns]
    else:
        places = _moved_together(values, columns[0], len(columns))
    places = places.reshape(len(values), -1, 3)
    if not table.is_own:
        blank_out(places, METRES[unit.lower()], remarks)
    in_metres(places, unit, out=places)
    return sort_out(places, list(layout.markers), origin)


def _moved_together(values: Floats, first: int, count: int) -> Floats:
    """(N, count) columns of a table in the table's own memory, which holds them then.

    So there are never two tables at once. Rows only move forward, over those that have
    moved already.
    """
    out = values.reshape(-1)[: len(values) * count].reshape(-1, count)
    step = max(1, _MOVED_NUMBERS // count)
    for row in range(0, len(values), step):
        rows = slice(row, row + step)
        out[rows] = values[rows, first : first + count].copy()
    return out


def _ends(layout: Layout, columns: int) -> frozenset[int]:
    """List how many cells a row may have where blanks at its end were cut off.

    Every marker keeps all its columns or none.
    """
    inside = np.zeros(columns + 1, dtype=np.int64)
    for mine in layout.markers.values():
        inside[min(mine) + 1] += 1
        inside[max(mine) + 1] -= 1
    whole = np.cumsum(inside) == 0
    lead = [c for c in (layout.frame, layout.time) if c is not None]
    whole[: max(lead, default=0) + 1] = False
    return frozenset(np.flatnonzero(whole[:columns]).tolist())


def _numbers(grid: Floats, table: Described) -> Floats:
    """(N,) frame numbers; a first column without a name counts where it can."""
    layout = table.layout
    if layout.frame is not None:
        numbers: Floats = grid[:, layout.frame]
        named = layout.frame > 0 or table.names[0] not in ("", INDEX)
        whole = bool(np.all(numbers == np.round(numbers)))
        if named or (whole and bool(np.all(np.diff(numbers) > 0))):
            return numbers
    return np.arange(len(grid), dtype=float) + float(table.said.get("first_frame", 1))


def _origins(path: Path, values: Floats, layout: Layout) -> Bytes | None:
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


def _motion(path: Path, values: Floats, layout: Layout, name: str, unit: str) -> Motion:
    """Cut one motion out of the table."""
    head = head_of(name, layout.motions)

    def block(names: Iterable[str]) -> Floats | None:
        columns = [layout.at.get(head + column) for column in names]
        found = [column for column in columns if column is not None]
        return values[:, found] if len(found) == len(columns) else None

    hinges = layout.motions[name]
    degrees, place, turn = block(hinges), block(PLACE), block(TURN)
    assert degrees is not None
    if turn is not None:
        with np.errstate(over="ignore"):
            length = np.linalg.norm(turn, axis=1, keepdims=True)
        if np.any(np.abs(length - 1) > 1e-3):
            raise FileError(path, f"motion '{name}': a quaternion's length is not 1")
        turn = turn / length
    trusted = block((TRUSTED,))
    if trusted is not None and not np.isin(trusted, (0.0, 1.0)).all():
        raise FileError(path, f"column '{head}{TRUSTED}' should hold 0 or 1")
    return Motion(
        names=tuple(hinges),
        angles=np.radians(degrees),
        translation=None if place is None else in_metres(place, unit),
        rotation=turn,
        trusted=None if trusted is None else trusted[:, 0] > 0.5,
    )
