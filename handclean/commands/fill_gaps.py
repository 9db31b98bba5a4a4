"""Labelled takes with their short gaps filled."""

from collections.abc import Sequence
from typing import Any

from handclean.commands.shared import hands, names, sessions
from handclean.commands.shared.choices import Filling
from handclean.commands.solve import (
    doubts,
    expect_fits,
    expect_seen,
    expect_sides,
    misplaced,
    untold,
)
from handclean.gaps.fill import FillFigures, fill
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {
    "gaps": "gaps of the subjects' markers",
    "filled": "gaps that were filled",
    "left_open": "gaps that were not",
    "missing_samples": "samples in all gaps",
    "filled_samples": "samples in the filled ones",
    "longest_filled_s": "length of the longest filled gap",
    "sigma_mm": "median sigma of filled samples, per axis, of the worse hand",
    "bridged_frames": "frames in which a joint was interpolated",
    "reasons": "how many gaps were left open, by reason",
}


def fill_gaps(source: Source, settings: Filling) -> Outcome:
    """Fill the gaps of every hand."""
    recording = sessions.read(source)
    warnings = sessions.traps(source, recording)
    prior = hands.prior(source)
    found = hands.subjects(source, marked=True)
    recording, same = names.matched(recording, names.known_to(found))
    names.expect_any(recording, found)
    hidden = expect_seen(recording, found)
    misspelt = (*same, *names.remarks(recording, found))
    parts = []
    for name, subject in found.items():
        recording, part = fill(
            recording,
            subject,
            prior=prior,
            settings=settings.fill,
            solve=settings.solve,
            name=name,
        )
        parts.append(part)
    expect_fits(recording, found)
    expect_sides(recording, found, prior)
    figures = of_hands(parts)
    return sessions.outcome(
        recording,
        in_words(figures),
        figures,
        (
            *warnings,
            *misspelt,
            *hidden,
            *hands.remarks(*found.values()),
            *doubts(recording, found),
            *misplaced(recording, found, prior),
            *untold(recording, found, prior, filled=True),
        ),
    )


def of_hands(parts: Sequence[FillFigures]) -> dict[str, Any]:
    """Figures of all hands together."""
    reasons: dict[str, int] = {}
    for part in parts:
        for reason, count in part.reasons.items():
            reasons[reason] = reasons.get(reason, 0) + count
    return {
        "gaps": sum(part.gaps for part in parts),
        "filled": sum(part.filled for part in parts),
        "left_open": sum(part.left_open for part in parts),
        "missing_samples": sum(part.missing_samples for part in parts),
        "filled_samples": sum(part.filled_samples for part in parts),
        "longest_filled_s": max(part.longest_filled_s for part in parts),
        "sigma_mm": max(1e3 * part.sigma_m for part in parts),
        "bridged_frames": sum(part.bridged_frames for part in parts),
        "reasons": reasons,
    }


def in_words(figures: dict[str, Any]) -> str:
    """Say the figures in a few words."""
    text = f"filled {figures['filled']} gaps, left {figures['left_open']} open"
    if figures["reasons"]:
        worst = max(figures["reasons"], key=figures["reasons"].__getitem__)
        text += f" (mostly: {worst})" if len(figures["reasons"]) > 1 else f" ({worst})"
    return text
