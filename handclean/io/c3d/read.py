"""C3D files: reading and writing.

Reading is handclean's own. The ``c3d`` package (0.6) is right about residuals, masks
and all three processors, but it refuses 5 of the 24 c3d.org samples that the tests know
(header and parameters that disagree, groups of one name, a damaged parameter section, a
TRIAL field of two dimensions), misreads others (missing points written unsigned, a DEC
0, more than 255 labels, long takes that do not start at frame 1), and does not keep
what rewriting needs: every byte that is not handclean's. A second parser would be
needed for these; one is enough. ``c3d`` reads beside it where a user asks for a second
opinion (`handclean.io.c3d.verify`); it and ``ezc3d`` are the tests' oracles, each for
what it is right about.

A recording read from C3D carries in ``parameters["c3d"]``

==========  =======================================================================
head        uint8, all bytes before the samples: header, parameters, as they were
frames      (T, words) uint16 or uint32, the words of all frames as they were
tail        uint8, what follows the samples
points      points per frame
loose       int32, the columns whose label names no marker; absent if there are none
numbers     "float" or "integer"
unit        that was taken: POINT:UNITS, "mm" where it is missing, or ``--unit``
scale       the header's, where it and not POINT:SCALE was taken; else absent
groups      the parameters, decoded, for people
==========  =======================================================================

so that it can be written again, also after a stay in a session file, with everything
untouched that no step has changed.

The modules, each on those before: `numbers` (processors), `parameters` and `edit` (the
parameter section), `samples` (the four words of a point), `layout` (which of a file's
claims are true), `head`, `remarks`, `structure` (a file opened), `scale`; `columns`,
`draft`, `filled_list` (what was filled) for both; `decode`, `analog`, `events` for
reading; `rewrite`, `new`, `write` for writing; `inspect`; `witness`, `verdict` and
`verify` for the comparison with the ``c3d`` package.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from handclean.errors import FileError
from handclean.io.c3d.analog import read_analog
from handclean.io.c3d.decode import (
    PointColumns,
    decisions,
    decode_points,
    sort_columns,
)
from handclean.io.c3d.events import read_events
from handclean.io.c3d.parameters import plain_values
from handclean.io.c3d.remarks import twice
from handclean.io.c3d.samples import Coding, Tally
from handclean.io.c3d.scale import settle_scale
from handclean.io.c3d.structure import Structure, open_c3d
from handclean.io.c3d.write import encode_c3d, plan_writing
from handclean.io.shared.reading import UNLABELLED, Reading
from handclean.io.shared.settle import METRES, settle_rate, settle_unit
from handclean.io.shared.writing import unwritable
from handclean.recording import Recording
from handclean.remarks import Remark, of_file, remark


def read_c3d(
    path: Path | str,
    *,
    lenient: bool = False,
    unlabelled: Sequence[str] = UNLABELLED,
    zeros_are_missing: bool = True,
    believe_coordinates: bool = False,
    unit: str | None = None,
    rate: float | None = None,
) -> Recording:
    """Read a C3D file.

    Parameters
    ----------
    lenient : take the whole frames of a truncated file, and say so in an event.
    unlabelled : regular expressions of labels that name no marker; points of such
        columns become `Recording.unlabelled`.
    zeros_are_missing : points at exactly (0, 0, 0) count as missing; an event says how
        many there were.
    believe_coordinates : take points with coordinates in a file that marks every point
        as missing, as some programs do; an event says how many.
    unit : of lengths, for files that do not say; where one says another, it is taken
        and a remark says so. Without either the format's own default, mm, holds.
    rate : for files that do not say; must agree with those that do.

    Raises
    ------
    FileError
        If the file cannot be read as C3D, or is truncated.
    UsageError
        If ``rate`` contradicts the file, ``unit`` is none, or a pattern is no
        expression.
    """
    path = Path(path)
    structure = open_c3d(path, lenient)
    hz = _rate(structure, rate)
    taken: list[Remark] = []
    name = settle_unit(path, structure.head.unit or unit or "mm", unit, taken)
    coding, scales = settle_scale(structure, METRES[name.lower()])
    columns = sort_columns(structure, unlabelled)
    tally = Tally()
    markers, loose = decode_points(
        structure, coding, columns, tally, zeros_are_missing, believe_coordinates
    )
    layout = structure.layout
    remarks = [*structure.remarks, *decisions(tally, columns.labels, zeros_are_missing)]
    if structure.head.unit is None and unit is None:
        remarks.append(
            remark(
                "unit",
                "POINT:UNITS is missing: mm, the format's default, was taken",
                taken="mm",
            )
        )
    remarks += [*taken, *scales]
    remarks += twice([columns.labels[i] for i in columns.markers])
    return Recording(
        rate=hz,
        frames=layout.held,
        first_frame=layout.first_frame,
        up_axis=up_axis(structure),
        markers=markers,
        unlabelled=loose,
        remarks=of_file(path, remarks),
        analog=read_analog(structure, hz),
        parameters={"c3d": _kept(structure, name, columns, coding)},
        source_events=read_events(structure.head, layout.first_frame, hz),
    )


def read_c3d_take(
    path: Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
    believe_coordinates: bool = False,
) -> Reading:
    """Read a C3D file as readers of other formats hand over a take; see `read_c3d`."""
    take = read_c3d(
        path,
        lenient=lenient,
        unit=unit,
        rate=rate_hz,
        believe_coordinates=believe_coordinates,
    )
    return Reading(
        recording=replace(take, remarks=()),
        unit=str(take.parameters["c3d"]["unit"]),
        remarks=take.remarks,
    )


def write_c3d(
    target: Path | str | BinaryIO, recording: Recording
) -> tuple[Remark, ...]:
    """Write a recording as C3D; see `handclean.io.c3d.write` for what becomes of it.

    Returns
    -------
    what the file cannot hold or how it was met

    Raises
    ------
    FileError
        If it holds no points, does not fit the format, or cannot be written.
    """
    if not isinstance(target, Path | str):
        writing = plan_writing(recording, "C3D")
        target.writelines(encode_c3d(writing))
        return writing.remarks
    writing = plan_writing(recording, target)
    try:
        with open(target, "wb") as file:
            file.writelines(encode_c3d(writing))
    except OSError as error:
        raise unwritable(target, error) from None
    return writing.remarks


def stated_rate(structure: Structure) -> float:
    """[Hz] POINT:RATE, else the header's; NaN where it is no number."""
    said = structure.head.section.numbers("POINT", "RATE")
    rate = float(said[0]) if said.size else structure.head.header.rate
    return rate if np.isfinite(rate) else np.nan


