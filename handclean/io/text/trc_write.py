r"""TRC as OpenSim's reader insists on it.

OpenSim 4.6 loses the last cell of a row where it is blank and then refuses the row for
its length, so a missing sample is NaN on each axis. Times have to rise. A marker of a
model may not have a blank, ``/``, ``\``, ``*`` or ``+`` in its name, so no marker gets
such a name here; names are unique. A point without a name is nothing that OpenSim could
use: it is written only on request, as ``U_0``, ``U_1`` ..., which reads back as one. A
TRC file cannot tell a filled sample from a measured one.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from handclean.errors import FileError
from handclean.io.shared.writing import Columns, columns_of, rows, write_lines
from handclean.io.text.trc_read import OWN
from handclean.recording import Recording
from handclean.remarks import Remark, remark

_KEYS = (
    "DataRate",
    "CameraRate",
    "NumFrames",
    "NumMarkers",
    "Units",
    "OrigDataRate",
    "OrigDataStartFrame",
    "OrigNumFrames",
)
_NOT_IN_NAMES = re.compile(r"[\s\x00-\x1f\\/*+]+")
_NAMED_MARKERS = 5
"""Markers that a remark names (chosen)."""


def write_trc(
    path: Path, recording: Recording, *, unnamed: bool = False
) -> tuple[Remark, ...]:
    """Write the markers as TRC in millimetres; missing samples are NaN.

    Parameters
    ----------
    unnamed : write points without a name, too.

    Returns
    -------
    what the format cannot hold or how it was met, one line each

    Raises
    ------
    FileError
        If there are no markers, or a name is blank.
    """
    remarks: list[Remark] = []
    points = recording.unlabelled
    if not unnamed and points is not None and len(points.frame):
        if recording.markers is None or not recording.markers.labels:
            wrong = f"nothing to write: none of {len(points.frame)} points has a name"
            raise FileError(path, wrong, "convert --unnamed writes them all the same")
        recording = replace(recording, unlabelled=None)
        remarks.append(
            remark(
                "not-kept",
                "convert --unnamed writes points without a name, too",
                points=len(points.frame),
            )
        )
    columns = columns_of(path, recording)
    named = 0 if recording.markers is None else len(recording.markers.labels)
    models = ("",) * named if recording.markers is None else recording.markers.model
    labels = _names(path, columns.labels[:named], models, remarks)
    labels += [f"U_{k}" for k in range(len(columns.labels) - named)]
    write_lines(path, _lines(recording, labels, columns))
    return (*columns.remarks, *remarks)


def _names(
    path: Path, labels: tuple[str, ...], models: tuple[str, ...], remarks: list[Remark]
) -> list[str]:
    """Return names that OpenSim takes, each once; say which are not as they were."""
    names: list[str] = []
    taken: set[str] = set()
    for label, model in zip(labels, models, strict=True):
        if not label.strip():
            raise FileError(path, f"TRC cannot hold a marker called {label!r}")
        name = wanted = _NOT_IN_NAMES.sub("_", label.strip())
        if name in taken and model:
            name = wanted = _NOT_IN_NAMES.sub("_", f"{model}:{wanted}")
        count = 1
        while name in taken:
            count += 1
            name = f"{wanted}_{count}"
        names.append(name)
        taken.add(name)
    pairs = zip(labels, names, strict=True)
    changed = [f"'{old}' as '{new}'" for old, new in pairs if old != new]
    if changed:
        more = len(changed) - _NAMED_MARKERS
        remarks.append(
            remark(
                "not-kept",
                "names that OpenSim takes, each once: "
                + ", ".join(changed[:_NAMED_MARKERS])
                + (f" and {more} more" if more > 0 else ""),
            )
        )
    return names


def _lines(recording: Recording, labels: list[str], columns: Columns) -> Iterator[str]:
    frames, first = recording.frames, recording.first_frame
    rate, markers = f"{recording.rate:.10g}", len(labels)
    values = (rate, rate, frames, markers, "mm", rate, first, frames)
    axes = [f"{axis}{m}" for m in range(1, markers + 1) for axis in "XYZ"]
    yield f"PathFileType\t4\t(X/Y/Z)\t{OWN}"
    yield "\t".join(_KEYS)
    yield "\t".join(map(str, values))
    yield "Frame#\tTime\t" + "\t\t\t".join(labels) + "\t\t"
    yield "\t\t" + "\t".join(axes)
    yield ""
    numbers = first + np.arange(frames)
    millimetres = 1e3 * columns.positions
    millimetres[np.isnan(millimetres).any(axis=2)] = np.nan
    table = np.column_stack([numbers, recording.clock, millimetres.reshape(frames, -1)])
    digits = max(6, math.ceil(math.log10(recording.rate)) + 2)  # so that times rise
    yield from rows(table, [0, digits] + [6] * (3 * markers), "\t", missing="NaN")
