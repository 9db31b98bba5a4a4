"""Unlabelled takes in, labelled and filled takes with joint angles out."""

from handclean.api.clean import clean_hand
from handclean.commands import fill_gaps, label, solve
from handclean.commands.shared import hands, sessions
from handclean.commands.shared.choices import Cleaning
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {**label.FIGURES, **fill_gaps.FIGURES, **solve.FIGURES}


def clean(source: Source, settings: Cleaning) -> Outcome:
    """Label, fill and solve in one pass."""
    recording = sessions.read(source)
    sought = hands.of_only_source(source)
    done = clean_hand(recording, sought, settings.label, settings.fill, settings.solve)
    words = (part.in_words(done.figures) for part in (label, fill_gaps, solve))
    return sessions.outcome(
        done.take,
        "; ".join(words),
        done.figures,
        done.remarks,
        sessions.surfaces(sought.subjects),
    )
