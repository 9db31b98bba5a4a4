"""Qualisys TSV: key lines, marker names, then one tab-separated row per frame.

Lengths are in millimetres by definition of the format. A missing sample is blank or,
from older versions, (0, 0, 0). A trajectory is Measured, Gap-filled, Virtual or Mixed;
what is filled does not count as measured, but a Mixed one does not say which of its
samples are filled: they all count as measured, and a trap says so. Without the key
lines it is a table like a CSV, and options say what it does not.
"""

import re
from functools import partial
from pathlib import Path

import numpy as np

from handclean.arrays import Bytes, Floats
from handclean.errors import FileError
from handclean.io.shared.clock import start_of
from handclean.io.shared.grid import Form, read_numbers
from handclean.io.shared.lines import Lines
from handclean.io.shared.missing import blank_out
from handclean.io.shared.reading import (
    Reading,
    check_labels,
    finite,
    open_text,
    place_rows,
    sort_out,
    text,
)
from handclean.io.shared.settle import (
    METRES,
    in_metres,
    positive,
    settle_rate,
    settle_unit,
)
from handclean.io.text.csv_header import is_number
from handclean.io.text.csv_read import read_table
from handclean.io.text.decimal_commas import refuse_decimal_commas
from handclean.io.text.motive import is_motive
from handclean.io.text.vicon import is_nexus
from handclean.recording import Event, Numbering, Origin, Recording
from handclean.remarks import Remark, remark

_HEAD_BYTES = 4096
"""[bytes] of a line that are looked at for names of axes (chosen)."""

_EXTERNAL = "EXT"
"""A frequency that another device gives: the file does not say it."""

_OTHER_KEYS = (
    (("NO_OF_BODIES", "BODY_NAMES"), "6D data of rigid bodies"),
    (
        ("SKELETON_NAME", "NO_OF_SKELETONS", "NO_OF_SEGMENTS"),
        "the segments of skeletons",
    ),
    (("FORCE_PLATE_NAME", "FORCE_PLATE_TYPE"), "a force plate's data"),
    (("NO_OF_SAMPLES", "CHANNEL_NAMES", "NO_OF_CHANNELS"), "analog data"),
)
"""Keys of files that hold no trajectories, and what they hold."""

_OTHER_DATA = {
    "2D": "2D data of cameras",
    "6D": "6D data of rigid bodies",
    "6DOF": "6D data of rigid bodies",
    "SKELETON": "the segments of skeletons",
    "ANALOG": "analog data",
    "FORCE": "a force plate's data",
}
"""What ``DATA_INCLUDED`` may be besides 3D."""

_OTHER_COLUMNS = (
    (rb"\tRot\s?\[0\]|\tRoll\tPitch\tYaw", "6D data of rigid bodies"),
    (rb"[ _]Q[XW]\t.*[ _]Q[WZ](?:\t|$)", "the segments of skeletons"),
)
"""Columns of such files where they have no keys."""

_FILLED_KINDS = {"gap-filled", "virtual"}


def read_tsv(
    path: Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
) -> Reading:
    """Read a Qualisys TSV file of 3D trajectories.

    Parameters
    ----------
    rate_hz, unit : options that must agree with the file.
    lenient : leave out a last row that was cut off.

    Raises
    ------
    FileError
        If it is not such a file.
    UsageError
        If an option contradicts it.
    """
    lines = Lines(path, partial(open_text, path))
    if is_nexus(lines) or is_motive(lines) or _has_no_keys(lines):
        _refuse_others(path, {}, lines.peek() or b"")
        return read_table(path, rate_hz=rate_hz, unit=unit, lenient=lenient, bare=True)
    remarks: list[Remark] = []
    keys, events = _header(path, lines)
    stated = _one(keys, "FREQUENCY")
    known = None if stated.upper() == _EXTERNAL else positive(path, "FREQUENCY", stated)
    rate = settle_rate(path, known, rate_hz)
    length = settle_unit(path, "mm", unit, remarks)
    labels = keys["MARKER_NAMES"]
    while labels and not labels[-1]:
        labels.pop()
    check_labels(path, labels)
    lead = _lead_columns(lines, len(labels))
    refuse_decimal_commas(lines, b"\t")
    columns = lead + 3 * len(labels)
    form = Form(
        columns=columns,
        delimiter=b"\t",
        ends=range(lead, columns, 3),
        numbered=lead > 0,
    )
    grid = read_numbers(lines, form, remarks, lenient=lenient)
    for key, count in (("NO_OF_FRAMES", len(grid)), ("NO_OF_MARKERS", len(labels))):
        if _one(keys, key) not in ("", str(count)):
            remarks.append(
                remark("header", f"{key} says {_one(keys, key)}, there are {count}")
            )
    numbers = grid[:, 0] if lead else np.arange(1.0, len(grid) + 1)
    said = f"FREQUENCY, {rate:g} Hz"
    start = 0.0
    if lead > 1:
        start = start_of(grid[:, 1], numbers, rate, said, remarks)
    first, values = place_rows(path, numbers, grid[:, lead:], remarks)
    positions = values.reshape(len(values), -1, 3)
    blank_out(positions, METRES[length.lower()], remarks)
    positions = in_metres(positions, length)
    origin = _origin(positions, labels, keys.get("TRAJECTORY_TYPES", []), remarks)
    markers, points = sort_out(positions, labels, origin)
    recording = Recording(
        rate=rate,
        frames=len(values),
        first_frame=first,
        start_time=start,
        markers=markers,
        unlabelled=points,
        events=_events(events, Numbering(first), len(values)),
    )
    return Reading(recording=recording, unit=length, remarks=tuple(remarks))


