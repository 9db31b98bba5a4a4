"""A subject from labelled range-of-motion takes of one hand."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from handclean.api.calibrate_hand import calibrate_takes
from handclean.commands.shared import needs, sessions
from handclean.commands.shared.choices import Calibrating
from handclean.commands.shared.take_options import options_of
from handclean.errors import UsageError
from handclean.hand.subject import Subject
from handclean.io.hdf5.subject import read_subject, write_subject
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome
from handclean.subject.scan.locate import Located

SCANNED = ("neutral_rms_mm", "neutral_set_rms_mm", "marker_height_mm")
"""Figures of hands from a scan only."""

FIGURES = {
    "side": "of the hand",
    "size": "length of the hand against the template's",
    "frames": "frames of all takes",
    "frames_usable": "frames with enough markers",
    "frames_used": "frames the hand was learnt from",
    "frames_held_out": "frames the error was measured on",
    "train_rms_mm": "RMS distance of markers in the frames used",
    "heldout_rms_mm": "RMS distance in those held out",
    "heldout_kept_rms_mm": "the same without doubtful samples",
    "doubtful": "share of held-out samples that fit no posture",
    "noise_mm": "noise of a marker, each way",
    "camera_noise_mm": "the part of it that changes from frame to frame",
    "poorly_moved": "joints that moved too little",
    "neutral_rms_mm": "RMS distance of markers from their places on a scanned hand, in "
    "the neutral frames",
    "neutral_set_rms_mm": "the same from where the marker set has them",
    "marker_height_mm": "median height of markers over the scanned skin",
}


def calibrate_hand_markers(
    sources: tuple[Source, ...], settings: Calibrating
) -> Outcome:
    """Find bone lengths, joint places, axes and marker places of one hand."""
    given = [options_of(source) for source in sources]
    sets = {take.marker_set for take in given}
    sides = {take.side for take in given}
    if sets == {""}:
        raise needs.no_marker_set()
    if len(sets) > 1 or len(sides) > 1:
        raise UsageError("--manifest: all takes should be of one marker set and side")
    (marker_set,) = sets
    takes = [sessions.read(source) for source in sources]
    done = calibrate_takes(
        takes,
        marker_set,
        settings.calibrate,
        side=sides.pop(),
        name=settings.name,
        scanned=_scanned(sources),
        called=names_of(sources),
    )
    odd = tuple(one for take in takes for one in take.remarks)
    of_scan: Mapping[str, Any] = {}
    if done.located is not None:
        placed = _placed(done.located)
        if done.report is None:
            return replace(placed, remarks=(*done.remarks, *odd))
        of_scan = placed.figures
    subject, report = done.subject, done.report
    assert report is not None

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        write_subject(path, subject, provenance)

    line = (
        f"{report.side} hand, {100 * report.size:.0f} % of the template's length, "
        f"learnt from {report.frames_used} of {report.frames} frames; "
        f"held out: {1e3 * report.heldout_rms_m:.2f} mm RMS"
    )
    figures = {
        name: 1e3 * getattr(report, f"{name[:-2]}m")
        if name.endswith("_mm")
        else getattr(report, name)
        for name in FIGURES
        if name not in SCANNED
    }
    return Outcome(
        line=line,
        figures={**figures, **of_scan},
        remarks=(*done.remarks, *odd),
        writers=(write,),
    )


def names_of(sources: Sequence[Source]) -> tuple[str, ...]:
    """Name takes as remarks call them, by their files; with folders if need be."""
    called = [source.path.name for source in sources]
    if len(set(called)) < len(called):
        called = [source.name for source in sources]
    return tuple(called)


def _scanned(sources: tuple[Source, ...]) -> Subject | None:
    """Read the scanned hand that the takes are of, if one is named."""
    options = [options_of(source) for source in sources]
    paths = {path for take in options for path in take.subjects}
    if not paths:
        return None
    if len(paths) > 1:
        raise UsageError("--subject: is one hand, from 'calibrate-hand scan'")
    subject = read_subject(paths.pop())
    sides = {take.side for take in options} - {"", subject.model.tree.side}
    if sides:
        raise UsageError(
            f"--side {sides.pop()}: the scan is of a {subject.model.tree.side} hand"
        )
    return subject


def _placed(located: Located) -> Outcome:
    """Say where a scanned hand's markers are when takes told no more."""
    subject, placed = located.subject, located.placed

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        write_subject(path, subject, provenance)

    line = (
        f"{subject.model.tree.side} hand of a scan, {len(subject.model.labels)} "
        f"markers placed from {len(placed.poses)} neutral frames; they lie "
        f"{1e3 * placed.start_rms_m:.1f} mm RMS from where {subject.marker_set} has "
        "them"
    )
    figures: dict[str, Any] = {
        "side": subject.model.tree.side,
        "size": subject.model.tree.scale,
        **{name: 1e3 * subject.errors[f"{name[:-2]}m"] for name in SCANNED},
    }
    return Outcome(line=line, figures=figures, remarks=placed.remarks, writers=(write,))
