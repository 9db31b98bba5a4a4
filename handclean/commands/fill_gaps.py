"""Labelled takes with their gaps filled."""

from collections.abc import Mapping
from typing import Any

from handclean.api.fill_gaps import fill_hands
from handclean.commands.shared import hands, sessions
from handclean.commands.shared.choices import Filling
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome
from handclean.runner.steps import step

FIGURES = {
    "gaps": "gaps of labelled markers",
    "filled": "gaps that were filled",
    "left_open": "gaps that were not",
    "missing_samples": "samples in all gaps",
    "filled_samples": "samples in the filled ones",
    "longest_filled_s": "length of the longest filled gap",
    "sigma_mm": "median sigma of filled samples, per axis",
    "bridged_frames": "frames in which a joint was interpolated",
    "filled_by": "how many gaps each source filled",
    "reasons": "how many gaps were left open, by reason",
    "despiked": "measured samples that were spikes and are interpolated",
    "smoothed": "measured samples that were smoothed",
}


def fill_gaps(source: Source, settings: Filling) -> Outcome:
    """Fill the gaps of every labelled marker."""
    recording = sessions.read(source)
    sought = hands.of_source_if_any(source)
    with step("fill and solve"):
        done = fill_hands(recording, sought, settings.fill, settings.solve)
    return sessions.outcome(
        done.take, in_words(done.figures), done.figures, done.remarks
    )


def in_words(figures: Mapping[str, Any]) -> str:
    """Say the figures in a few words."""
    text = f"filled {figures['filled']} gaps, left {figures['left_open']} open"
    if figures["reasons"]:
        worst = max(figures["reasons"], key=figures["reasons"].__getitem__)
        text += f" (mostly: {worst})" if len(figures["reasons"]) > 1 else f" ({worst})"
    return text