def _rate(structure: Structure, option: float | None) -> float:
    stated = stated_rate(structure)
    if not stated > 0 and option is None:
        right = "it should be above 0 Hz; --rate HZ gives it"
        raise FileError(structure.path, f"POINT:RATE is {stated:g}", right)
    return settle_rate(structure.path, stated if stated > 0 else None, option)


def up_axis(structure: Structure) -> str:
    """Axis that POINT:Y_SCREEN shows upwards, "" where it says nothing."""
    said = structure.head.section.strings("POINT", "Y_SCREEN")
    found = re.fullmatch(r"([+-]?)([xyz])", said[0].lower()) if said else None
    return f"{found[1] or '+'}{found[2]}" if found else ""


def _kept(
    structure: Structure, unit: str, columns: PointColumns, coding: Coding
) -> dict[str, Any]:
    """Return what a rewrite needs, and the parameters for people."""
    head = np.frombuffer(structure.head.raw, np.uint8)
    kept: dict[str, Any] = {
        "head": head,
        "frames": structure.frames,
        "points": structure.points,
        "numbers": "float" if structure.layout.is_float else "integer",
        "unit": unit,
    }
    if not coding.is_float and coding.scale != abs(structure.head.scale):
        kept["scale"] = coding.scale
    if len(columns.loose):
        kept["loose"] = columns.loose.astype(np.int32)
    if structure.tail.size:
        kept["tail"] = structure.tail
    groups = plain_values(structure.head.section)
    if groups:
        kept["groups"] = groups
    return kept
