"""A subject from labelled range-of-motion takes of one hand."""

from pathlib import Path

from handclean.errors import UsageError
from handclean.hand.marker_set import load_marker_set
from handclean.io.subject import write_subject
from handclean.pipeline import names, sessions
from handclean.pipeline.batch import Source
from handclean.pipeline.choices import Calibrating
from handclean.pipeline.outcome import Entry, Outcome
from handclean.subject.calibrate import calibrate

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
}


def calibrate_hand_markers(
    sources: tuple[Source, ...], settings: Calibrating
) -> Outcome:
    """Find bone lengths, joint places, axes and marker places of one hand."""
    sets = {source.marker_set for source in sources}
    sides = {source.side for source in sources}
    if sets == {""}:
        raise UsageError(
            "--marker-set: is missing; it says what the markers are called"
        )
    if len(sets) > 1 or len(sides) > 1:
        raise UsageError("--manifest: all takes should be of one marker set and side")
    (name,) = sets
    takes = [sessions.read(source) for source in sources]
    has = [names.labels_of(take) for take in takes]
    for source, labels in zip(sources, has, strict=True):
        names.expect_set(source.name, labels, name)
    subject, report = calibrate(
        takes,
        load_marker_set(name),
        settings.calibrate,
        side=sides.pop(),
        name=settings.name,
    )

    more = names.larger_set(set.intersection(*map(set, has)), name)

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
    }
    return Outcome(
        line=line, figures=figures, warnings=(*report.warnings, *more), writers=(write,)
    )
