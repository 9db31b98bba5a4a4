"""Unlabelled takes with their markers named, and what is odd about them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handclean.api import given, names
from handclean.api.given import Subjects
from handclean.api.hands import Hands, uncalibrated
from handclean.api.records import recorded
from handclean.api.results import StepResult
from handclean.api.settings import sorted_settings
from handclean.api.verdicts import doubts
from handclean.hand.subject import Subject
from handclean.labels.label import LabelFigures
from handclean.labels.label import label as label_take
from handclean.labels.settings import LabelConfig
from handclean.recording import Recording
from handclean.remarks import Remark, first_of, remark

MIN_FOLLOWED_SHARE = 0.5
"""Share of the frames in which a hand should be followed; fewer are warned of
(chosen)."""


def label_hand(recording: Recording, hands: Hands, settings: LabelConfig) -> StepResult:
    """Name every point of the take that is a marker of its one hand, and no other.

    Parameters
    ----------
    recording : the take, T frames.
    hands : one subject and the posture prior.
    settings : of labelling.

    Raises
    ------
    HandcleanError
        If the hand is not found, cannot be followed, or is the other one.
    """
    name, subject = hands.only
    labelled, found = label_take(
        recording, subject, prior=hands.prior, settings=settings, name=name
    )
    figures = of_labels(found)
    return StepResult(
        take=labelled,
        figures=figures,
        remarks=(
            *renamed(recording, subject),
            *lost(figures),
            *uncalibrated([subject]),
            *doubts(labelled, {name: subject}),
        ),
    )


def renamed(recording: Recording, subject: Subject) -> tuple[Remark, ...]:
    """Remark on what becomes of the names that a take has already."""
    has = names.labels_of(recording)
    others = [label for label in has if label not in subject.model.labels]
    if not has:
        return ()
    if not others:
        what = f"its {len(has)} markers are named anew"
    else:
        few = first_of(others)
        what = f"{len(others)} other markers ({few}) are points without a name now"
    text = f"names the take had are not kept: {what}"
    return (remark("names", text, others=others),)


def lost(figures: Mapping[str, Any]) -> tuple[Remark, ...]:
    """Remark on a hand that was followed in few frames."""
    followed, frames = figures["followed"], figures["frames"]
    if followed >= MIN_FOLLOWED_SHARE * frames:
        return ()
    text = (
        f"the hand was followed in {followed} of {frames} frames only "
        f"({100 * followed / frames:.1f} %); the rest has no labels"
    )
    return (remark("unseen", text, followed=followed, count=frames),)


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


def label(
    take: Recording,
    subjects: Subjects = (),
    *,
    marker_set: str = "",
    side: str = "",
    prior: Path | str | None = None,
    **settings: Any,
) -> Recording:
    """Name the markers of an unlabelled take of one hand, as ``handclean label``.

    Parameters
    ----------
    take : Recording
        Points without names; names it has are not used.
    subjects : Subject or sequence of Subject
        Whose hand the take shows; from `calibrate_hand` or `read_subject`.
    marker_set : str
        Without a subject: a shipped name or a TOML file of the markers that the
        template hand then has.
    side : {"", "left", "right"}
        Of the template hand; the marker set's own by default.
    prior : path, optional
        A posture prior of ``learn subspace``; by default the one that ships.
    **settings
        Fields of `handclean.labels.settings.LabelConfig`, such as ``strict``.

    Returns
    -------
    Recording
        ``markers.positions`` (T, M, 3) [m] are the points named, bit for bit, with
        ``markers.confidence`` (T, M); ``unlabelled`` are all others. ``motions`` has
        the pose in which each frame was matched, ``remarks`` what is odd.

    Raises
    ------
    HandcleanError
        If the hand is not found in the take, cannot be followed, or is the other one.
    UsageError
        If subjects or settings are not what they should be.

    References
    ----------
    Maycock et al. (2015), "Fully automatic optical motion tracking using an inverse
    kinematics approach", IEEE-RAS Humanoids: equation 2 scores the first frame.

    Examples
    --------
    >>> import handclean as hc
    >>> trial = hc.simulate("free", duration_s=1.0, rate_hz=50.0, ghosts_per_s=0.0)[0]
    >>> labelled = hc.label(trial.unlabelled, trial.subject)
    >>> hc.compare(trial.labelled, labelled).labels.f1 > 0.99
    True
    """
    chosen = sorted_settings("label", {"label": LabelConfig}, settings)["label"]
    hands = given.only_hand(subjects, marker_set, side, prior)
    done = label_hand(take, hands, chosen)
    return recorded("label", take, done, hands, chosen)