def _has_no_keys(lines: Lines) -> bool:
    """Whether a file begins with the names of columns, as QTM exports without a head.

    Raises
    ------
    FileError
        If its cells are parted by something else than tabs.
    """
    line = lines.peek() or b""
    key = text(re.split(rb"[\t,; ]", line.strip(), maxsplit=1)[0])
    if is_number(key):
        return True
    if not (key.isupper() and "_" in key):
        return bool(re.search(rb"[-_ .:][XYZxyz]\s*(?:\t|$)", line[:_HEAD_BYTES]))
    if b"\t" not in line and line.strip() != key.encode():
        parted = "its cells are not parted by tabs"
        raise FileError(lines.path, parted, "a Qualisys TSV file has tabs")
    return False


def _header(
    path: Path, lines: Lines
) -> tuple[dict[str, list[str]], list[tuple[str, int]]]:
    """Read the key lines, up to the first one that is none; and the events."""
    keys: dict[str, list[str]] = {}
    events: list[tuple[str, int]] = []
    while (line := lines.peek()) is not None:
        key = text(line.split(b"\t", 1)[0]).strip()
        if line.strip() and not (key.isupper() and key.replace("_", "").isalnum()):
            break
        cells = [text(cell) for cell in lines.cells(b"\t")]
        if key == "EVENT" and len(cells) > 2 and re.fullmatch(r"[0-9]{1,9}", cells[2]):
            events.append((cells[1], int(cells[2])))
        elif key:
            keys[key] = cells[1:]
    _refuse_others(path, keys, lines.peek() or b"")
    for key in ("FREQUENCY", "MARKER_NAMES"):
        if key not in keys:
            right = "a Qualisys TSV file of trajectories has one"
            raise FileError(path, f"its header has no {key}", right)
    return keys, events


def _refuse_others(path: Path, keys: dict[str, list[str]], columns: bytes) -> None:
    """Refuse a file of Qualisys that holds no trajectories, saying what it holds.

    Parameters
    ----------
    columns : the line of their names.

    Raises
    ------
    FileError
    """
    included = re.split(r"[^A-Z0-9]", _one(keys, "DATA_INCLUDED").upper())[0]
    found = [_OTHER_DATA[included]] if included in _OTHER_DATA else []
    if "MARKER_NAMES" not in keys:
        found += [held for some, held in _OTHER_KEYS if any(k in keys for k in some)]
        head = columns[:_HEAD_BYTES]
        found += [held for some, held in _OTHER_COLUMNS if re.search(some, head)]
    if found:
        wrong = f"is a Qualisys TSV of {found[0]}, which is not read"
        raise FileError(path, wrong, "export the measurement's 3D data")


def _events(
    found: list[tuple[str, int]], numbering: Numbering, frames: int
) -> tuple[Event, ...]:
    """Events within the take, of one frame each."""
    spans = [(numbering.rows(number, number), name) for name, number in found]
    return tuple(
        Event(start=start, stop=stop, text=name)
        for (start, stop), name in spans
        if 0 <= start < frames
    )


def _one(keys: dict[str, list[str]], key: str) -> str:
    return next(iter(keys.get(key, [])), "")


def _lead_columns(lines: Lines, markers: int) -> int:
    """Count the columns before the first marker; a line of column names is read."""
    line = lines.peek()
    if line is None:
        raise FileError(lines.path, "has no frames")
    cells = [cell.strip() for cell in line.split(b"\t", 3)]
    for lead, cell in enumerate(cells[:3]):
        if cell.upper().endswith(b" X"):
            lines.next()
            return lead
    return 2 if line.count(b"\t") > 3 * markers else 0


def _origin(
    positions: Floats, labels: list[str], types: list[str], remarks: list[Remark]
) -> Bytes:
    """(T, M) where samples come from, as far as the trajectory types say."""
    seen = finite(positions)
    origin = np.where(seen, np.uint8(Origin.MEASURED), np.uint8(Origin.MISSING))
    for column, (label, kind) in enumerate(zip(labels, types, strict=False)):
        if kind.lower() in _FILLED_KINDS:
            origin[seen[:, column], column] = Origin.FILLED
            remarks.append(
                remark(
                    "filled",
                    f"{label} is {kind}: its samples count as filled",
                    marker=label,
                )
            )
        elif kind.lower() == "mixed":
            remarks.append(
                remark(
                    "filled",
                    f"{label} is Mixed: which samples are filled is not said",
                    marker=label,
                )
            )
    return origin
