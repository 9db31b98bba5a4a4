"""What a command cannot do without: looked at before the first input."""

from collections.abc import Sequence

from handclean.errors import UsageError
from handclean.pipeline.batch import Task, Work

HAND = ("clean", "label", "fill-gaps", "solve")
"""Commands that need a hand with markers."""

LEAST = {"clean": 4, "label": 4}
"""Markers that commands need, where one is too few: fewer points are no hand's."""

MARKER_SET = ("calibrate-hand markers",)
"""Commands that need to know what markers are called."""

NO_HAND = (
    "--subject: is missing; 'handclean calibrate-hand markers' makes one, "
    "or --marker-set puts markers on the template hand"
)
NO_MARKER_SET = "--marker-set: is missing; it says what the markers are called"


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
        raise UsageError(NO_MARKER_SET)
    if work.command in HAND and not any(source.subjects for source in sources):
        raise UsageError(NO_HAND)
