"""Short gaps of labelled takes, filled."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from handclean.api import given, names
from handclean.api.given import Subjects
from handclean.api.hands import Hands, uncalibrated
from handclean.api.records import recorded
from handclean.api.results import StepResult
from handclean.api.settings import sorted_settings
from handclean.api.verdicts import (
    doubts,
    expect_fits,
    expect_seen,
    expect_sides,
    misplaced,
    untold,
)
from handclean.gaps.fill import FillFigures, fill
from handclean.gaps.measured import clean_measured
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.recording import Recording


def fill_hands(
    recording: Recording, hands: Hands, settings: FillConfig, solve: SolveConfig
) -> StepResult:
    """Fill the gaps of every hand, after cleaning measured samples where asked for.

    Parameters
    ----------
    solve : settings of inverse kinematics, which bridges the postures.

    Raises
    ------
    HandcleanError
        As `handclean.api.solve.solve_hands`, and if the take has no rate, or one that
        is too low for the cut-off of smoothing.
    """
    found, prior = hands.subjects, hands.prior
    recording, same = names.matched(recording, names.known_to(found))
    names.expect_any(recording, found)
    hidden = expect_seen(recording, found)
    misspelt = (*same, *names.misspelt(recording, found))
    measured = clean_measured(recording, settings)
    recording = measured.take
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
        figures={**of_hands(parts), **measured.figures},
        remarks=(
            *misspelt,
            *measured.remarks,
            *hidden,
            *uncalibrated(found.values()),
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


def fill_gaps(
    take: Recording,
    subjects: Subjects = (),
    *,
    marker_set: str = "",
    side: str = "",
    prior: Path | str | None = None,
    **settings: Any,
) -> Recording:
    """Fill the short gaps of a labelled take, as ``handclean fill-gaps``.

    Measured samples come back bit for bit, unless ``despike`` or ``smooth`` ask for
    others: then those that change have ``markers.origin`` 4 and their measured place in
    ``markers.raw``.

    Parameters
    ----------
    take : Recording
        With ``markers``.
    subjects : Subject or sequence of Subject
        Whose hands the take shows, one for each hand; from `calibrate_hand` or
        `read_subject`.
    marker_set : str
        Without a subject: a shipped name or a TOML file of the markers that the
        template hand then has.
    side : {"", "left", "right"}
        Of the template hand; the marker set's own by default.
    prior : path, optional
        A posture prior of ``learn subspace``; by default the one that ships.
    **settings
        Fields of `handclean.gaps.settings.FillConfig`, such as ``max_gap_s`` [s], and,
        with ``solve_`` before them, of `handclean.ik.settings.SolveConfig`.

    Returns
    -------
    Recording
        Filled samples have ``markers.origin`` 2 and ``markers.sigma`` (T, M) [m], their
        standard deviation per axis. ``motions`` has the joint angles, bridged through
        the gaps; ``events`` and ``remarks`` tell what became of each gap.

    Raises
    ------
    HandcleanError
        If the take has none of the markers or no rate, no frame shows enough of them,
        or what they show is not of a hand's size or of the other side.
    UsageError
        If subjects or settings are not what they should be.

    Examples
    --------
    >>> import handclean as hc
    >>> trial = hc.simulate("free", duration_s=1.0, rate_hz=50.0, ghosts_per_s=0.0)[0]
    >>> filled = hc.fill_gaps(trial.labelled, trial.subject, max_gap_s=0.3)
    >>> filled.markers.positions.shape
    (50, 26, 3)
    """
    classes = {"fill": FillConfig, "solve": SolveConfig}
    chosen = sorted_settings("fill_gaps", classes, settings)
    hands = given.hands(subjects, marker_set, side, prior)
    done = fill_hands(take, hands, chosen["fill"], chosen["solve"])
    return recorded("fill-gaps", take, done, hands, chosen)
