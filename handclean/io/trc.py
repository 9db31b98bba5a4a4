"""TRC: marker trajectories as text, of Motion Analysis and OpenSim.

Six header lines: file type; keys; values; marker names, each above three columns;
X1 Y1 Z1 X2 ...; blank. Then one row per frame: number, time, coordinates, blank where
missing. Reading takes what programs write: coordinate names counted from 0, tabs at
line ends, frame counts that are wrong. `handclean.io.trc_write` writes them.
"""

from pathlib import Path

from handclean.errors import FileError
from handclean.io.clock import start_of
from handclean.io.grid import Lines, read_numbers
from handclean.io.reading import (
    Reading,
    check_labels,
    in_metres,
    load_text,
    place_rows,
    positive,
    settle_rate,
    settle_unit,
    sort_out,
    text,
    zeros_are_missing,
)
from handclean.recording import Recording


def read_trc(
    path: Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
) -> Reading:
    """Read a TRC file.

    Parameters
    ----------
    rate_hz, unit : options that must agree with the file.
    lenient : leave out a last row that was cut off.

    Raises
    ------
    FileError
        If it is not a TRC file.
    UsageError
        If an option contradicts it.
    """
    lines = Lines(path, load_text(path))
    traps: list[str] = []
    stated = _header(path, lines)
    rate = settle_rate(path, positive(path, "DataRate", stated["DataRate"]), rate_hz)
    length = settle_unit(path, stated["Units"], unit)
    labels = _labels(path, lines, stated, traps)
    columns = 2 + 3 * len(labels)
    grid = read_numbers(lines, columns, b"\t", traps, lenient=lenient)
    _check_count(stated["NumFrames"], len(grid), traps)
    said = f"DataRate, {rate:g} Hz"
    start = start_of(grid[:, 1], grid[:, 0], rate, said, traps)
    first, values = place_rows(path, grid[:, 0], grid[:, 2:], traps)
    positions = in_metres(values, length).reshape(len(values), -1, 3)
    zeros_are_missing(positions, traps)
    markers, points = sort_out(positions, labels)
    recording = Recording(
        rate=rate,
        frames=len(values),
        first_frame=first,
        start_time=start,
        markers=markers,
        unlabelled=points,
    )
    return Reading(recording=recording, unit=length, traps=tuple(traps))


def _header(path: Path, lines: Lines) -> dict[str, str]:
    """Read the keys and values of the first three lines."""
    kind = lines.cells(None)
    if not kind or kind[0] != b"PathFileType":
        right = "a TRC file begins with 'PathFileType'"
        raise FileError(path, "is not a TRC file", right)
    keys = [text(cell) for cell in lines.cells(b"\t") if cell]
    values = [text(cell) for cell in lines.cells(b"\t") if cell]
    stated = dict(zip(keys, values, strict=False))
    for key in ("DataRate", "NumFrames", "NumMarkers", "Units"):
        if key not in stated:
            raise FileError(path, f"its header has no {key}")
    return stated


def _labels(
    path: Path, lines: Lines, stated: dict[str, str], traps: list[str]
) -> list[str]:
    """Read the marker names and the line of coordinate names below them."""
    cells = lines.cells(b"\t")
    labels = [text(cell) for cell in cells[2::3]]
    while labels and not labels[-1]:
        labels.pop()
    if len(cells) < 2 or not cells[0].lower().startswith(b"frame"):
        raise FileError(lines.where, "should begin with 'Frame#' and 'Time'")
    if any(cells[3::3]) or any(cells[4::3]):
        raise FileError(lines.where, "a marker's name should stand above its X only")
    check_labels(path, labels)
    if stated["NumMarkers"] != str(len(labels)):
        claim = stated["NumMarkers"]
        traps.append(f"NumMarkers says {claim}, {len(labels)} markers are named")
    under = lines.peek()
    if under is not None and under.strip()[:1] in (b"X", b"x"):
        if b"X0" in under.split(None, 1)[:1]:
            traps.append("coordinates are counted from X0 instead of X1")
        lines.next()
    return labels


def _check_count(claim: str, rows: int, traps: list[str]) -> None:
    if claim != str(rows):
        traps.append(f"NumFrames says {claim}, there are {rows} rows")
