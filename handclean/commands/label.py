"""Unlabelled takes with their markers named."""

from collections.abc import Mapping
from typing import Any

from handclean.api.label import MIN_FOLLOWED_SHARE, label_hand
from handclean.commands.shared import hands, sessions
from handclean.labels.settings import LabelConfig
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome
from handclean.runner.steps import step

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


def label(source: Source, settings: LabelConfig) -> Outcome:
    """Name every point of the take, or leave it unnamed."""
    recording = sessions.read(source)
    with step("label"):
        done = label_hand(recording, hands.of_only_source(source), settings)
    return sessions.outcome(
        done.take, in_words(done.figures), done.figures, done.remarks
    )


def in_words(figures: Mapping[str, Any]) -> str:
    """Say the figures in a few words."""
    few = (
        " only" if figures["followed"] < MIN_FOLLOWED_SHARE * figures["frames"] else ""
    )
    return (
        f"labelled {figures['labelled']} points, left {figures['unlabelled']}, "
        f"followed the hand in {figures['followed']} of {figures['frames']} frames{few}"
    )
