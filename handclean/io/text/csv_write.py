"""CSV of markers and angles, as `handclean.io.text.csv_read` says."""

import csv
import json
from collections.abc import Iterator
from io import StringIO
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.io.shared.reading import check_unique
from handclean.io.shared.writing import Columns, columns_of, rows, write_lines
from handclean.io.text.csv_columns import PLACE, TRUSTED, TURN, head_of
from handclean.io.text.csv_header import MARK
from handclean.recording import Recording
from handclean.remarks import Remark


def write_csv(path: Path, recording: Recording) -> tuple[Remark, ...]:
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
    return columns.remarks if columns else ()


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
        head = head_of(name, recording.motions)
        if motion.translation is not None:
            names += [head + column for column in PLACE]
            decimals += [6] * 3
            blocks.append(1e3 * motion.translation)
        if motion.rotation is not None:
            names += [head + column for column in TURN]
            decimals += [12] * 4
            blocks.append(motion.rotation)
        names += [head + hinge for hinge in motion.names]
        decimals += [9] * len(motion.names)
        blocks.append(np.degrees(motion.angles))
        if motion.trusted is not None:
            names.append(head + TRUSTED)
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
    yield f"{MARK} {json.dumps(said, ensure_ascii=False)}"
    line = StringIO()
    csv.writer(line, lineterminator="").writerow(names)
    yield line.getvalue()
    yield from rows(np.column_stack(blocks), decimals, ",")
