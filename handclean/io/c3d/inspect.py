"""What is in a C3D file, and what is odd about it."""

from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bools
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
from handclean.io.c3d.read import stated_rate, up_axis
from handclean.io.c3d.remarks import twice
from handclean.io.c3d.samples import Coding, Tally
from handclean.io.c3d.scale import settle_scale
from handclean.io.c3d.structure import Structure, open_c3d
from handclean.io.shared.reading import UNLABELLED, reported
from handclean.io.shared.settle import METRES, named_unit, settle_unit
from handclean.recording import Origin, Trajectories
from handclean.remarks import remark


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
        "up_axis": up_axis(structure),
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


def _shown_scale(head: Head, coding: Coding) -> float | None:
    """Return POINT:SCALE, or the header's where that was taken; None if none is."""
    if coding.is_float or coding.scale == abs(head.scale):
        return head.scale if np.isfinite(head.scale) else None
    return coding.scale
