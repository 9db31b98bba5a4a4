"""What every text writer needs: the columns of a take and fast rows of numbers."""

import errno
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bytes, Floats, expect_shape
from handclean.errors import FileError
from handclean.recording import Motion, Origin, Points, Recording
from handclean.remarks import Remark, remark

NO_TREE = "'solve' gives it one; angles alone go into .h5, .csv or .mot"
"""What to do where a format needs the bones that a motion moves."""


class Columns(NamedTuple):
    """The marker columns of a take.

    Attributes
    ----------
    labels : M names; points that no model explains are called ``*0``, ``*1`` ...
    positions : (T, M, 3) [m], NaN where missing or rejected.
    origin : (T, M) see `Origin`.
    remarks : what a table of positions cannot hold.
    """

    labels: tuple[str, ...]
    positions: Floats
    origin: Bytes
    remarks: tuple[Remark, ...]


def columns_of(path: Path, recording: Recording) -> Columns:
    """Return labelled and unlabelled points as named columns.

    Raises
    ------
    FileError
        If there is neither.
    """
    frames = recording.frames
    remarks: list[Remark] = []
    labels: tuple[str, ...] = ()
    positions, origin = np.zeros((frames, 0, 3)), np.zeros((frames, 0), np.uint8)
    if recording.markers is not None:
        labels = recording.markers.labels
        positions, origin = recording.markers.positions, recording.markers.origin
        rejected = origin == Origin.REJECTED
        if rejected.any():
            positions = np.where(rejected[:, :, None], np.nan, positions)
            remarks.append(
                remark(
                    "not-kept",
                    f"{rejected.sum()} rejected samples are written as missing",
                    samples=int(rejected.sum()),
                )
            )
    if recording.unlabelled is not None and len(recording.unlabelled.frame):
        loose = _loose_columns(recording.unlabelled, frames)
        labels += tuple(f"*{i}" for i in range(loose.shape[1]))
        positions = np.concatenate([positions, loose], axis=1)
        seen = np.isfinite(loose).all(axis=2).astype(np.uint8)
        origin = np.concatenate([origin, seen], axis=1)
    if not labels:
        raise FileError(path, "nothing to write: the take has no markers")
    return Columns(labels, positions, origin, tuple(remarks))


def _loose_columns(points: Points, frames: int) -> Floats:
    """(T, C, 3) unlabelled points: by source column if they have one, else in turn."""
    column = points.source.astype(np.int64)
    taken = points.frame * (column.max() + 1) + column
    if column.min() < 0 or len(np.unique(taken)) != len(taken):
        first = np.searchsorted(points.frame, points.frame)
        column = np.arange(len(column)) - first
    used, column = np.unique(column, return_inverse=True)
    table = np.full((frames, len(used), 3), np.nan)
    table[points.frame, column] = points.positions
    return table


def motions_of(path: Path, recording: Recording) -> Mapping[str, Motion]:
    """Return the take's motions.

    Raises
    ------
    FileError
        If it has none.
    """
    if not recording.motions:
        wrong = "nothing to write: the take has no joint angles"
        raise FileError(path, wrong, "solve it first")
    return recording.motions


def held_poses(poses: Floats) -> tuple[Floats, int]:
    """(T, 7 + D) poses with the last known one in place of NaN; how many were NaN.

    What is missing at the start takes the first known pose.
    """
    known = np.isfinite(poses).all(axis=1)
    if not known.any():
        return poses, len(poses)
    last = np.maximum.accumulate(np.where(known, np.arange(len(poses)), -1))
    last[last < 0] = np.argmax(known)
    return poses[last], int(np.count_nonzero(~known))


def rows(
    numbers: Floats, decimals: Sequence[int], delimiter: str, missing: str = ""
) -> Iterator[str]:
    """Yield one line per row of (N, C) numbers, with ``missing`` for NaN.

    Parameters
    ----------
    decimals : C digits after the decimal point.
    """
    expect_shape("numbers", numbers, "N", len(decimals))
    pattern = delimiter.join(f"%.{digits}f" for digits in decimals)
    whole = np.array(np.isfinite(numbers).all(axis=1))
    for row, clean in zip(numbers, whole, strict=True):
        line = pattern % tuple(row.tolist())
        yield line if clean else line.replace("nan", missing)


def write_lines(path: Path, lines: Iterable[str]) -> None:
    r"""Write lines of text, UTF-8 with ``\n``.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    try:
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.writelines(f"{line}\n" for line in lines)
    except OSError as error:
        raise unwritable(path, error) from None


def unwritable(path: Path | str, error: OSError) -> FileError:
    """Return the error to raise where a file cannot be written: one line, the reason.

    What libraries say beside the reason is left out; a folder that is missing, or lets
    nobody write, is named.
    """
    folder = Path(path).parent
    if not folder.is_dir():
        return FileError(path, f"cannot be written: there is no folder {folder}")
    reason = os.strerror(error.errno) if error.errno else str(error)
    reason = (reason.splitlines() or ["unknown reason"])[0]
    right = ""
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT):
        right = f"is the folder {folder} one that may be written to?"
    return FileError(path, f"cannot be written: {reason.lower()}", right)
