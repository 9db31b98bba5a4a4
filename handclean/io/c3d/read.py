"""C3D files: reading, writing, looking into them.

Reading is handclean's own. The ``c3d`` package (0.6) is right about residuals, masks
and all three processors, but it refuses 5 of the 24 c3d.org samples that the tests know
(header and parameters that disagree, groups of one name, a damaged parameter section, a
TRIAL field of two dimensions), misreads others (missing points written unsigned, a DEC
0, more than 255 labels, long takes that do not start at frame 1), and does not keep
what rewriting needs: every byte that is not handclean's. A second parser would be
needed for these; one is enough. ``c3d`` and ``ezc3d`` are the tests' oracles instead,
each for what it is right about.

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

The parts, each on those before: ``c3d_numbers`` (processors), ``c3d_parameters`` and
``c3d_edit`` (the parameter section), ``c3d_samples`` (the four words of a point),
``c3d_layout`` (which of a file's claims are true), ``c3d_head``, ``c3d_remarks``,
``c3d_structure`` (a file opened); ``c3d_columns``, ``c3d_writing``, ``c3d_marks`` (what
was filled) for both; ``c3d_decode``, ``c3d_analog``, ``c3d_events`` for reading;
``c3d_again``, ``c3d_new``, ``c3d_write`` for writing.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from handclean.arrays import Bools
from handclean.errors import FileError
from handclean.io.c3d.analog import read_analog
from handclean.io.c3d.decode import (
    PointColumns,
    decisions,
    decode_points,
    sort_columns,
    taken_as_is,
)
from handclean.io.c3d.events import read_events
from handclean.io.c3d.head import Head
from handclean.io.c3d.parameters import plain_values
from handclean.io.c3d.remarks import twice
from handclean.io.c3d.samples import Coding, Tally
from handclean.io.c3d.scale import settle_scale
from handclean.io.c3d.structure import Structure, open_c3d
from handclean.io.c3d.write import encode_c3d, plan_writing
from handclean.io.shared.reading import (
    METRES,
    UNLABELLED,
    Reading,
    named_unit,
    reported,
    settle_rate,
    settle_unit,
)
from handclean.io.shared.writing import unwritable
from handclean.recording import Origin, Recording, Trajectories, only_finite
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
    told = [*structure.remarks, *decisions(tally, columns.labels, zeros_are_missing)]
    if structure.head.unit is None and unit is None:
        told.append(
            remark(
                "unit",
                "POINT:UNITS is missing: mm, the format's default, was taken",
                taken="mm",
            )
        )
    told += [*taken, *scales]
    told += twice([columns.labels[i] for i in columns.markers])
    return Recording(
        rate=hz,
        frames=layout.held,
        first_frame=layout.first_frame,
        up_axis=_up_axis(structure),
        markers=markers,
        unlabelled=loose,
        remarks=of_file(path, told),
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
    recording = only_finite(recording)
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


def inspect_c3d(
    path: Path | str, *, unit: str | None = None, believe_coordinates: bool = False
) -> dict[str, Any]:
    """Return what is in a file and what is odd about it, as plain JSON values.

    A truncated file, an unknown unit and a rate of 0 are remarks here, not errors.

    Parameters
    ----------
    unit, believe_coordinates : as in `read_c3d`.

    Raises
    ------
    FileError
        If the file cannot be read as C3D at all.
    """
    path = Path(path)
    structure = open_c3d(path, lenient=True, needs_points=False)
    head, layout = structure.head, structure.layout
    remarks = [*structure.remarks, *structure.asides]
    said = head.unit or unit or "mm"
    if unit is not None:
        said = settle_unit(path, said, unit, remarks)
    elif head.unit is None:
        remarks.append(
            remark(
                "unit",
                "POINT:UNITS is missing: mm, the format's default, is taken",
                taken="mm",
            )
        )
    elif named_unit(said) is None:
        remarks.append(
            remark(
                "unit",
                f"POINT:UNITS is '{said}', which is no unit known here",
                stated=said,
            )
        )
    known = named_unit(said)
    rate = stated_rate(structure)
    if not rate > 0:
        remarks.append(remark("time", f"POINT:RATE is {rate:g}"))
    columns = sort_columns(structure, UNLABELLED)
    tally = Tally()
    coding, scales = settle_scale(structure, METRES[known.lower()] if known else 1.0)
    remarks += scales
    remarks += twice([columns.labels[i] for i in columns.markers])
    markers, loose = decode_points(
        structure, coding, columns, tally, True, believe_coordinates
    )
    if not structure.points:
        remarks.append(remark("left-out", "it has no points, only analog channels"))
    remarks += decisions(tally, columns.labels, True) + taken_as_is(tally, coding)
    residual = _residual_range(markers)
    if residual and residual[1] > 254.5 * coding.scale * coding.metres:
        remarks.append(
            remark(
                "implausible",
                "some residuals are at 255 steps of POINT:SCALE, the most there is",
            )
        )
    if len(columns.outputs):
        remarks.append(
            remark(
                "left-out",
                f"{len(columns.outputs)} points are model outputs, not markers",
                points=len(columns.outputs),
            )
        )
    seen = {} if markers is None else _seen(markers)
    hz = rate if rate > 0 else 1.0
    analog = read_analog(structure, hz)
    return {
        "format": "c3d",
        "processor": head.processor.label,
        "numbers": "float" if layout.is_float else "integer",
        "frames": layout.held,
        "first_frame": layout.first_frame,
        "rate": rate if rate > 0 else None,
        "unit": known or said,
        "up_axis": _up_axis(structure),
        "scale": _shown_scale(head, coding),
        "points": layout.points,
        "markers": list(seen),
        "measured": seen,
        "residual_m": residual,
        "unlabelled_columns": len(columns.loose),
        "unlabelled_points": 0 if loose is None else len(loose.frame),
        "model_outputs": [columns.labels[i] for i in columns.outputs],
        "angles": _angles(structure, columns),
        "analog": [] if analog is None else list(analog.labels),
        "analog_rate": analog.rate if analog is not None and rate > 0 else None,
        "events": [
            {"time": e.time, "label": e.label, "context": e.context}
            for e in read_events(head, layout.first_frame, hz, as_stored=True)
        ],
        "groups": sorted(plain_values(head.section)),
        **reported(remarks),
    }


def _residual_range(markers: Trajectories | None) -> list[float] | None:
    """[m] least and largest residual of all markers, None if there are none."""
    if markers is None or markers.residual is None:
        return None
    known = markers.residual[np.isfinite(markers.residual)]
    return [float(known.min()), float(known.max())] if known.size else None


def _angles(structure: Structure, columns: PointColumns) -> list[str]:
    """Labels of the model outputs that are angles."""
    listed = set(structure.head.section.strings("POINT", "ANGLES"))
    outputs = [columns.labels[i] for i in columns.outputs]
    return [label for label in outputs if label in listed]


def _seen(markers: Trajectories) -> dict[str, int]:
    """Frames in which each label was measured, in whichever of its columns."""
    measured = markers.origin == Origin.MEASURED
    seen: dict[str, Bools] = {}
    for label, column in zip(markers.labels, measured.T, strict=True):
        seen[label] = seen[label] | column if label in seen else column
    return {label: int(np.count_nonzero(column)) for label, column in seen.items()}


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


def _up_axis(structure: Structure) -> str:
    """Axis that POINT:Y_SCREEN shows upwards, "" where it says nothing."""
    said = structure.head.section.strings("POINT", "Y_SCREEN")
    found = re.fullmatch(r"([+-]?)([xyz])", said[0].lower()) if said else None
    return f"{found[1] or '+'}{found[2]}" if found else ""


def _shown_scale(head: Head, coding: Coding) -> float | None:
    """Return POINT:SCALE, or the header's where that was taken; None if none is."""
    if coding.is_float or coding.scale == abs(head.scale):
        return head.scale if np.isfinite(head.scale) else None
    return coding.scale


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
