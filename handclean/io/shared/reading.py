"""What every reader needs: the bytes, places of rows, labels, remarks on them.

A reader remarks on what is odd about a file that is read all the same and that its
owner should know: a wrong count, frames left out, trajectories that are part filled.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bools, Bytes, Floats
from handclean.errors import FileError
from handclean.io.shared.unread import refuse_binary
from handclean.recording import Origin, Points, Recording, Trajectories
from handclean.remarks import Remark, remark

_BLANK_HEAD_BYTES = 2**12
"""[bytes] that are looked at first, to tell whether a file is blank (chosen)."""

_PIECE_BYTES = 1 << 20
"""[bytes] of a text that are in memory at a time (chosen)."""

UNLABELLED = (r"^\*\d+$", r"^[CU]_\d+$", r"(?i)^unlabel", r"^$")
"""Regular expressions (searched) of names that stand for no marker in particular."""

_MOST_FRAMES_PER_ROW = 4
"""A take may have this many times more frames than rows (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """A recording as one file gave it.

    Attributes
    ----------
    recording : the take.
    unit : the file's unit of length, as the file or the option calls it.
    remarks : what was odd.
    told : what else ``inspect`` tells of the file, as plain JSON values.
    """

    recording: Recording
    unit: str
    remarks: tuple[Remark, ...] = ()
    told: Mapping[str, Any] = field(default_factory=dict)


def reported(remarks: Iterable[Remark]) -> dict[str, Any]:
    """Return remarks as ``inspect`` reports them: their texts, and the whole of them.

    Users hold on to the texts under the name ``traps``.
    """
    remarks = list(remarks)
    return {
        "traps": [one.text for one in remarks],
        "remarks": [one.as_json() for one in remarks],
    }


def with_remarks(
    about: Mapping[str, Any], first: Iterable[Remark], last: Iterable[Remark] = ()
) -> dict[str, Any]:
    """Return what `reported` is part of with more remarks before and after.

    What is among them already is not said again.
    """
    known = about["remarks"]
    before, after = (
        reported(one for one in more if one.as_json() not in known)
        for more in (first, last)
    )
    more = {key: [*before[key], *about[key], *after[key]] for key in before}
    return {**about, **more}


@contextmanager
def reading_errors(path: Path) -> Iterator[None]:
    """Within, what keeps a file from being read is a `FileError` about it."""
    try:
        yield
    except FileNotFoundError:
        raise FileError(path, "no such file") from None
    except IsADirectoryError:
        raise FileError(path, "is a directory", "give a file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(path, f"cannot be read ({reason})") from None


def load(path: Path) -> bytes:
    """Return the bytes of a file that is there, is a file and is not empty.

    Raises
    ------
    FileError
        If it is not.
    """
    with reading_errors(path):
        content = path.read_bytes()
    blank = b"\0 \t\r\n"
    if not content[:_BLANK_HEAD_BYTES].strip(blank) and not content.strip(blank):
        raise FileError(path, "is empty")
    return content


def load_text(path: Path) -> bytes:
    r"""Return a text file's bytes as UTF-8 with ``\n`` line ends.

    Raises
    ------
    FileError
        If it cannot be read or is not text.
    """
    content = load(path)
    if encoding := _wide(content[:64]):
        try:
            content = content.decode(encoding).encode()
        except UnicodeError:
            raise FileError(path, "is not text (broken UTF-16)") from None
    content = content.removeprefix(b"\xef\xbb\xbf")
    return _clean(path, content.rstrip(b"\x1a"))  # the end of a file, for DOS


def open_text(path: Path) -> Iterator[bytes]:
    """Give what `load_text` returns in pieces of whole lines, as they are asked for.

    Raises
    ------
    FileError
        If it cannot be read or is not text.
    """
    with reading_errors(path), open(path, "rb") as file:
        piece = file.read(_PIECE_BYTES)
        blank = not piece.strip(b"\0 \t\r\n")
        if len(piece) < _PIECE_BYTES or blank or _wide(piece[:64]):
            yield load_text(path)
            return
        piece, begun = piece.removeprefix(b"\xef\xbb\xbf"), list[bytes]()
        while piece:
            stop = piece.rfind(b"\n") + 1
            if stop:
                yield _clean(path, b"".join([*begun, piece[:stop]]))
                begun.clear()
            begun.append(piece[stop:])
            piece = file.read(_PIECE_BYTES)
        if rest := b"".join(begun).rstrip(b"\x1a"):
            yield _clean(path, rest)


def _clean(path: Path, piece: bytes) -> bytes:
    r"""Return a piece of a text with ``\n`` line ends."""
    if b"\0" in piece:
        refuse_binary(path, piece)
    if b"\r" not in piece:  # which is found out in no time
        return piece
    return piece.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _wide(head: bytes) -> str:
    """Say in which UTF-16 a file begins, "" if in none; it may lack its mark."""
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    if len(head) < 8 or head.count(b"\0") * 2 != len(head) // 2 * 2:
        return ""
    if not any(head[1::2]):
        return "utf-16-le"
    return "utf-16-be" if not any(head[::2]) else ""


def text(line: bytes) -> str:
    """Decode a header line: UTF-8, else Windows-1252 as older programs write it."""
    for encoding in ("utf-8", "cp1252"):
        try:
            return line.decode(encoding)
        except UnicodeDecodeError:
            continue
    return line.decode("latin-1")


def place_rows(
    path: Path, numbers: Floats, values: Floats, remarks: list[Remark]
) -> tuple[int, Floats]:
    """Put rows at their frame numbers; frames that the file leaves out are missing.

    Parameters
    ----------
    numbers : (N,) frame numbers as the file has them.
    values : (N, ...) one row per number.
    remarks : what is odd is appended.

    Returns
    -------
    first_frame, (T, ...) rows with NaN where a frame was left out

    Raises
    ------
    FileError
        If the numbers are not whole and rising, or span far more frames than rows.
    """
    if not np.isfinite(numbers).all() or np.any(numbers != np.round(numbers)):
        raise FileError(path, "a frame number is not a whole number")
    if np.any(np.abs(numbers) > 2**31):
        raise FileError(path, "a frame number is beyond any take's")
    steps = np.diff(numbers)
    if np.any(steps <= 0):
        row = int(np.flatnonzero(steps <= 0)[0]) + 1
        wrong = f"frame {numbers[row]:.0f} follows frame {numbers[row - 1]:.0f}"
        raise FileError(path, wrong, "frame numbers should rise")
    at = (numbers - numbers[0]).astype(np.int64)
    frames = int(at[-1]) + 1
    if frames == len(values):
        return int(numbers[0]), values
    if frames > _MOST_FRAMES_PER_ROW * len(values):
        wrong = f"{len(values)} rows are numbered over {frames} frames"
        raise FileError(path, wrong, "a take should have a row for most frames")
    left_out = frames - len(values)
    remarks.append(
        remark(
            "missing",
            f"{left_out} of {frames} frames are left out; they count as missing",
            count=left_out,
        )
    )
    placed = np.full((frames, *values.shape[1:]), np.nan)
    placed[at] = values
    return int(numbers[0]), placed


def check_labels(path: Path, labels: list[str]) -> None:
    """Refuse a take without markers or with two of one name.

    Raises
    ------
    FileError
    """
    if not labels:
        raise FileError(path, "has no markers")
    check_unique(path, "markers", [name for name in labels if not is_loose(name)])


def check_unique(path: Path, kind: str, names: list[str]) -> None:
    """Refuse names that stand twice.

    Raises
    ------
    FileError
    """
    name, count = next(iter(Counter(names).most_common(1)), ("", 0))
    if count > 1:
        right = "names should be unique"
        raise FileError(path, f"{count} {kind} are called '{name}'", right)


def is_loose(label: str) -> bool:
    """Whether a name stands for no marker in particular."""
    return any(re.search(pattern, label) for pattern in UNLABELLED)


def finite(rows: Floats) -> Bools:
    """(...) whether all numbers of each row are finite; rows are the last axis."""
    known = np.isfinite(rows)
    if rows.shape[-1] != 3:
        return np.array(known.all(axis=-1), dtype=bool)
    out: Bools = known[..., 0] & known[..., 1]
    out &= known[..., 2]
    return out


def sort_out(
    positions: Floats, labels: list[str], origin: Bytes | None = None
) -> tuple[Trajectories | None, Points | None]:
    """Part labelled markers from columns whose names stand for no marker.

    Parameters
    ----------
    positions : (T, M, 3) [m], NaN where missing; becomes the markers', where all
        columns are.
    labels : M column names.
    origin : (T, M) `Origin` of each sample; default: measured where finite.

    Returns
    -------
    markers, unlabelled : either may be None; ``source`` is the column.
    """
    unnamed = np.array([is_loose(label) for label in labels], dtype=bool)
    keep, loose = np.flatnonzero(~unnamed), np.flatnonzero(unnamed)
    seen = finite(positions)
    if origin is None:
        origin = np.where(seen, np.uint8(Origin.MEASURED), np.uint8(Origin.MISSING))
    markers = points = None
    if len(keep):
        columns = keep.astype(np.int32)
        which = keep if len(loose) else slice(None)
        clean, there = positions[:, which], seen[:, which]
        clean[~there] = np.nan
        markers = Trajectories(
            positions=clean,
            labels=tuple(labels[i] for i in keep),
            model=("",) * len(keep),
            origin=origin[:, which],
            source=np.where(there, columns, np.int32(-1)),
        )
    if len(loose):
        frame, column = np.nonzero(seen[:, loose])
        points = Points(
            frame=frame.astype(np.int32),
            source=loose[column].astype(np.int32),
            positions=positions[frame, loose[column]],
        )
    return markers, points
