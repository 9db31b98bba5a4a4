"""What a command was asked to do, in types that import nothing heavy.

A command line becomes a `Batch`; a batch and a manifest become a list of `Task`; a
worker turns a task and a `Work` (the same for all tasks) into a `Report`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Batch:
    """The options that mean the same for every command.

    Attributes
    ----------
    inputs : files named on the command line, in that order.
    manifest : a file that names more of them, "-" for stdin, or None.
    output, format : where to, and the suffix of files in a folder.
    subjects, marker_set, side : whose hands, with what markers, which of them.
    rate_hz, unit : for files that do not say; [Hz], one of mm, cm, m.
    lenient : save what can be saved of a damaged file.
    believe_coordinates : of a C3D that marks every point as missing.
    files : further files the step reads, by what they are ("calibration").
    config : the file of settings, or None.
    jobs : worker processes, None for as many as Slurm grants, else one.
    shard : "I/N" to take every N-th line from the I-th, or "".
    fail_fast : start nothing more after the first failure.
    failed : where to list the failed inputs, or None.
    overwrite : make every output anew and replace what handclean did not make.
    require : conditions such as "residual_mm<=1".
    seed : of everything random; None where nothing is.
    json, quiet, verbose : how to tell about it.
    """

    inputs: tuple[Path, ...] = ()
    manifest: str | None = None
    output: str | None = None
    format: str = ".h5"
    subjects: tuple[Path, ...] = ()
    marker_set: str = ""
    side: str = ""
    rate_hz: float | None = None
    unit: str | None = None
    lenient: bool = False
    believe_coordinates: bool = False
    files: Mapping[str, Path] = field(default_factory=dict)
    config: Path | None = None
    jobs: int | None = None
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
    number : which one of those that are made from it, or None.
    sha256 : digest of its bytes where that has been taken, else "".
    target : suffix of the first output, "" while that is not known.
    at : where a manifest names it, "takes.csv, line 3", or "".
    """

    path: Path
    is_file: bool = True
    number: int | None = None
    subjects: tuple[Path, ...] = ()
    marker_set: str = ""
    side: str = ""
    rate_hz: float | None = None
    unit: str | None = None
    lenient: bool = False
    believe_coordinates: bool = False
    files: Mapping[str, Path] = field(default_factory=dict)
    seed: int = 0
    sha256: str = ""
    target: str = ""
    at: str = ""

    @property
    def name(self) -> str:
        """What to call it."""
        return str(self.path) + ("" if self.number is None else f" {self.number}")

    @property
    def marker_set_file(self) -> Path | None:
        """The marker set as a file, or None when it is the name of a shipped one."""
        path = Path(self.marker_set)
        return path if path.suffix == ".toml" else None


@dataclass(frozen=True, kw_only=True)
class Work:
    """What is the same for all inputs.

    Attributes
    ----------
    command : as it is typed, "fill-gaps" or "calibrate-hand markers".
    settings : a frozen dataclass, or None.
    seed, overwrite, quiet : as in `Batch`.
    step : module of the step; by default that of the command.
    """

    command: str
    settings: Any = None
    seed: int | None = 0
    overwrite: bool = False
    quiet: bool = False
    step: str = ""

    @classmethod
    def of(cls, command: str, batch: Batch, settings: Any = None) -> "Work":
        """Make the work of a command."""
        return cls(
            command=command,
            settings=settings,
            seed=batch.seed,
            overwrite=batch.overwrite,
            quiet=batch.quiet,
        )

    @property
    def module(self) -> str:
        """Module that holds the step, a function of the module's own name."""
        name = self.command.replace(" ", "_").replace("-", "_")
        return self.step or f"handclean.commands.{name}"


@dataclass(frozen=True, kw_only=True)
class Task:
    """One thing to do: some sources (one, when mapping) and their outputs.

    ``token`` names the temporary files of this task and of no other.
    """

    sources: tuple[Source, ...]
    outputs: tuple[Path, ...] = ()
    token: str = ""
    reduces: bool = False


@dataclass(frozen=True, kw_only=True)
class Report:
    """How a task went.

    Attributes
    ----------
    status : "done", "skipped" or "failed".
    line, details : what was done, in a few words, and at length.
    figures : plain JSON values.
    warnings : what its owner should know, one line each.
    error : one line, when failed.
    differs : whether a comparison found a difference, when done.
    exit_status : of that failure: 1, or 2 for wrong usage.
    seconds : how long it took.
    trace : where in the code it failed, for the curious.
    """

    status: str
    line: str = ""
    details: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    error: str = ""
    differs: bool = False
    exit_status: int = 1
    seconds: float = 0.0
    trace: str = ""
