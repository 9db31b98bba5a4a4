"""An output appears whole or not at all, and never over what somebody else made.

It is written near its place under a name of its own, flushed to the disk, and
renamed. A record that stands beside an output takes its place first: should the
machine stop between the two, the next run finds no output and makes it again.
"""

import os
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import Enum
from pathlib import Path

from handclean.errors import FileError, HandcleanError
from handclean.pipeline import record
from handclean.pipeline.batch import Task
from handclean.pipeline.interrupts import held_back
from handclean.pipeline.outcome import Entry, Outcome


class State(Enum):
    """What stands where an output belongs."""

    MISSING = "nothing"
    SAME = "made by the same record"
    OTHER = "made by another record"


def state(path: Path, begun: Entry, overwrite: bool) -> State:
    """Look at the place of an output.

    Raises
    ------
    FileError
        If something stands there that handclean did not make (unless ``overwrite``),
        or that is no file at all.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return State.MISSING
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FileError(path, f"cannot be written: {reason}") from None
    if not stat.S_ISREG(mode):
        raise FileError(path, "is not a file", "name one that can be written")
    if overwrite:
        return State.OTHER
    made = record.of(path)
    intact = record.intact(path)
    if not made or intact is False:
        raise FileError(
            path,
            "is there already and not (or no longer) as handclean made it",
            "--overwrite replaces it",
        )
    is_same = bool(intact) and record.same(made[-1], begun)
    return State.SAME if is_same else State.OTHER


def touch(task: Task) -> None:
    """Give outputs that stand the time of now, so that Make is content."""
    for path in task.outputs:
        os.utime(path)


def write(task: Task, outcome: Outcome, entry: Entry) -> tuple[str, ...]:
    """Write every output of a task and put it in its place.

    Returns
    -------
    what the formats could not hold, one line each

    Raises
    ------
    HandcleanError
        What the writers raise; then nothing has changed.
    OSError
        If a disk is full or a folder cannot be made.
    """
    places = [Path(os.path.realpath(path)) for path in task.outputs]
    try:
        staged: dict[Path, Path] = {}
        warnings: list[str] = []
        for number, (place, writer) in enumerate(
            zip(places, outcome.writers, strict=True)
        ):
            temporary = _temporary(task, number, place)
            with _naming(temporary, task.outputs[number]):
                warned = writer(temporary, (*outcome.history, entry)) or ()
            warnings += warned
            _flush(temporary)
            if place.suffix.lower() != ".h5":
                beside = temporary.with_suffix(".json")
                told = _warned(entry, warned)
                record.write_sidecar(beside, temporary, (*outcome.history, told))
                _flush(beside)
                staged[beside] = record.sidecar(place)
            staged[temporary] = place
        with held_back():
            _commit(staged, places)
        return tuple(warnings)
    finally:
        clean(task)


def _warned(entry: Entry, warnings: Sequence[str]) -> Entry:
    if not warnings:
        return entry
    return {**entry, "warnings": [*entry["warnings"], *warnings]}


@contextmanager
def _naming(temporary: Path, output: Path) -> Iterator[None]:
    """Let errors name the output where they name the temporary file."""
    try:
        yield
    except HandcleanError as error:
        if error.file != temporary:
            raise
        raise error.in_file(output) from None
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(output)) from None


def clean(task: Task) -> None:
    """Remove what a task may have left half-written."""
    for number, path in enumerate(task.outputs):
        place = Path(os.path.realpath(path))
        for folder in place.parents:
            temporary = folder / _name(task, number, place)
            temporary.unlink(missing_ok=True)
            temporary.with_suffix(".json").unlink(missing_ok=True)


def _commit(staged: Mapping[Path, Path], places: Sequence[Path]) -> None:
    for place in places:
        place.parent.mkdir(parents=True, exist_ok=True)
        if record.sidecar(place) in staged.values():
            place.unlink(missing_ok=True)
    for temporary, place in staged.items():
        os.replace(temporary, place)
    for folder in {place.parent for place in places}:
        _flush(folder)


def _temporary(task: Task, number: int, place: Path) -> Path:
    """Where to write first: the nearest folder above the place that is there.

    It is on the same disk, and folders are made only for outputs that succeed.
    """
    folder = next(folder for folder in place.parents if folder.is_dir())
    return folder / _name(task, number, place)


def _name(task: Task, number: int, place: Path) -> str:
    """A name that is short, hidden, nobody else's, and has the suffix of the place."""
    return f".handclean-{task.token}-{number}{place.suffix}"


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
