"""What a command cannot do without: looked at before the first input."""

from collections.abc import Sequence

from handclean.errors import UsageError
from handclean.runner.batch import Task, Work

HAND = ("clean", "label", "fill-gaps", "solve")
"""Commands that need a hand with markers."""

LEAST = {"clean": 4, "label": 4}
"""Markers that commands need, where one is too few: fewer points are no hand's."""

MARKER_SET = ("calibrate-hand markers",)
"""Commands that need to know what markers are called."""

SUBJECT = "--subject"
"""Where something is wrong with the subject that is not given."""


def no_hand() -> UsageError:
    """Return the error to raise where a hand is needed and none is given."""
    return UsageError(
        "is missing; 'handclean calibrate-hand markers' makes one, "
        "or --marker-set puts markers on the template hand",
        where=SUBJECT,
    )


def no_marker_set() -> UsageError:
    """Return the error to raise where a marker set is needed and none is given."""
    wrong = "is missing; it says what the markers are called"
    return UsageError(wrong, where="--marker-set")


def expect(work: Work, tasks: Sequence[Task]) -> None:
    """Expect what the command needs for at least one of its inputs.

    Where a manifest gives it for some and not for others, these fail by themselves.

    Raises
    ------
    UsageError
        If nothing gives it for any.
    """
    sources = [source for task in tasks for source in task.sources]
    if not sources or any(source.marker_set for source in sources):
        return
    if work.command in MARKER_SET:
        raise no_marker_set()
    if work.command in HAND and not any(source.subjects for source in sources):
        raise no_hand()
