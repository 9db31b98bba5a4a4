"""Unlabelled takes in, labelled and filled takes with joint angles out.

Filling solves the take and bridges the posture through its gaps; its motion is the
chain's, so nothing is solved twice.
"""

from handclean.commands import fill_gaps, solve
from handclean.commands import label as labelling
from handclean.commands.shared import hands, sessions
from handclean.commands.shared.choices import Cleaning
from handclean.gaps.fill import fill
from handclean.labels.label import label
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {**labelling.FIGURES, **fill_gaps.FIGURES, **solve.FIGURES}


def clean(source: Source, settings: Cleaning) -> Outcome:
    """Label, fill and solve in one pass."""
    recording = sessions.read(source)
    warnings = sessions.traps(source, recording)
    name, subject = hands.only_subject(source)
    prior = hands.prior(source)
    labelled, labels = label(
        recording, subject, prior=prior, settings=settings.label, name=name
    )
    few = labelling.lost(labelling.of_labels(labels))
    filled, gaps = fill(
        labelled,
        subject,
        prior=prior,
        settings=settings.fill,
        solve=settings.solve,
        name=name,
    )
    parts = (
        labelling.of_labels(labels),
        fill_gaps.of_hands([gaps]),
        solve.of_motions(filled, [name]),
    )
    words = (
        labelling.in_words(parts[0]),
        fill_gaps.in_words(parts[1]),
        solve.in_words(parts[2]),
    )
    figures = {**parts[0], **parts[1], **parts[2]}
    return sessions.outcome(
        filled,
        "; ".join(words),
        figures,
        (
            *warnings,
            *labelling.renamed(recording, subject),
            *few,
            *hands.remarks(subject),
            *solve.doubts(filled, {name: subject}),
            *solve.misplaced(filled, {name: subject}, prior),
            *solve.untold(filled, {name: subject}, prior, filled=True),
        ),
        sessions.surfaces({name: subject}),
    )
