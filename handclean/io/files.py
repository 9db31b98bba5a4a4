"""One door to all formats: read, write and inspect by suffix.

What a reader found odd (see `handclean.io.shared.reading`) becomes an event over the
whole take, so that it stays with the take through every later step.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bools
from handclean.errors import FileError, HandcleanError, UnsaidError, UsageError
from handclean.hand.surface import Surface
from handclean.io.bvh.angles import read_bvh_angles
from handclean.io.bvh.motion import write_bvh
from handclean.io.c3d.read import inspect_c3d, read_c3d, write_c3d
from handclean.io.glove.inspect import inspect_readings, is_readings, may_be_readings
from handclean.io.gltf.write import write_glb
from handclean.io.hdf5 import seal
from handclean.io.hdf5.file import format_of, read_h5
from handclean.io.hdf5.session import FORMAT, read_session, write_session
from handclean.io.hdf5.subject import FORMAT as SUBJECT
from handclean.io.hdf5.subject import inspect_subject
from handclean.io.keeps import lost
from handclean.io.mesh.meshes import SUFFIXES as MESHES
from handclean.io.oddities import odd
from handclean.io.shapes import inspect_glb, inspect_mesh
from handclean.io.shared.reading import (
    METRES,
    Reading,
    finite,
    settle_rate,
    settle_unit,
)
from handclean.io.shared.rescale import rescaled
from handclean.io.text.csv_read import read_csv
from handclean.io.text.csv_write import write_csv
from handclean.io.text.mot import inspect_mot, write_mot
from handclean.io.text.qualisys import read_tsv
from handclean.io.text.trc_read import read_trc
from handclean.io.text.trc_write import write_trc
from handclean.recording import Event, Motion, Recording, Trajectories

Reader = Callable[[Path, float | None, str | None, bool], Reading]
Writer = Callable[[Path, Recording], tuple[str, ...] | None]


def _c3d(
    path: Path,
    rate_hz: float | None,
    unit: str | None,
    lenient: bool,
    believe_coordinates: bool = False,
) -> Reading:
    take = read_c3d(
        path,
        lenient=lenient,
        unit=unit,
        rate=rate_hz,
        believe_coordinates=believe_coordinates,
    )
    return Reading(recording=take, unit=str(take.parameters["c3d"]["unit"]))


def _h5(path: Path, rate_hz: float | None, unit: str | None, lenient: bool) -> Reading:
    take = read_session(path)
    settle_rate(path, take.rate, rate_hz)
    traps: list[str] = []
    length = settle_unit(path, "m", unit, traps)
    if traps:
        take = rescaled(take, METRES[length.lower()])
    return Reading(recording=take, unit=length, traps=tuple(traps))


def _text(read: Callable[..., Reading]) -> Reader:
    def reader(
        path: Path, rate_hz: float | None, unit: str | None, lenient: bool
    ) -> Reading:
        return read(path, rate_hz=rate_hz, unit=unit, lenient=lenient)

    return reader


READERS: dict[str, Reader] = {
    ".c3d": _c3d,
    ".h5": _h5,
    ".trc": _text(read_trc),
    ".csv": _text(read_csv),
    ".tsv": _text(read_tsv),
    ".bvh": _text(read_bvh_angles),
}

_GLOVE = "if a glove's sensors read this, calibrate-glove takes it with --glove"

WRITERS: dict[str, Writer] = {
    ".c3d": write_c3d,
    ".h5": write_session,
    ".trc": write_trc,
    ".csv": write_csv,
    ".mot": write_mot,
    ".bvh": write_bvh,
    ".glb": write_glb,
}


def _reading(
    path: Path,
    rate_hz: float | None,
    unit: str | None,
    lenient: bool,
    believe_coordinates: bool = False,
) -> Reading:
    suffix = path.suffix.lower()
    if suffix not in READERS:
        known = " ".join(READERS)
        if suffix == ".glb":
            right = "convert makes a subject of a skinned hand"
            raise FileError(path, ".glb files are not read as takes", right)
        if suffix in MESHES:
            right = "calibrate-hand scan makes a subject of a scan"
            raise FileError(path, "is a mesh, not a take", right)
        if suffix in WRITERS:
            wrong = f"{suffix} files are written for other programs, not read"
            raise FileError(path, wrong, f"readable: {known}")
        raise FileError(path, f"no format is called '{suffix}'", f"readable: {known}")
    if suffix == ".c3d":
        return _c3d(path, rate_hz, unit, lenient, believe_coordinates)
    return READERS[suffix](path, rate_hz, unit, lenient)


def read(
    path: Path | str,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
    believe_coordinates: bool = False,
) -> Recording:
    """Read a take of any format.

    Parameters
    ----------
    rate_hz : [Hz] for formats that do not say (``--rate``).
    unit : of lengths, mm, cm or m, for formats that do not say (``--unit``); it is
        taken where the file says another, and an event says so.
    lenient : save what can be saved of a file that was cut off.
    believe_coordinates : of a C3D that marks every point as missing.

    Raises
    ------
    FileError
        If the file cannot be read as what its suffix says.
    UsageError
        If rate or unit are needed and not given, or the rate contradicts the file by
        more than 0.1 %.
    """
    with seal.tolerated(lenient) as broken:
        reading = _reading(Path(path), rate_hz, unit, lenient, believe_coordinates)
    take = reading.recording
    traps = (*broken, *reading.traps)
    noted = tuple(Event(start=0, stop=take.frames, text=trap) for trap in traps)
    return replace(take, events=(*take.events, *noted)) if noted else take


def write(
    path: Path | str,
    recording: Recording,
    *,
    suffix: str = "",
    surfaces: Mapping[str, Surface] | None = None,
    unnamed: bool = False,
) -> tuple[str, ...]:
    """Write a take to exactly this path.

    Parameters
    ----------
    surfaces : skins of hands by the name of their motion, for a format that shows them
        (``.glb``); the template's for the others.
    suffix : the format, such as ``.c3d``; default: the path's. A caller that writes to
        a temporary name and renames it says the format here.
    unnamed : write points without a name into a TRC, too.

    Returns
    -------
    what the format cannot hold or how it was met, one line each

    Raises
    ------
    FileError
        If there is nothing of what the format holds, or the file cannot be written.
    """
    path = Path(path)
    wanted = check_suffix(path, suffix)
    if wanted == ".glb":
        notes = write_glb(path, recording, surfaces=surfaces)
    elif wanted == ".trc":
        notes = write_trc(path, recording, unnamed=unnamed)
    else:
        notes = WRITERS[wanted](path, recording) or ()
    return (*lost(recording, wanted, unnamed=unnamed), *notes)


def check_suffix(path: Path | str, suffix: str = "") -> str:
    """Return the format in which ``path`` would be written, as ``.c3d`` or the like.

    Raises
    ------
    UsageError
        If there is no such format.
    """
    wanted = "." + (suffix or Path(path).suffix).lower().removeprefix(".")
    if wanted not in WRITERS:
        known = " ".join(WRITERS)
        raise UsageError(
            f"no format is called '{wanted}'; writable: {known}", where=path
        )
    return wanted


def inspect(
    path: Path | str,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    believe_coordinates: bool = False,
) -> dict[str, Any]:
    """Return what is in a file and what is odd about it, as plain JSON values.

    A file that is cut off or does not say its rate or unit is read as far as it goes;
    that is a trap here, not an error.

    Raises
    ------
    FileError
        If the file cannot be read at all.
    UsageError
        If an option contradicts it.
    """
    with seal.tolerated(True) as broken:
        about = _inspect(Path(path), rate_hz, unit, believe_coordinates)
    return {**about, "traps": [*broken, *about["traps"]]} if broken else about


def _inspect(
    path: Path, rate_hz: float | None, unit: str | None, believe_coordinates: bool
) -> dict[str, Any]:
    suffix = path.suffix.lower()
    if suffix in (".csv", ".h5") and is_readings(path):
        return inspect_readings(path, rate_hz)
    if suffix == ".h5" and (name := format_of(path)) != FORMAT:
        return _inspect_h5(path, name)
    if suffix == ".c3d":
        return _inspect_c3d(path, rate_hz, unit, believe_coordinates)
    if suffix == ".mot":
        return inspect_mot(path)
    if suffix == ".glb":
        return inspect_glb(path)
    if suffix in MESHES:
        return inspect_mesh(path, unit=unit)
    try:
        reading, unsaid = _as_far_as_said(path, rate_hz, unit)
    except FileError as error:
        if suffix == ".csv" and may_be_readings(path):
            raise error.with_hint(_GLOVE) from None
        raise
    about = {
        "format": suffix.removeprefix("."),
        **_about(reading.recording),
        "unit": reading.unit,
        "traps": [*reading.traps, *unsaid, *odd(reading.recording)],
    }
    for key, option in (("rate", "--rate"), ("unit", "--unit")):
        if any(option in line for line in unsaid):
            about[key] = None
    if about["rate"] is None:
        about["duration_s"] = None
    return about


def _inspect_h5(path: Path, name: str) -> dict[str, Any]:
    """Return what is in an HDF5 file of ours that is no session."""
    traps = []
    if name == SUBJECT:
        try:
            return inspect_subject(path)
        except HandcleanError as error:
            traps.append(error.wrong)
    part = read_h5(path, name, version=2**31)
    about = {"format": name, **dict(part.attrs), "parts": sorted(part.items)}
    return {**about, "traps": traps}


def _as_far_as_said(
    path: Path, rate_hz: float | None, unit: str | None
) -> tuple[Reading, list[str]]:
    """Read a file with stand-ins for what it does not say; and say so."""
    unsaid: list[str] = []
    for _ in range(3):
        try:
            return _reading(path, rate_hz, unit, True), unsaid
        except UnsaidError as error:
            rate_hz = 1.0 if "--rate" in error.option else rate_hz
            unit = "m" if "--unit" in error.option else unit
            unsaid.append(error.wrong)
    raise FileError(path, "; ".join(unsaid))


def _inspect_c3d(
    path: Path, rate_hz: float | None, unit: str | None, believe: bool
) -> dict[str, Any]:
    about = inspect_c3d(path, unit=unit, believe_coordinates=believe)
    try:
        take = _reading(path, rate_hz, unit, True, believe).recording
    except UsageError:
        raise
    except HandcleanError:
        return about
    return {**_about(take), **about, "traps": [*about["traps"], *odd(take)]}


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
