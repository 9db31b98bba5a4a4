"""CSV files of tracking systems, which have heads of their own: what they are.

They are not read; what is known of them by their first lines is said instead.
"""

import csv
from pathlib import Path

from handclean.errors import FileError
from handclean.io.shared.grid import Lines
from handclean.io.shared.reading import text

_NEXUS = {"trajectories", "devices", "joints", "segments", "model outputs", "events"}
_HEAD_LINES = 12
"""Lines by which an export of a vendor's program is known (chosen)."""

_SHOWN_NAMES = 5
"""Units and subjects that a message names (chosen)."""

_LINE_BYTES = 100_000
"""[bytes] of a line that are looked at (chosen)."""


def refuse_vendors(path: Path, lines: Lines) -> None:
    """Refuse a file of Vicon Nexus, OptiTrack Motive or Qualisys, saying what it is.

    Raises
    ------
    FileError
    """
    first = text((lines.peek() or b"")[:4096]).strip().strip('"')
    kind = first.replace(";", ",").split(",")[0].strip().strip('"').lower()
    known = ("format version", "pathfiletype", "no_of_frames", "file_version")
    if kind.split("\t")[0].split(" ")[0] in known:
        kind = kind.split("\t")[0].split(" ")[0]
    if kind not in (*known, *_NEXUS):
        return
    head = [
        text((lines.peek(after) or b"")[:_LINE_BYTES]) for after in range(_HEAD_LINES)
    ]
    rows = _cells(head)
    if kind == "format version":
        wrong, right = _motive(rows), "export the take from Motive as C3D"
    elif kind == "pathfiletype":
        wrong, right = "is a TRC file", "give it the suffix .trc"
    elif kind in ("no_of_frames", "file_version"):
        wrong, right = "is a Qualisys TSV file", "give it the suffix .tsv"
    elif len(rows[1]) and _is_count(rows[1][0]) and not any(rows[1][1:]):
        wrong, right = _nexus(rows), "export the trial from Nexus as C3D"
    else:
        return
    raise FileError(path, wrong, right)


def _cells(head: list[str]) -> list[list[str]]:
    """Part lines into cells by what parts most of them."""
    mark = max(",;\t", key="".join(head).count)
    try:
        rows = [next(csv.reader([line], delimiter=mark), []) for line in head]
    except csv.Error:
        rows = [line.split(mark) for line in head]
    return [[cell.strip() for cell in row] for row in rows]


def _is_count(cell: str) -> bool:
    return cell.replace(".", "", 1).isdigit() and len(cell) < 12


def _nexus(rows: list[list[str]]) -> str:
    """Say what a CSV of Vicon Nexus holds: rate, unit, subject, first frame."""
    names = [name for name in rows[2] if name]
    subjects = sorted({n.partition(":")[0][:40] for n in names if ":" in n})
    units = sorted({cell[:20] for cell in rows[4][2:] if cell})
    first = rows[5][0] if rows[5] else ""
    said = [f"{rows[0][0].lower()} at {rows[1][0]} Hz"]
    said += [f"in {', '.join(units[:_SHOWN_NAMES])}"] if units else []
    said += [f"{len(names)} markers"] if rows[0][0].lower() == "trajectories" else []
    said += [f"of {', '.join(subjects[:_SHOWN_NAMES])}"] if subjects else []
    said += [f"from frame {first}"] if _is_count(first) else []
    return f"is a CSV of Vicon Nexus ({' '.join(said)}), which is not read"


def _motive(rows: list[list[str]]) -> str:
    """Say what a CSV of OptiTrack Motive holds: rate, unit, kinds of columns."""
    facts = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    rate = facts.get("Export Frame Rate") or facts.get("Capture Frame Rate", "")
    said = [f"{float(rate):g} Hz"] if _is_count(rate) else []
    if unit := facts.get("Length Units", ""):
        said.append(unit.lower()[:20])
    kinds = next((row for row in rows[1:] if "Type" in row[:2]), [])
    names = next((row for row in rows[1:] if "Name" in row[:2]), [])
    for kind, one in (("Marker", "marker"), ("Rigid Body", "rigid body")):
        pairs = zip(kinds, names, strict=False)
        count = len({n for k, n in pairs if k == kind and not n.startswith("Unlab")})
        many = "rigid bodies" if kind == "Rigid Body" else "markers"
        said += [f"{count} {one if count == 1 else many}"] if count else []
    return f"is a CSV of OptiTrack Motive ({', '.join(said)}), which is not read"
