"""MOT: joint angles for OpenSim, one row per frame.

Angles are in degrees, translations in metres. The root's rotation is given as three
angles about its x, y and z axes, in this order, each axis carried along by the turns
before (``root_rx``, ``root_ry``, ``root_rz``). If there are several motions, their
columns begin with ``MOTION_``. Frames without angles are ``NaN``.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.io.reading import check_unique
from handclean.io.rotations import euler_from_matrix, matrix_from_quaternion
from handclean.io.writing import motions_of, rows, write_lines
from handclean.recording import Motion, Recording


def write_mot(path: Path, recording: Recording) -> tuple[str, ...]:
    """Write all motions of a take as one MOT file.

    Returns
    -------
    what the format cannot hold, one line each

    Raises
    ------
    FileError
        If there are no angles, or a name cannot stand in a MOT file.
    """
    names, blocks = ["time"], [recording.times[:, None]]
    motions = motions_of(path, recording)
    for name, motion in motions.items():
        head = "" if len(motions) == 1 else f"{name}_"
        for column, values in _columns(motion).items():
            names.append(head + column)
            blocks.append(values[:, None])
    check_unique(path, "columns", names)
    for name in names:
        if len(name.split()) != 1:
            raise FileError(path, f"MOT cannot hold a column called {name!r}")
    write_lines(path, _lines(names, np.column_stack(blocks)))
    return ()


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
    yield from rows(table, [6] + [9] * (len(names) - 1), "\t", missing="NaN")
