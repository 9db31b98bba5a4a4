"""What is in a take's file, and what is odd about it, as plain JSON values."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from handclean.arrays import Bools
from handclean.errors import FileError, HandcleanError, UnsaidError, UsageError
from handclean.io.c3d.inspect import inspect_c3d
from handclean.io.c3d.read import read_c3d_take
from handclean.io.glove.inspect import inspect_readings, is_readings, may_be_readings
from handclean.io.hdf5.file import format_of, read_h5
from handclean.io.hdf5.session import FORMAT
from handclean.io.shared.reading import Reading, finite, reported, with_remarks
from handclean.io.take_remarks import remarks_on_samples
from handclean.io.takes import reading_of
from handclean.recording import Motion, Recording, Trajectories
from handclean.remarks import Remark, remark, texts

_GLOVE = "if a glove's sensors read this, calibrate-glove takes it with --glove"


def inspect_take(
    path: Path, *, rate_hz: float | None = None, unit: str | None = None
) -> dict[str, Any]:
    """Return what is in a file that its format's reader reads as a take.

    Raises
    ------
    FileError, UsageError
        If it cannot be read, or the options contradict it.
    """
    suffix = path.suffix.lower()
    found = _as_far_as_said(path, rate_hz, unit)
    reading = found.reading
    about = {
        "format": suffix.removeprefix("."),
        **_about(reading.recording),
        "unit": reading.unit,
        **reading.told,
        **reported(
            (*reading.remarks, *found.remarks, *remarks_on_samples(reading.recording))
        ),
    }
    unknown = {"--rate": ("rate", "duration_s"), "--unit": ("unit",)}
    blank = [key for option in found.unsaid for key in unknown[option]]
    return about | dict.fromkeys(blank)


def inspect_csv(
    path: Path, *, rate_hz: float | None = None, unit: str | None = None
) -> dict[str, Any]:
    """Return what is in a CSV of markers, or of a glove's readings.

    Raises
    ------
    FileError, UsageError
        If it cannot be read, or the options contradict it.
    """
    if is_readings(path):
        return inspect_readings(path, rate_hz)
    try:
        return inspect_take(path, rate_hz=rate_hz, unit=unit)
    except FileError as error:
        if may_be_readings(path):
            raise error.with_hint(_GLOVE) from None
        raise


def inspect_h5(
    path: Path, *, rate_hz: float | None = None, unit: str | None = None
) -> dict[str, Any]:
    """Return what is in an HDF5 file: a session, glove readings, or others of ours.

    Raises
    ------
    FileError, UsageError
        If it cannot be read, or the options contradict it.
    """
    if is_readings(path):
        return inspect_readings(path, rate_hz)
    name = format_of(path)
    if name == FORMAT:
        return inspect_take(path, rate_hz=rate_hz, unit=unit)
    return _inspect_other_h5(path, name)


def _inspect_other_h5(path: Path, name: str) -> dict[str, Any]:
    """Return what is in an HDF5 file of ours that is no session."""
    from handclean.io.hdf5 import subject  # late: it brings numba, 0.2 s

    remarks = []
    if name == subject.FORMAT:
        try:
            return subject.inspect_subject(path)
        except HandcleanError as error:
            remarks.append(remark("damage", error.wrong))
    part = read_h5(path, name, version=2**31)
    about = {"format": name, **dict(part.attrs), "parts": sorted(part.items)}
    return {**about, **reported(remarks)}


class _AsFarAsSaid(NamedTuple):
    """A reading, the options that would say what the file does not, and remarks."""

    reading: Reading
    unsaid: tuple[str, ...]
    remarks: tuple[Remark, ...]


def _as_far_as_said(
    path: Path, rate_hz: float | None, unit: str | None
) -> _AsFarAsSaid:
    """Read a file with stand-ins for what it does not say; and say so."""
    unsaid: list[str] = []
    remarks: list[Remark] = []
    for _ in range(3):
        try:
            given = {"rate_hz": rate_hz, "unit": unit, "lenient": True}
            reading = reading_of(path, given)
            return _AsFarAsSaid(reading, tuple(unsaid), tuple(remarks))
        except UnsaidError as error:
            rate_hz = 1.0 if "--rate" in error.options else rate_hz
            unit = "m" if "--unit" in error.options else unit
            unsaid += error.options
            kind = "unit" if error.options == ("--unit",) else "time"
            remarks.append(remark(kind, error.wrong, options=list(error.options)))
    raise FileError(path, "; ".join(texts(remarks)))


def inspect_c3d_take(
    path: Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    believe_coordinates: bool = False,
) -> dict[str, Any]:
    """Return what is in a C3D file, and of its take what any format has.

    Raises
    ------
    FileError, UsageError
        If it is no C3D, or the options contradict it.
    """
    about = inspect_c3d(path, unit=unit, believe_coordinates=believe_coordinates)
    try:
        take = read_c3d_take(
            path,
            rate_hz=rate_hz,
            unit=unit,
            lenient=True,
            believe_coordinates=believe_coordinates,
        ).recording
    except UsageError:
        raise
    except HandcleanError:
        return about
    return with_remarks({**_about(take), **about}, (), remarks_on_samples(take))


def _about(take: Recording) -> dict[str, Any]:
    """Return what a take holds, in numbers."""
    about: dict[str, Any] = {
        "frames": take.frames,
        "first_frame": take.first_frame,
        "start_time_s": take.start_time,
        "rate": take.rate,
        "duration_s": take.frames / take.rate,
        "up_axis": take.up_axis,
        "markers": [],
    }
    if take.markers is not None:
        about |= _about_markers(take.markers)
    about["unlabelled_points"] = 0
    if take.unlabelled is not None:
        per_frame = np.bincount(take.unlabelled.frame, minlength=take.frames)
        about["unlabelled_points"] = len(take.unlabelled.frame)
        about["most_unlabelled_in_a_frame"] = int(per_frame.max())
    about["motions"] = {
        name: {
            "hinges": list(motion.names),
            "root": motion.translation is not None,
            "missing_frames": int(np.count_nonzero(~finite(motion.poses))),
            "trusted_frames": _trusted(motion),
        }
        for name, motion in take.motions.items()
    }
    about["skeletons"] = {
        name: {"kind": tree.kind, "side": tree.side, "subject": tree.subject}
        for name, tree in take.skeletons.items()
    }
    about["analog"] = [] if take.analog is None else list(take.analog.labels)
    about["events"] = [e.text for e in take.events[:100]]
    about["steps"] = [str(e.get("command", "?")) for e in take.provenance]
    return about


def _trusted(motion: Motion) -> int | None:
    """Frames that are trusted, None where the file does not say."""
    return None if motion.trusted is None else int(np.count_nonzero(motion.trusted))


def _about_markers(markers: Trajectories) -> dict[str, Any]:
    seen = finite(markers.positions)
    lengths, ends = gaps_of(seen)
    there: dict[str, Bools] = {}
    for label, column in zip(markers.labels, seen.T, strict=True):
        there[label] = there[label] | column if label in there else column
    kinds = ("missing", "measured", "filled", "rejected", "smoothed")
    counts = np.bincount(markers.origin.ravel(), minlength=len(kinds))
    return {
        "markers": list(there),
        "missing": {x: round(1.0 - float(s.mean()), 6) for x, s in there.items()},
        "samples": dict(zip(kinds, counts.tolist(), strict=False)),
        "gaps": len(lengths),
        "longest_gap_frames": max(lengths, default=0),
        "median_gap_frames": float(np.median(lengths)) if lengths else 0.0,
        "open_ends": ends,
    }


def gaps_of(seen: Bools) -> tuple[list[int], int]:
    """Return the lengths [frames] of the gaps of (T, M) samples, and the open ends.

    A gap has a sample before and after; an open end is missing to the take's edge. A
    marker that is never seen has no gap and two open ends.
    """
    lengths: list[int] = []
    ends = 0
    for column in seen.T:
        at = np.flatnonzero(column)
        if not len(at):
            ends += 2
            continue
        steps = np.diff(at)
        lengths += (steps[steps > 1] - 1).tolist()
        ends += int(at[0] > 0) + int(at[-1] < len(column) - 1)
    return lengths, ends
