"""Gaps of labelled takes, filled."""

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
from handclean.gaps.fill import FillFigures, fill_take
from handclean.gaps.measured import clean_measured
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.recording import Recording


def fill_hands(
    recording: Recording, hands: Hands, settings: FillConfig, solve: SolveConfig
) -> StepResult:
    """Fill the gaps of every labelled marker.

    Measured samples are cleaned before, where that is asked for.

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
    if found:
        names.expect_any(recording, found)
    hidden = expect_seen(recording, found) if found else ()
    misspelt = (*same, *names.misspelt(recording, found))
    measured = clean_measured(recording, settings)
    take, figures = fill_take(
        measured.take, found, prior=prior, settings=settings, solve=solve
    )
    if found:
        expect_fits(take, found)
        expect_sides(take, found, prior)
    return StepResult(
        take=take,
        figures={**in_units(figures), **measured.figures},
        remarks=(
            *misspelt,
            *measured.remarks,
            *hidden,
            *uncalibrated(found.values()),
            *doubts(take, found),
            *misplaced(take, found, prior),
            *untold(take, found, prior, filled=True),
        ),
    )


def in_units(figures: FillFigures) -> dict[str, Any]:
    """Figures as they are reported: sigma in millimetres."""
    return {
        "gaps": figures.gaps,
        "filled": figures.filled,
        "left_open": figures.left_open,
        "missing_samples": figures.missing_samples,
        "filled_samples": figures.filled_samples,
        "longest_filled_s": figures.longest_filled_s,
        "sigma_mm": 1e3 * figures.sigma_m,
        "bridged_frames": figures.bridged_frames,
        "filled_by": figures.filled_by,
        "reasons": figures.reasons,
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
    """Fill the gaps of a labelled take, as ``handclean fill-gaps``.

    Gaps stay open where the error to expect is over ``max_sigma_m``. Without a subject
    or marker set the markers are filled from each other alone, and there is no motion.

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
        Filled samples have ``markers.origin`` 2 and ``markers.sigma`` (T, M) [m], the
        68 % half-width of their error per axis. ``motions`` has the joint angles,
        bridged through the gaps; ``events`` and ``remarks`` tell what became of each
        gap.

    Raises
    ------
    HandcleanError
        If the take has no labelled marker, none of a subject's or no rate, no frame
        shows enough of them, or what they show is not of a hand's size or of the other
        side.
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
    hands = given.hands(subjects, marker_set, side, prior, least=0)
    done = fill_hands(take, hands, chosen["fill"], chosen["solve"])
    return recorded("fill-gaps", take, done, hands, chosen)
