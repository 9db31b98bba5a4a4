"""What a command was asked to do, in types that import nothing heavy.

A command line becomes a `Batch`; a batch and a manifest become a list of `Task`; a
worker turns a task into a `Report`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, Self

from handclean.remarks import Remark


class Given(Protocol):
    """What is said of an input that only the steps understand; never changed."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns that a manifest may have for it; each is an option's name, too."""
        ...

    def with_cells(self, cells: Mapping[str, str], at: str) -> Self:
        """Return it with what a line of a manifest says instead.

        Parameters
        ----------
        cells : by column; those that are empty are left out.
        at : where the line stands.

        Raises
        ------
        UsageError
            If a cell says what cannot be.
        """
        ...

    def for_input(self, path: Path) -> Self:
        """Return it with what is found by a pattern for one input.

        Raises
        ------
        UsageError
            If the pattern is none.
        """
        ...

    def expect_found(self) -> None:
        """Expect that a pattern found something for the input.

        Raises
        ------
        UsageError
            If it did not.
        """
        ...

    def files(self) -> Mapping[str, Path]:
        """Files that it makes a step read, by role: "subject 1", "subject 2"."""
        ...

    def record(self) -> Mapping[str, Any]:
        """What else of it decides what comes out; None or "" where nothing is said."""
        ...


@dataclass(frozen=True)
class NothingGiven:
    """Nothing is said of an input."""

    columns: tuple[str, ...] = ()

    def with_cells(self, cells: Mapping[str, str], at: str) -> Self:
        """Return it as it is, as there are no columns."""
        return self

    def for_input(self, path: Path) -> Self:
        """Return it as it is, as there are no patterns."""
        return self

    def expect_found(self) -> None:
        """Expect nothing."""

    def files(self) -> Mapping[str, Path]:
        """Return no files."""
        return {}

    def record(self) -> Mapping[str, Any]:
        """Return nothing."""
        return {}


NOTHING_GIVEN = NothingGiven()


@dataclass(frozen=True, kw_only=True)
class Batch:
    """The options that mean the same for every command.

    Attributes
    ----------
    inputs : files named on the command line, in that order.
    recursive : an input that is a folder stands for the files below it.
    manifest : a file that names more of them, "-" for stdin, or None.
    output, format : where to, and the suffix of files in a folder; by default that of
        the command.
    given : what is said of all inputs that only the steps understand.
    files : further files the step reads, by what they are ("calibration").
    config : the file of settings, or None.
    jobs : worker processes, None for as many as Slurm grants, else one; on a cluster
        tasks at a time, None for as many as there is room for.
    scheduler : address of the cluster that does the tasks, "" for this machine.
    shard : "I/N" to take every N-th line from the I-th, or "".
    fail_fast : start nothing more after the first failure.
    failed : where to list the failed inputs, or None.
    overwrite : make every output anew and replace what handclean did not make.
    require : conditions such as "residual_mm<=1".
    seed : of everything random; None where nothing is.
    json, quiet, verbose : how to tell about it.
    """

    inputs: tuple[Path, ...] = ()
    recursive: bool = False
    manifest: str | None = None
    output: str | None = None
    format: str = ""
    given: Given = NOTHING_GIVEN
    files: Mapping[str, Path] = field(default_factory=dict)
    config: Path | None = None
    jobs: int | None = None
    scheduler: str = ""
    shard: str = ""
    fail_fast: bool = False
    failed: Path | None = None
    overwrite: bool = False
    require: tuple[str, ...] = ()
    seed: int | None = 0
    json: bool = False
    quiet: bool = False
    verbose: bool = False

    @property
    def reads(self) -> tuple[Path, ...]:
        """Files that are read for the command as a whole."""
        named = Path(self.manifest) if self.manifest not in (None, "-") else None
        return tuple(path for path in (named, self.config) if path is not None)


@dataclass(frozen=True, kw_only=True)
class Source:
    """One input with all that is given about it; other fields as in `Batch`.

    Attributes
    ----------
    path : the file; or, with ``is_file`` false, the name of something built in.
    given : what is said of it that only the step understands.
    number : which one of those that are made from it, or None.
    sha256 : digest of its bytes where that has been taken, else "".
    target : suffix of the first output, "" while that is not known.
    at : where a manifest names it, "takes.csv, line 3", or "".
    failed : why an earlier command could not make it, or "".
    """

    path: Path
    is_file: bool = True
    number: int | None = None
    given: Given = NOTHING_GIVEN
    files: Mapping[str, Path] = field(default_factory=dict)
    seed: int = 0
    sha256: str = ""
    target: str = ""
    at: str = ""
    failed: str = ""

    @property
    def name(self) -> str:
        """What to call it."""
        return str(self.path) + ("" if self.number is None else f" {self.number}")

    @property
    def reads(self) -> dict[str, Path]:
        """Files that it makes its step read, by their role."""
        own = {"input": self.path} if self.is_file else {}
        return own | dict(self.given.files()) | dict(self.files)


@dataclass(frozen=True, kw_only=True)
class Task:
    """One thing to do: some sources (one, when mapping) and their outputs.

    ``token`` names the temporary files of this task and of no other.
    """

    sources: tuple[Source, ...]
    outputs: tuple[Path, ...] = ()
    token: str = ""
    reduces: bool = False

    @property
    def about(self) -> Path | None:
        """The file that what is said of the task need not name: its only input."""
        return self.sources[0].path if len(self.sources) == 1 else None


@dataclass(frozen=True, kw_only=True)
class Report:
    """How a task went.

    Attributes
    ----------
    status : "done", "skipped" or "failed".
    line, details : what was done, in a few words, and at length.
    figures : plain JSON values.
    remarks : what its owner should know.
    about : the file that its texts need not name, the only one of the task.
    error : one line, when failed.
    differs : whether a comparison found a difference, when done.
    exit_status : of that failure: 1, or 2 for wrong usage.
    seconds : how long it took.
    steps : [s] and its steps.
    trace : where in the code it failed, for the curious.
    """

    status: str
    line: str = ""
    details: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    remarks: tuple[Remark, ...] = ()
    about: Path | None = None
    error: str = ""
    differs: bool = False
    exit_status: int = 1
    seconds: float = 0.0
    steps: Mapping[str, float] = field(default_factory=dict)
    trace: str = ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Texts of the remarks, each with its file unless that is what it is about."""
        return tuple(one.said(self.about) for one in self.remarks)
