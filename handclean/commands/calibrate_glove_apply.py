"""Joint angles from a glove's readings, a chunk at a time."""

import tempfile
import weakref
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.commands.shared import glove_files
from handclean.commands.shared.choices import GloveApplying
from handclean.errors import FileError, HandcleanError, UsageError
from handclean.glove import readings as checks
from handclean.glove.calibration import (
    Calibration,
    foreign,
    predict_measured,
    sure,
    to_hinges,
)
from handclean.glove.hands import fingertips
from handclean.glove.smooth import smoothed_chunks
from handclean.hand.model import marker_positions
from handclean.io import files
from handclean.io.glove.angles import with_motion, write_long
from handclean.io.glove.readings_file import ReadingsFile
from handclean.recording import Recording
from handclean.remarks import texts
from handclean.runner import progress
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome
from handclean.tree import POSE_HEAD, JointTree

FIGURES = {
    "glove": "its name",
    "frames": "frames of the stream",
    "rate_hz": "frames per second",
    "trusted": "share of frames in which every measured rotation is sure enough",
    "missing": "share of frames without all the readings that are needed",
    "saturated": "share of frames in which a sensor is at the end of its converter",
    "sigma_deg": "mean sigma of the measured rotations [degrees]",
}

_OFTEN = 0.2
"""Share of frames in which an unsure rotation is worth a word."""

_UNEVEN = 0.1
"""Share of a frame by which times may be off an even rate."""


class _Scratch:
    """Arrays that grow on a disk, in files that are gone with the process."""

    def __init__(self, widths: dict[str, int]) -> None:
        self._widths = widths
        self._open = {
            name: tempfile.TemporaryFile(prefix="handclean-")  # noqa: SIM115
            for name in widths
        }
        weakref.finalize(self, _close, self._open)

    def add(self, **parts: Floats) -> None:
        for name, values in parts.items():
            self._open[name].write(np.ascontiguousarray(values, dtype=np.float64).data)

    def arrays(self, frames: int) -> dict[str, Floats]:
        out: dict[str, Floats] = {}
        for name, file in self._open.items():
            file.flush()
            shape = (frames, self._widths[name])
            out[name] = np.memmap(file, dtype=np.float64, mode="r", shape=shape)
            file.close()
        return out


def _close(files: dict[str, Any]) -> None:
    for file in files.values():
        file.close()


def calibrate_glove_apply(source: Source, settings: GloveApplying) -> Outcome:
    """Turn readings into joint angles with sigma."""
    given = source.files.get("calibration")
    if given is None:
        raise UsageError(
            "--calibration: is missing; 'handclean calibrate-glove fit' makes one"
        )
    calibration = glove_files.read_calibration(given)
    glove = calibration.glove
    tree, subject = glove_files.tree_of(source, glove)
    found, places = glove_files.opened(source, glove)
    scratch = _Scratch(
        {
            "angles": len(tree.hinges),
            "sigma": len(tree.hinges),
            "trusted": 1,
            "tips": 15,
        }
    )
    tally = _Tally(calibration)
    chunks = (
        (times, checks.arranged(values, places))
        for times, values in found.chunks(settings.apply.chunk)
    )
    cutoff = settings.apply.cutoff_hz
    stream = smoothed_chunks(chunks, cutoff, partial(checks.saturated, glove))
    for times, readings, smooth in stream:
        far = tally.see(times, readings)
        mean, variance = predict_measured(calibration, smooth)
        angles, sigma = to_hinges(glove, tree.hinges, mean, variance)
        trusted = sure(calibration, variance, np.radians(settings.apply.max_sigma_deg))
        good = checks.usable(glove, readings)
        trusted &= good & ~far & np.isfinite(angles).all(axis=1)
        tally.add(variance, trusted, good, settings.apply.max_sigma_deg)
        scratch.add(
            angles=angles, sigma=sigma, trusted=trusted[:, None].astype(np.float64)
        )
        if settings.tips:
            scratch.add(tips=_tips(tree, angles))
        progress.tell(f"{tally.frames} frames of {source.path.name}")
    progress.done()
    return _outcome(source, settings, calibration, found, tree, subject, scratch, tally)


class _Tally:
    """What is counted while a stream goes by."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self.watch = checks.Watch(calibration.glove)
        self.frames = self.trusted = self.missing = 0
        self.first = self.last = self.uneven = 0.0
        self.sum, self.count = 0.0, 0
        self.step = 0.0
        self.foreign: Any = 0
        self.unsure: Any = 0

    def see(self, times: Floats, readings: Floats) -> Bools:
        """Count a chunk; return (t,) frames that are foreign to the samples."""
        if self.frames == 0:
            self.first = float(times[0])
            self.step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
        self.watch.see(readings)
        far = foreign(self._calibration, readings)
        self.foreign = self.foreign + far.sum(axis=0)
        if self.step > 0.0:
            even = self.first + (self.frames + np.arange(len(times))) * self.step
            off = np.abs(np.diff(times - even)).max() if len(times) > 1 else 0.0
            self.uneven = max(self.uneven, float(off) / self.step)
        self.last = float(times[-1])
        self.frames += len(times)
        return np.asarray(far.any(axis=1))

    def add(self, variance: Floats, trusted: Any, good: Any, most: float) -> None:
        self.trusted += int(trusted.sum())
        self.missing += int((~np.asarray(good)).sum())
        self.unsure = self.unsure + (variance > np.radians(most) ** 2).sum(axis=0)
        known = np.isfinite(variance)
        self.sum += float(np.sqrt(variance[known]).sum())
        self.count += int(known.sum())


def _tips(tree: JointTree, angles: Floats) -> Floats:
    """(t, 15) [m] the fingertips in the hand's frame."""
    poses = np.zeros((len(angles), POSE_HEAD + angles.shape[1]))
    poses[:, 3] = 1.0
    poses[:, POSE_HEAD:] = angles
    out: Floats = marker_positions(fingertips(tree), poses).reshape(len(angles), 15)
    return out


