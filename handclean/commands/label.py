"""Unlabelled takes with their markers named."""

from collections.abc import Mapping
from typing import Any

from handclean.commands import solve
from handclean.commands.shared import hands, names, sessions
from handclean.hand.subject import Subject
from handclean.labels import label as labelling
from handclean.labels.label import LabelFigures
from handclean.labels.settings import LabelConfig
from handclean.recording import Recording
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {
    "frames": "frames of the take",
    "followed": "frames in which the hand was followed",
    "start_frame": "number of the frame in which it was found first",
    "start_score": "how well it fitted there",
    "labelled": "points that got a name",
    "unlabelled": "points that got none",
    "refused": "points refused by the distance threshold",
    "rms_mm": "RMS distance of labelled points from the hand",
    "mean_confidence": "mean confidence of the names, 0 to 1",
}

ENOUGH = 0.5
"""Share of the frames in which a hand should be followed; fewer are warned of."""


def label(source: Source, settings: LabelConfig) -> Outcome:
    """Name every point of the take, or leave it unnamed."""
    recording = sessions.read(source)
    warnings = sessions.traps(source, recording)
    name, subject = hands.only_subject(source)
    labelled, found = labelling.label(
        recording, subject, prior=hands.prior(source), settings=settings, name=name
    )
    figures = of_labels(found)
    return sessions.outcome(
        labelled,
        in_words(figures),
        figures,
        (
            *warnings,
            *renamed(recording, subject),
            *lost(figures),
            *hands.remarks(subject),
            *solve.doubts(labelled, {name: subject}),
        ),
    )


def renamed(recording: Recording, subject: Subject) -> tuple[str, ...]:
    """Say what becomes of the names that a take has already."""
    has = names.labels_of(recording)
    others = [label for label in has if label not in subject.model.labels]
    if not has:
        return ()
    if not others:
        told = f"its {len(has)} markers are named anew"
    else:
        few = ", ".join(others[:4]) + (", ..." if len(others) > 4 else "")
        told = f"{len(others)} other markers ({few}) are points without a name now"
    return (f"names the take had are not kept: {told}",)


def lost(figures: Mapping[str, Any]) -> tuple[str, ...]:
    """Say that the hand was followed in few frames."""
    followed, frames = figures["followed"], figures["frames"]
    if followed >= ENOUGH * frames:
        return ()
    return (
        f"the hand was followed in {followed} of {frames} frames only "
        f"({100 * followed / frames:.1f} %); the rest has no labels",
    )


def of_labels(found: LabelFigures) -> dict[str, Any]:
    """Figures of labelling."""
    return {
        "frames": found.frames,
        "followed": found.followed,
        "start_frame": found.start_frame,
        "start_score": found.start_score,
        "labelled": found.labelled,
        "unlabelled": found.unlabelled,
        "refused": found.refused,
        "rms_mm": 1e3 * found.rms_m,
        "mean_confidence": found.mean_confidence,
    }


def in_words(figures: dict[str, Any]) -> str:
    """Say the figures in a few words."""
    few = " only" if figures["followed"] < ENOUGH * figures["frames"] else ""
    return (
        f"labelled {figures['labelled']} points, left {figures['unlabelled']}, "
        f"followed the hand in {figures['followed']} of {figures['frames']} frames{few}"
    )
