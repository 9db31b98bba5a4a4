"""What commands cannot do without: looked at before the first input."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module

from handclean.commands.shared.take_options import options_of
from handclean.errors import UsageError
from handclean.runner.batch import Batch, Task


@dataclass(frozen=True, kw_only=True)
class Needs:
    """The check of a command that looks at hands.

    Attributes
    ----------
    hand : whether it needs a hand with markers.
    marked : whether hands should have markers, where one is given.
    markers : how many, where one is too few.
    marker_set : whether it needs to know what markers are called.
    """

    hand: bool = False
    marked: bool = False
    markers: int = 1
    marker_set: bool = False

    def __call__(self, batch: Batch, tasks: Sequence[Task]) -> None:
        """Find what is wrong with subjects, marker set and prior, or missing.

        Raises
        ------
        UsageError
            If one of those on the command line is not there or not one, or if the
            command needs what nothing gives to any of its inputs. Where a manifest
            gives it for some and not for others, these fail by themselves.
        """
        options = options_of(batch)
        if options.subjects and options.subject_for:
            wrong = "says for each take whose hand it is; leave --subject out"
            raise UsageError(wrong, where="--subject-for")
        if options.subjects or options.marker_set or "prior" in batch.files:
            hands = import_module("handclean.commands.shared.hands")  # late
            marked = self.hand or self.marked
            hands.check(batch, marked=marked, least=self.markers)
        of_takes = [options_of(source) for task in tasks for source in task.sources]
        if not of_takes or any(take.marker_set for take in of_takes):
            return
        if self.marker_set:
            raise no_marker_set()
        if self.hand and not any(take.subjects or take.unfound for take in of_takes):
            raise no_hand()


def no_hand() -> UsageError:
    """Return the error to raise where a hand is needed and none is given."""
    return UsageError(
        "is missing; 'handclean calibrate-hand markers' makes one, "
        "or --marker-set puts markers on the template hand",
        where="--subject",
    )


def no_marker_set() -> UsageError:
    """Return the error to raise where a marker set is needed and none is given."""
    wrong = "is missing; it says what the markers are called"
    return UsageError(wrong, where="--marker-set")
