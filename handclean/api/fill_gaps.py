"""Short gaps of labelled takes, filled."""

from collections.abc import Sequence
from typing import Any

from handclean.api import names
from handclean.api.hands import Hands
from handclean.api.hands import warnings as of_template
from handclean.api.results import StepResult
from handclean.api.solve import (
    doubts,
    expect_fits,
    expect_seen,
    expect_sides,
    misplaced,
    untold,
)
from handclean.gaps.fill import FillFigures, fill
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.recording import Recording


def fill_hands(
    recording: Recording, hands: Hands, settings: FillConfig, solve: SolveConfig
) -> StepResult:
    """Fill the gaps of every hand.

    Parameters
    ----------
    solve : settings of inverse kinematics, which bridges the postures.

    Raises
    ------
    HandcleanError
        As `handclean.api.solve.solve_hands`, and if the take has no rate.
    """
    found, prior = hands.subjects, hands.prior
    recording, same = names.matched(recording, names.known_to(found))
    names.expect_any(recording, found)
    hidden = expect_seen(recording, found)
    misspelt = (*same, *names.remarks(recording, found))
    parts = []
    for name, subject in found.items():
        recording, part = fill(
            recording, subject, prior=prior, settings=settings, solve=solve, name=name
        )
        parts.append(part)
    expect_fits(recording, found)
    expect_sides(recording, found, prior)
    return StepResult(
        take=recording,
        figures=of_hands(parts),
        warnings=(
            *misspelt,
            *hidden,
            *of_template(found.values()),
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
