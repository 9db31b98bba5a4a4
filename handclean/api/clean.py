"""Unlabelled takes in, labelled and filled takes with joint angles out.

Filling solves the take and bridges the posture through its gaps; its motion is the
chain's, so nothing is solved twice.
"""

from handclean.api.fill_gaps import of_hands
from handclean.api.hands import Hands
from handclean.api.hands import warnings as of_template
from handclean.api.label import lost, of_labels, renamed
from handclean.api.results import StepResult
from handclean.api.solve import doubts, misplaced, of_motions, untold
from handclean.gaps.fill import fill
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.labels.label import label
from handclean.labels.settings import LabelConfig
from handclean.recording import Recording


def clean_hand(
    recording: Recording,
    hands: Hands,
    labelling: LabelConfig,
    filling: FillConfig,
    solving: SolveConfig,
) -> StepResult:
    """Label, fill and solve the take of one hand in one pass.

    Raises
    ------
    HandcleanError
        As `handclean.api.label.label_hand`, and if the take has no rate.
    """
    (name, subject), prior = hands.only, hands.prior
    found = {name: subject}
    labelled, labels = label(
        recording, subject, prior=prior, settings=labelling, name=name
    )
    filled, gaps = fill(
        labelled, subject, prior=prior, settings=filling, solve=solving, name=name
    )
    of_label = of_labels(labels)
    figures = {**of_label, **of_hands([gaps]), **of_motions(filled, [name])}
    return StepResult(
        take=filled,
        figures=figures,
        warnings=(
            *renamed(recording, subject),
            *lost(of_label),
            *of_template([subject]),
            *doubts(filled, found),
            *misplaced(filled, found, prior),
            *untold(filled, found, prior, filled=True),
        ),
    )