def _outcome(
    source: Source,
    settings: GloveApplying,
    calibration: Calibration,
    found: ReadingsFile,
    tree: JointTree,
    subject: Any,
    scratch: _Scratch,
    tally: _Tally,
) -> Outcome:
    frames = tally.frames
    if frames < 2 and not found.rate > 0.0:
        raise FileError(source.path, "has one frame", "two at least tell the rate")
    rate = found.rate
    if not rate > 0.0:
        rate = (frames - 1) / (tally.last - tally.first)
    name = tree.side or "right"
    arrays = scratch.arrays(frames) if settings.tips else _without_tips(scratch, frames)
    motion: dict[str, Any] = {
        "angles": (arrays["angles"], "rad"),
        "angles_sigma": (arrays["sigma"], "rad"),
        "trusted": (np.asarray(arrays["trusted"][:, 0]) > 0.5, ""),
    }
    tips = None
    if settings.tips:
        labels = fingertips(tree).labels
        tips = (labels, arrays["tips"].reshape(frames, 5, 3))
    take = Recording(
        rate=float(rate),
        frames=frames,
        start_time=tally.first,
        up_axis="+z",
        skeletons={name: tree},
    )

    def write(path: Path, provenance: tuple[Entry, ...]) -> tuple[str, ...]:
        made = replace(take, provenance=provenance)
        if path.suffix.lower() == ".h5":
            write_long(path, made, name, tree.hinges, motion, tips)
            return ()
        whole = with_motion(made, name, tree.hinges, motion, tips)
        surface = getattr(subject, "surface", None)
        surfaces = {} if surface is None else {name: surface}
        return texts(files.write(path, whole, surfaces=surfaces))

    sigma = np.degrees(tally.sum / tally.count) if tally.count else np.nan
    figures = {
        "glove": calibration.glove.name,
        "frames": frames,
        "rate_hz": float(rate),
        "trusted": tally.trusted / frames,
        "missing": tally.missing / frames,
        "saturated": tally.watch.stuck / frames,
        "sigma_deg": float(sigma),
    }
    if not tally.count:
        raise HandcleanError("in no frame do all sensors read", where=source.path)
    return Outcome(
        line=f"{frames} frames, {100 * tally.trusted / frames:.0f} % trusted, "
        f"sigma {sigma:.1f} degrees",
        figures=figures,
        warnings=_warnings(calibration, tally, subject),
        writers=(write,),
    )


def _without_tips(scratch: _Scratch, frames: int) -> dict[str, Floats]:
    scratch._widths.pop("tips")
    scratch._open.pop("tips").close()
    return scratch.arrays(frames)


def _warnings(calibration: Calibration, tally: _Tally, subject: Any) -> tuple[str, ...]:
    told = list(tally.watch.remarks())
    far = np.asarray(tally.foreign) / max(tally.frames, 1)
    if (far > _OFTEN).any():
        sensors = calibration.glove.sensors
        names = ", ".join(sensors[k] for k in np.flatnonzero(far > _OFTEN))
        told.append(
            f"{names} read far outside what was calibrated, in up to "
            f"{100 * far.max():.0f} % of frames, which are not trusted: another glove, "
            "or another wearer?"
        )
    if tally.uneven > _UNEVEN:
        told.append(
            f"times are up to {tally.uneven:.2g} frames off an even rate; angles are "
            "written frame by frame at the mean rate"
        )
    lost = {row.rotation for row in calibration.glove.measured}
    lost -= {one.rotation for one in calibration.fits}
    if lost:
        told.append(f"{', '.join(sorted(lost))} are not calibrated and stay at zero")
    order = [row.rotation for row in calibration.glove.measured]
    shares = np.broadcast_to(tally.unsure / max(tally.frames, 1), len(order))
    often = [k for k in np.argsort(-shares, kind="stable") if shares[k] > _OFTEN]
    if often:
        told.append(
            f"{', '.join(order[k] for k in often)} are too unsure to be trusted in up "
            f"to {100 * shares[often[0]]:.0f} % of frames; samples of them at more "
            "angles would help"
        )
    worn_by = getattr(subject, "name", "")
    if calibration.use != "fk" and worn_by and calibration.subject not in ("", worn_by):
        told.append(
            f"the calibration has IK samples of {calibration.subject}, the subject is "
            f"{worn_by}: those hold for one wearer only"
        )
    return tuple(told)
