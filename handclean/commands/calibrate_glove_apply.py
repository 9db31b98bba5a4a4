"""Joint angles from a glove's readings, a chunk at a time."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from handclean.api import glove_files
from handclean.arrays import Bools, Floats
from handclean.commands.shared import glove_sources
from handclean.commands.shared.choices import GloveApplying
from handclean.commands.shared.scratch import Scratch
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
from handclean.hand.subject import Subject
from handclean.io import files
from handclean.io.glove.angles import with_motion, write_long
from handclean.io.glove.readings_file import ReadingsFile
from handclean.recording import Recording
from handclean.remarks import Remark, remark
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

_OFTEN_SHARE = 0.2
"""[-] share of frames in which an unsure rotation is worth a warning (chosen)."""

_MOST_UNEVEN_FRAMES = 0.1
"""[frames] by which times may be off an even rate (chosen)."""

_FINGERTIPS = 5
"""Fingertips of a hand."""


def calibrate_glove_apply(source: Source, settings: GloveApplying) -> Outcome:
    """Turn readings into joint angles with sigma."""
    given = source.files.get("calibration")
    if given is None:
        raise UsageError(
            "--calibration: is missing; 'handclean calibrate-glove fit' makes one"
        )
    calibration = glove_files.read_calibration(given)
    tree, subject = glove_sources.tree_of(source, calibration.glove)
    found, places = glove_sources.opened(source, calibration.glove)
    widths = {"angles": len(tree.hinges), "sigma": len(tree.hinges), "trusted": 1}
    scratch = Scratch(widths | ({"tips": 3 * _FINGERTIPS} if settings.tips else {}))
    tally = _Tally(calibration)
    chunks = (
        (times, checks.arranged(values, places))
        for times, values in found.chunks(settings.apply.chunk)
    )
    wrong = partial(checks.saturated, calibration.glove)
    stream = smoothed_chunks(chunks, settings.apply.cutoff_hz, wrong)
    for chunk in stream:
        parts = _apply_to_chunk(calibration, tree, tally, chunk, settings)
        scratch.add(**parts)
        progress.tell(f"{tally.frames} frames of {source.path.name}")
    progress.done()
    return _outcome(
        _Applied(
            source=source,
            rate=_rate(source, found, tally),
            calibration=calibration,
            tree=tree,
            subject=subject,
            tally=tally,
            arrays=scratch.arrays(tally.frames),
        )
    )


def _apply_to_chunk(
    calibration: Calibration,
    tree: JointTree,
    tally: "_Tally",
    chunk: tuple[Floats, Floats, Floats],
    settings: GloveApplying,
) -> dict[str, Floats]:
    """Turn a chunk (times, readings, smoothed readings) into angles, and count it."""
    times, readings, smooth = chunk
    far = tally.see(times, readings)
    mean, variance = predict_measured(calibration, smooth)
    angles, sigma = to_hinges(calibration.glove, tree.hinges, mean, variance)
    good = checks.usable(calibration.glove, readings)
    trusted = good & ~far & np.isfinite(angles).all(axis=1)
    trusted &= sure(calibration, variance, np.radians(settings.apply.max_sigma_deg))
    tally.add(variance, trusted, good, settings.apply.max_sigma_deg)
    parts = {
        "angles": angles,
        "sigma": sigma,
        "trusted": trusted[:, None].astype(np.float64),
    }
    return parts | ({"tips": _tips(tree, angles)} if settings.tips else {})


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
    """(t, 3 F) [m] the fingertips in the hand's frame."""
    poses = np.zeros((len(angles), POSE_HEAD + angles.shape[1]))
    poses[:, 3] = 1.0
    poses[:, POSE_HEAD:] = angles
    out: Floats = marker_positions(fingertips(tree), poses).reshape(
        len(angles), 3 * _FINGERTIPS
    )
    return out


@dataclass(frozen=True, kw_only=True)
class _Applied:
    """What a stream of readings was turned into.

    Attributes
    ----------
    source, calibration : of what, by what.
    rate : [Hz] of the stream.
    tree, subject : the hand in the glove; no subject where it is the template.
    tally : what was counted.
    arrays : (T, ...) angles, sigma, trusted and, if they are wanted, tips.
    """

    source: Source
    rate: float
    calibration: Calibration
    tree: JointTree
    subject: Subject | None
    tally: _Tally
    arrays: Mapping[str, Floats]


def _rate(source: Source, found: ReadingsFile, tally: _Tally) -> float:
    """[Hz] rate of a stream, by its first and last time if it does not say."""
    if found.rate > 0.0:
        return float(found.rate)
    if tally.frames < 2:
        raise FileError(source.path, "has one frame", "two at least tell the rate")
    return float((tally.frames - 1) / (tally.last - tally.first))


