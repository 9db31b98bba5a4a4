"""Joint angles of labelled takes, and what is odd about them."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from handclean.api import bridged, given, names
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
from handclean.ik.settings import SolveConfig
from handclean.ik.take import solve as solve_take
from handclean.recording import Motion, Recording
from handclean.remarks import remark

ANEW = "it is solved anew, frame by frame, and nothing bridges them"
"""What becomes of a hand whose motion in the file is not kept, see `bridged`."""


def solve_hands(
    recording: Recording, hands: Hands, settings: SolveConfig
) -> StepResult:
    """Add the joint angles of every hand, or keep those that filling found.

    Parameters
    ----------
    recording : the take, T frames, with labelled markers.
    hands : subjects by the names of their motions, and the posture prior.
    settings : of inverse kinematics.

    Raises
    ------
    HandcleanError
        If the take has no marker of the hands, no frame shows enough of them, or what
        they show is not of a hand's size or of the other side.
    """
    found, prior = hands.subjects, hands.prior
    recording, same = names.matched(recording, names.known_to(found))
    names.expect_any(recording, found)
    hidden = expect_seen(recording, found)
    misspelt = (*same, *names.misspelt(recording, found))
    kept, anew = {}, {}
    solved = []
    for name, subject in found.items():
        why = bridged.refused(recording, name, hands, settings)
        if why == "":
            kept[name] = subject
            continue
        anew[name] = subject
        text = f"{name}: {why}; {ANEW}"
        solved += [remark("anew", text, model=name)] if why else []
        recording = solve_take(
            recording, subject, name=name, prior=prior, settings=settings
        )
    expect_fits(recording, found)
    expect_sides(recording, found, prior)
    return StepResult(
        take=recording,
        figures={**of_motions(recording, found), "kept": len(kept)},
        remarks=(
            *misspelt,
            *hidden,
            *solved,
            *uncalibrated(found.values()),
            *doubts(recording, found),
            *misplaced(recording, found, prior),
            *untold(recording, kept, prior, filled=True),
            *untold(recording, anew, prior),
        ),
    )


def of_motions(recording: Recording, names: Iterable[str]) -> dict[str, float]:
    """Figures of solved motions, by name."""
    motions = [recording.motions[name] for name in names]
    residual = np.concatenate([_residual(motion) for motion in motions])
    residual = residual[np.isfinite(residual)] * 1e3  # [mm], for people
    some = bool(len(residual))
    return {
        "frames": recording.frames,
        "hands": len(motions),
        "trusted": min(_trusted(motion) for motion in motions),
        "residual_mm": float(np.sqrt(np.mean(residual**2))) if some else np.nan,
        "residual_p95_mm": float(np.quantile(residual, 0.95)) if some else np.nan,
    }


def _residual(motion: Motion) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    assert motion.residual is not None
    residual: np.ndarray[tuple[int], np.dtype[np.float64]] = motion.residual
    return residual


def _trusted(motion: Motion) -> float:
    assert motion.trusted is not None
    return float(motion.trusted.mean())


def solve(
    take: Recording,
    subjects: Subjects = (),
    *,
    marker_set: str = "",
    side: str = "",
    prior: Path | str | None = None,
    standard: bool = False,
    **settings: Any,
) -> Recording:
    """Add the joint angles of a labelled take, as ``handclean solve``.

    A hand whose gaps `fill_gaps` or `clean` filled, with the same subject, prior and
    settings, keeps the motion that they found.

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
    standard : bool
        Do without a posture prior.
    **settings
        Fields of `handclean.ik.settings.SolveConfig`.

    Returns
    -------
    Recording
        ``motions[name]`` of each hand: ``angles`` (T, D) [rad], ``translation`` (T, 3)
        [m], ``rotation`` (T, 4) unit quaternions, ``trusted`` (T,), ``residual`` (T,)
        [m]; ``skeletons[name]`` its joint tree.

    Raises
    ------
    HandcleanError
        If the take has none of the markers, no frame shows enough of them, or what
        they show is not of a hand's size or of the other side.
    UsageError
        If subjects or settings are not what they should be.

    References
    ----------
    Schröder et al. (2014), "Real-time hand tracking using synergistic inverse
    kinematics", ICRA.

    Examples
    --------
    >>> import handclean as hc
    >>> trial = hc.simulate("free", duration_s=1.0, rate_hz=50.0, ghosts_per_s=0.0)[0]
    >>> solved = hc.solve(trial.labelled, trial.subject)
    >>> list(solved.motions), solved.motions["right"].angles.shape
    (['right'], (50, 20))
    """
    chosen = sorted_settings("solve", {"solve": SolveConfig}, settings)
    with_prior = not standard
    hands = given.hands(subjects, marker_set, side, prior, with_prior=with_prior)
    done = solve_hands(take, hands, chosen["solve"])
    return recorded("solve", take, done, hands, {**chosen, "standard": standard})
