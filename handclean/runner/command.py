"""What the runner is told of a command, and the work that is done with it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from handclean.runner.batch import Batch, Task
from handclean.runner.records import Formats, Records

Check = Callable[[Batch, Sequence[Task]], None]
"""Finds what is wrong with a request before the first input, and raises it."""


def _compiling() -> str:
    return "compiling kernels ..."


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command, as far as the runner has to know it.

    Attributes
    ----------
    name : as it is typed and as records keep it.
    step : module of the step, which is a function of the module's own name; it is
        imported when it is needed.
    formats : what answers the runner's questions about files.
    reads : suffixes of the files of a folder that are inputs.
    suffixes : what outputs may end in, the usual one first; empty if it writes none.
    makes : kind of what it makes by suffix, where that does not depend on what it
        reads; so that a wrong place is found before the work is done.
    check : looks at the request before anything is done.
    compiling : asked what to say when the step compiles kernels.
    """

    name: str
    step: str
    formats: Formats
    reads: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    makes: Mapping[str, str] = field(default_factory=dict)
    check: Check | None = None
    compiling: Callable[[], str] = _compiling

    @property
    def records(self) -> Records:
        """Where the records of files stand."""
        return Records(self.formats)

    def expect_right(self, batch: Batch, tasks: Sequence[Task]) -> None:
        """Check a request as a whole.

        Raises
        ------
        UsageError
            If something is wrong with it.
        """
        if self.check is not None:
            self.check(batch, tasks)


@dataclass(frozen=True, kw_only=True)
class Work:
    """What is the same for all inputs.

    Attributes
    ----------
    command : what is done with each.
    settings : a frozen dataclass, or None.
    seed, overwrite, quiet : as in `Batch`.
    """

    command: Command
    settings: Any = None
    seed: int | None = 0
    overwrite: bool = False
    quiet: bool = False

    @classmethod
    def of(cls, command: Command, batch: Batch, settings: Any = None) -> "Work":
        """Make the work of a command."""
        return cls(
            command=command,
            settings=settings,
            seed=batch.seed,
            overwrite=batch.overwrite,
            quiet=batch.quiet,
        )
