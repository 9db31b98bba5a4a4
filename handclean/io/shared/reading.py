"""What every reader needs: the bytes, remarks on them, the rate and the unit.

A reader remarks on what is odd about a file that is read all the same and that its
owner should know: a wrong count, frames left out, trajectories that are part filled.
"""

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bools, Bytes, Floats
from handclean.errors import FileError, UnsaidError, UsageError
from handclean.recording import Origin, Points, Recording, Trajectories
from handclean.remarks import Remark, remark

METRES = {
    "m": 1.0,
    "meter": 1.0,
    "meters": 1.0,
    "metre": 1.0,
    "metres": 1.0,
    "dm": 0.1,
    "decimeter": 0.1,
    "decimeters": 0.1,
    "decimetre": 0.1,
    "decimetres": 0.1,
    "cm": 1e-2,
    "centimeter": 1e-2,
    "centimetre": 1e-2,
    "centimeters": 1e-2,
    "centimetres": 1e-2,
    "mm": 1e-3,
    "millimeter": 1e-3,
    "millimeters": 1e-3,
    "millimetre": 1e-3,
    "millimetres": 1e-3,
    "um": 1e-6,
    "micrometer": 1e-6,
    "micrometers": 1e-6,
    "micrometre": 1e-6,
    "micrometres": 1e-6,
}
"""Metres per unit of length, by the names that files use."""

_SHORT = {METRES[name]: name for name in ("m", "dm", "cm", "mm", "um")}
_BEGIN = 2**12
"""[bytes] that are looked at first, to tell whether a file is blank."""

_CUT = 3
"""Letters that a name which was cut off must have."""

AGREE = 1e-3
"""Options and files agree when they differ by no more than this share."""

UNLABELLED = (r"^\*\d+$", r"^[CU]_\d+$", r"(?i)^unlabel", r"^$")
"""Regular expressions (searched) of names that stand for no marker in particular."""

_SPARSE = 4
"""A take may have this many times more frames than rows."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """A recording as one file gave it.

    Attributes
    ----------
    recording : the take.
    unit : the file's unit of length, as the file or the option calls it.
    remarks : what was odd.
    """

    recording: Recording
    unit: str
    remarks: tuple[Remark, ...] = ()


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


def load(path: Path) -> bytes:
    """Return the bytes of a file that is there, is a file and is not empty.

    Raises
    ------
    FileError
        If it is not.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise FileError(path, "no such file") from None
    except IsADirectoryError:
        raise FileError(path, "is a directory", "give a file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(path, f"cannot be read ({reason})") from None
    blank = b"\0 \t\r\n"
    if not content[:_BEGIN].strip(blank) and not content.strip(blank):
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
    if b"\0" in content:
        raise FileError(path, "is not text: it holds zero bytes")
    content = content.rstrip(b"\x1a")  # the end of a file, for DOS
    return content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


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


def positive(path: Path, name: str, value: str) -> float:
    """Return a rate or the like that a file states.

    Raises
    ------
    FileError
        If it is not a number above zero.
    """
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not 1e-9 < number < 1e9:
        right = "it should be a number above 0"
        raise FileError(path, f"{name} is '{value[:20]}'", right)
    return number


def settle_rate(path: Path, stated: float | None, option: float | None) -> float:
    """[Hz] the rate of a file, from itself or else from ``--rate``.

    Raises
    ------
    UsageError
        If neither says, or they differ by more than 0.1 %.
    """
    if option is not None and not (math.isfinite(option) and option > 0):
        raise UsageError(f"--rate should be a number of Hz above 0, not {option}")
    if stated is None:
        if option is None:
            wrong = "does not say its rate; give --rate HZ"
            raise UnsaidError(path, wrong, "--rate")
        return float(option)
    if option is not None and abs(option - stated) > AGREE * stated:
        raise UsageError(f"--rate {option:g} contradicts its {stated:g} Hz", where=path)
    return float(stated)


def ask_for(path: Path, *, rate: bool, unit: bool) -> None:
    """Ask for the rate, the unit, or both at once, where a file does not say.

    Raises
    ------
    UnsaidError
        If one of them is wanted.
    """
    what = " nor ".join(w for w, it in (("rate", rate), ("unit", unit)) if it)
    wanted = (("--rate", " HZ", rate), ("--unit", " mm|cm|m", unit))
    options = [option for option, _, it in wanted if it]
    if give := " and ".join(f"give {o}{value}" for o, value, it in wanted if it):
        raise UnsaidError(path, f"does not say its {what}; {give}", *options)


def named_unit(name: str) -> str | None:
    """Return the unit that a name stands for, None where it stands for none.

    A name that was cut off, as fields of fixed width cut it (``mete``, ``mill``), is
    read as what it begins, if that is one unit.
    """
    name = name.strip()
    if name.lower() in METRES:
        return name
    begun = {
        metres
        for whole, metres in METRES.items()
        if len(name) >= _CUT and whole.startswith(name.lower())
    }
    return _SHORT[begun.pop()] if len(begun) == 1 else None


def settle_unit(
    path: Path, stated: str | None, option: str | None, remarks: list[Remark]
) -> str:
    """Return the unit of length of a file, from ``--unit`` or else from itself.

    Parameters
    ----------
    remarks : where the option contradicts the file, that is appended.

    Raises
    ------
    UsageError
        If neither says.
    FileError
        If the file's unit is not known, and there is no option.
    """
    if option is not None and option.lower() not in METRES:
        raise UsageError(f"--unit should be mm, cm or m, not '{option}'")
    if stated is None:
        if option is None:
            wrong = "does not say its unit; give --unit mm|cm|m"
            raise UnsaidError(path, wrong, "--unit")
        return option
    known = named_unit(stated)
    if known is None and option is None:
        right = "it should be one of mm, cm, dm, m (--unit says which)"
        raise FileError(path, f"the unit of length is '{stated}'", right)
    if known is None or (
        option is not None and METRES[option.lower()] != METRES[known.lower()]
    ):
        assert option is not None
        remarks.append(overruled(option, stated))
        return option
    return known


def overruled(option: str, stated: str) -> Remark:
    """Say that ``--unit`` is taken and not what a file says."""
    text = f"--unit {option} is taken, though the file says {stated[:40]}"
    return remark("unit", text, taken=option, overruled=stated[:40])


def in_metres(values: Floats, unit: str) -> Floats:
    """Convert lengths; dividing by a whole number keeps decimal digits exact."""
    scale = METRES[unit.lower()]
    return values / round(1 / scale) if scale < 1 else values * scale


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
    if frames > _SPARSE * len(values):
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
    return np.array(np.isfinite(rows).all(axis=-1), dtype=bool)


def sort_out(
    positions: Floats, labels: list[str], origin: Bytes | None = None
) -> tuple[Trajectories | None, Points | None]:
    """Part labelled markers from columns whose names stand for no marker.

    Parameters
    ----------
    positions : (T, M, 3) [m], NaN where missing.
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
        clean = positions[:, keep]
        clean[~seen[:, keep]] = np.nan
        markers = Trajectories(
            positions=clean,
            labels=tuple(labels[i] for i in keep),
            model=("",) * len(keep),
            origin=origin[:, keep],
            source=np.where(seen[:, keep], columns, np.int32(-1)),
        )
    if len(loose):
        frame, column = np.nonzero(seen[:, loose])
        points = Points(
            frame=frame.astype(np.int32),
            source=loose[column].astype(np.int32),
            positions=positions[frame, loose[column]],
        )
    return markers, points
