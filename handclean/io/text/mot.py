"""MOT: joint angles for OpenSim, one row per frame.

Angles are in degrees, translations in metres. The root's rotation is given as three
angles about its x, y and z axes, in this order, each axis carried along by the turns
before (``root_rx``, ``root_ry``, ``root_rz``). If there are several motions, their
columns begin with ``MOTION_``.

OpenSim's documentation says that NaN "must be removed from mot files": one spoils a
whole column, which is splined. It also says that only in ``.sto`` files, otherwise the
same, may times be spaced unevenly; but its reader asks no more of either than that they
rise, and its filters resample times that are uneven. So frames in which something is
missing or a hand is not trusted (a MOT has no room for saying so) are left out, and the
others keep their times: nothing is invented, and who wants even times has OpenSim fill
the holes, knowing that it does.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.io.shared.grid import Form, read_numbers
from handclean.io.shared.lines import Lines
from handclean.io.shared.reading import check_unique, finite, load_text, reported, text
from handclean.io.shared.rotations import euler_from_matrix, matrix_from_quaternion
from handclean.io.shared.writing import motions_of, rows, write_lines
from handclean.recording import Motion, Recording
from handclean.remarks import Remark, remark

_MOST_HEADER_LINES = 100
"""Lines before ``endheader``, at most (chosen)."""


def write_mot(path: Path, recording: Recording) -> tuple[Remark, ...]:
    """Write all motions of a take as one MOT file.

    Returns
    -------
    what the format cannot hold, one line each

    Raises
    ------
    FileError
        If there are no angles, no frame is whole and trusted, or a name cannot stand in
        a MOT file.
    """
    names, blocks = ["time"], [recording.clock[:, None]]
    motions = motions_of(path, recording)
    remarks: list[Remark] = []
    trusted = np.ones(recording.frames, dtype=bool)
    for name, motion in motions.items():
        if why := _unusable(motion):
            remarks.append(
                remark(
                    "not-kept",
                    f"motion '{name}' is left out: it is {why} throughout",
                    model=name,
                )
            )
            continue
        if motion.trusted is not None:
            trusted &= motion.trusted
        head = "" if len(motions) == 1 else f"{name}_"
        for column, values in _columns(motion).items():
            names.append(head + column)
            blocks.append(values[:, None])
    check_unique(path, "columns", names)
    for name in names:
        if len(name.split()) != 1:
            raise FileError(path, f"MOT cannot hold a column called {name!r}")
    table = np.column_stack(blocks)
    whole = finite(table)
    if len(names) == 1 or not (whole & trusted).any():
        wrong = "nothing to write: in no frame all angles are known and trusted"
        raise FileError(path, wrong, ".h5 and .csv hold what is not trusted, marked")
    for left_out, why in (
        (~whole, "something is missing in them, and OpenSim takes no NaN"),
        (whole & ~trusted, "they are not trusted, and MOT cannot say so"),
    ):
        if count := np.count_nonzero(left_out):
            remarks.append(
                remark(
                    "not-kept",
                    f"{count} of {len(whole)} frames are left out: {why}",
                    count=int(count),
                )
            )
    write_lines(path, _lines(names, table[whole & trusted]))
    return tuple(remarks)


def _unusable(motion: Motion) -> str:
    """Why no frame of a motion can be written; "" if one can."""
    known = finite(motion.poses)
    if not known.any():
        return "missing"
    if motion.trusted is not None and not (known & motion.trusted).any():
        return "not trusted"
    return ""


def inspect_mot(path: Path) -> dict[str, Any]:
    """Return what is in a MOT (or STO) file, as plain JSON values.

    Raises
    ------
    FileError
        If it is not one.
    """
    lines = Lines(path, load_text(path))
    said: dict[str, str] = {}
    for _ in range(_MOST_HEADER_LINES):
        line = lines.next()
        if line is None or line.strip() == b"endheader":
            break
        key, _, value = text(line).partition("=")
        said[key.strip().lower()] = value.strip()
    else:
        line = None
    if line is None:
        raise FileError(path, "is not a MOT file", "its header ends with 'endheader'")
    names = [text(cell) for cell in lines.cells(None)]
    if not names:
        raise FileError(lines.where, "names no columns", "'time' should be the first")
    remarks: list[Remark] = []
    table = read_numbers(
        lines, Form(columns=len(names), delimiter=None), remarks, lenient=True
    )
    times = table[:, 0]
    if not (np.abs(times) < 1e15).all():
        raise FileError(path, "a time is missing, or no number of seconds")
    steps = np.diff(times)
    step = float(np.median(steps)) if len(steps) else 0.0
    if said.get("nrows", str(len(table))) != str(len(table)):
        remarks.append(
            remark("header", f"nRows says {said['nrows']}, there are {len(table)} rows")
        )
    if not step > 0:
        remarks.append(remark("time", "its times do not rise"))
    elif np.any(steps > 1.5 * step):
        with np.errstate(over="ignore"):
            holes = np.nansum(np.rint(steps / step - 1).clip(min=0))
        remarks.append(
            remark(
                "time",
                f"{holes:.6g} frames are left out: its times are spaced unevenly",
            )
        )
    if np.isnan(table).any():
        count = np.count_nonzero(np.isnan(table).any(axis=1))
        remarks.append(
            remark(
                "missing",
                f"{count} rows hold NaN, which OpenSim cannot use",
                rows=int(count),
            )
        )
    return {
        "format": "mot",
        "frames": len(table),
        "rate": float(f"{1.0 / step:.6g}") if step > 0 else None,
        "duration_s": float(times[-1] - times[0] + step) if step > 0 else None,
        "columns": names,
        "in_degrees": said.get("indegrees", "no").lower() == "yes",
        **reported(remarks),
    }


def _columns(motion: Motion) -> dict[str, Floats]:
    columns: dict[str, Floats] = {}
    if motion.rotation is not None:
        turn = euler_from_matrix(matrix_from_quaternion(motion.rotation), "xyz")
        for axis, angle in zip("xyz", turn.T, strict=True):
            columns[f"root_r{axis}"] = np.degrees(_unwrapped(angle))
    if motion.translation is not None:
        for axis, place in zip("xyz", motion.translation.T, strict=True):
            columns[f"root_t{axis}"] = place
    for hinge, angle in zip(motion.names, motion.angles.T, strict=True):
        columns[hinge] = np.degrees(angle)
    return columns


def _unwrapped(angle: Floats) -> Floats:
    """(T,) the same angles without jumps of a full turn; NaN stays where it is."""
    out, known = angle.copy(), np.isfinite(angle)
    out[known] = np.unwrap(angle[known])
    return out


def _lines(names: list[str], table: Floats) -> Iterator[str]:
    yield "handclean"
    yield "version=1"
    yield f"nRows={len(table)}"
    yield f"nColumns={table.shape[1]}"
    yield "inDegrees=yes"
    yield ""
    yield "Units are S.I. units (second, meter); angles are in degrees."
    yield ""
    yield "endheader"
    yield "\t".join(names)
    yield from rows(table, [9] * len(names), "\t")