def _outcome(applied: _Applied) -> Outcome:
    tally = applied.tally
    if not tally.count:
        raise HandcleanError(
            "in no frame do all sensors read", where=applied.source.path
        )
    sigma = float(np.degrees(tally.sum / tally.count))
    figures = {
        "glove": applied.calibration.glove.name,
        "frames": tally.frames,
        "rate_hz": applied.rate,
        "trusted": tally.trusted / tally.frames,
        "missing": tally.missing / tally.frames,
        "saturated": tally.watch.stuck / tally.frames,
        "sigma_deg": sigma,
    }
    return Outcome(
        line=f"{tally.frames} frames, {100 * tally.trusted / tally.frames:.0f} % "
        f"trusted, sigma {sigma:.1f} degrees",
        figures=figures,
        remarks=_remarks(applied.calibration, tally, applied.subject),
        writers=(_writer(applied),),
    )


def _writer(
    applied: _Applied,
) -> Callable[[Path, tuple[Entry, ...]], tuple[Remark, ...]]:
    """Return what writes the motion; a long session goes to its file part by part."""
    tree, arrays, frames = applied.tree, applied.arrays, applied.tally.frames
    name = tree.side or "right"
    motion: dict[str, Any] = {
        "angles": (arrays["angles"], "rad"),
        "angles_sigma": (arrays["sigma"], "rad"),
        "trusted": (np.asarray(arrays["trusted"][:, 0]) > 0.5, ""),
    }
    tips = None
    if "tips" in arrays:
        tips = (fingertips(tree).labels, arrays["tips"].reshape(frames, _FINGERTIPS, 3))
    take = Recording(
        rate=applied.rate,
        frames=frames,
        start_time=applied.tally.first,
        up_axis="+z",
        skeletons={name: tree},
    )

    def write(path: Path, provenance: tuple[Entry, ...]) -> tuple[Remark, ...]:
        made = replace(take, provenance=provenance)
        if path.suffix.lower() == ".h5":
            write_long(path, made, name, tree.hinges, motion, tips)
            return ()
        whole = with_motion(made, name, tree.hinges, motion, tips)
        surface = None if applied.subject is None else applied.subject.surface
        surfaces = {} if surface is None else {name: surface}
        return files.write(path, whole, surfaces=surfaces)

    return write


def _remarks(
    calibration: Calibration, tally: _Tally, subject: Subject | None
) -> tuple[Remark, ...]:
    remarks = list(tally.watch.remarks())
    far = np.asarray(tally.foreign) / max(tally.frames, 1)
    if (far > _OFTEN_SHARE).any():
        sensors = calibration.glove.sensors
        names = ", ".join(sensors[k] for k in np.flatnonzero(far > _OFTEN_SHARE))
        remarks.append(
            remark(
                "fit",
                f"{names} read far outside what was calibrated, in up to "
                f"{100 * far.max():.0f} % of frames, which are not trusted: another "
                "glove, or another wearer?",
            )
        )
    if tally.uneven > _MOST_UNEVEN_FRAMES:
        remarks.append(
            remark(
                "time",
                f"times are up to {tally.uneven:.2g} frames off an even rate; angles "
                "are written frame by frame at the mean rate",
                frames_off=float(tally.uneven),
            )
        )
    lost = {row.rotation for row in calibration.glove.measured}
    lost -= {one.rotation for one in calibration.fits}
    if lost:
        remarks.append(
            remark(
                "unobserved",
                f"{', '.join(sorted(lost))} are not calibrated and stay at zero",
                rotations=sorted(lost),
            )
        )
    order = [row.rotation for row in calibration.glove.measured]
    shares = np.broadcast_to(tally.unsure / max(tally.frames, 1), len(order))
    often = [k for k in np.argsort(-shares, kind="stable") if shares[k] > _OFTEN_SHARE]
    if often:
        remarks.append(
            remark(
                "trust",
                f"{', '.join(order[k] for k in often)} are too unsure to be trusted in "
                f"up to {100 * shares[often[0]]:.0f} % of frames; samples of them at "
                "more angles would help",
            )
        )
    wearer = "" if subject is None else subject.name
    if calibration.use != "fk" and wearer and calibration.subject not in ("", wearer):
        remarks.append(
            remark(
                "subject",
                f"the calibration has IK samples of {calibration.subject}, the subject "
                f"is {wearer}: those hold for one wearer only",
            )
        )
    return tuple(remarks)
