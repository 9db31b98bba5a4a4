"""Unlabelled takes in, labelled and filled takes with joint angles out.

Filling solves the take and bridges the posture through its gaps; its motion is the
chain's, so nothing is solved twice.
"""

from pathlib import Path
from typing import Any

from handclean.api import given
from handclean.api.fill_gaps import in_units
from handclean.api.given import Subjects
from handclean.api.hands import Hands, uncalibrated
from handclean.api.label import lost, of_labels, renamed
from handclean.api.records import recorded
from handclean.api.results import StepResult
from handclean.api.settings import sorted_settings
from handclean.api.solve import of_motions
from handclean.api.verdicts import doubts, misplaced, untold
from handclean.gaps.fill import fill
from handclean.gaps.measured import clean_measured
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.labels.label import label as label_take
from handclean.labels.settings import LabelConfig
from handclean.recording import Recording
from handclean.runner.steps import step


def clean_hand(
    recording: Recording,
    hands: Hands,
    labelling: LabelConfig,
    filling: FillConfig,
    solving: SolveConfig,
) -> StepResult:
    """Label, fill and solve the take of one hand in one pass.

    Parameters
    ----------
    recording : the take, T frames.
    hands : one subject and the posture prior.
    labelling, filling, solving : settings of the three steps.

    Raises
    ------
    HandcleanError
        As `handclean.api.label.label_hand`, and if the take has no rate.
    """
    (name, subject), prior = hands.only, hands.prior
    found = {name: subject}
    with step("label"):
        labelled, labels = label_take(
            recording, subject, prior=prior, settings=labelling, name=name
        )
    with step("fill and solve"):
        measured = clean_measured(labelled, filling)
        filled, gaps = fill(
            measured.take,
            subject,
            prior=prior,
            settings=filling,
            solve=solving,
            name=name,
        )
    of_label = of_labels(labels)
    of_gaps = {**in_units(gaps), **measured.figures}
    figures = {**of_label, **of_gaps, **of_motions(filled, [name])}
    return StepResult(
        take=filled,
        figures=figures,
        remarks=(
            *renamed(recording, subject),
            *lost(of_label),
            *measured.remarks,
            *uncalibrated([subject]),
            *doubts(filled, found),
            *misplaced(filled, found, prior),
            *untold(filled, found, prior, filled=True),
        ),
    )


def clean(
    take: Recording,
    subjects: Subjects = (),
    *,
    marker_set: str = "",
    side: str = "",
    prior: Path | str | None = None,
    **settings: Any,
) -> Recording:
    """Label, fill and solve an unlabelled take of one hand, as ``handclean clean``.

    The same as `label`, `fill_gaps` and `solve` one after another, and faster.

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
        Those of `label`, `fill_gaps` and `solve`, with ``label_``, ``fill_`` or
        ``solve_`` before them where two steps have one of the same name.

    Returns
    -------
    Recording
        With ``markers``, ``motions``, ``events`` and ``remarks`` as the three steps
        give them.

    Raises
    ------
    HandcleanError
        If the hand is not found in the take, cannot be followed, or is the other one,
        or the take has no rate.
    UsageError
        If subjects or settings are not what they should be.

    Examples
    --------
    >>> import handclean as hc
    >>> trial = hc.simulate("free", duration_s=1.0, rate_hz=50.0, ghosts_per_s=0.0)[0]
    >>> clean = hc.clean(trial.unlabelled, [trial.subject], fill_max_gap_s=0.3)
    >>> hc.compare(trial.truth, clean).motions["right"].angles.mean < 0.1  # [rad]
    True
    """
    classes = {"label": LabelConfig, "fill": FillConfig, "solve": SolveConfig}
    chosen = sorted_settings("clean", classes, settings)
    hands = given.only_hand(subjects, marker_set, side, prior)
    done = clean_hand(take, hands, chosen["label"], chosen["fill"], chosen["solve"])
    return recorded("clean", take, done, hands, chosen)
