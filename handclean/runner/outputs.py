"""An output appears whole or not at all, and never over what somebody else made.

It is written near its place under a name of its own, flushed to the disk, and
renamed. A record that stands beside an output takes its place first: should the
machine stop between the two, the next run finds no output and makes it again.

Whether it may replace what stands there, `standing` says; of what handclean did not
make, or what was edited since, a copy is kept.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from handclean.errors import FileError, HandcleanError
from handclean.remarks import Remark, remark
from handclean.runner import provenance, records, staging
from handclean.runner.batch import Task
from handclean.runner.command import Command
from handclean.runner.interrupts import held_back
from handclean.runner.outcome import Entry, Outcome
from handclean.runner.records import Records
from handclean.runner.standing import State, expect_kind, is_there


def touch(task: Task) -> None:
    """Give outputs that stand the time of now, so that Make is content."""
    for path in task.outputs:
        os.utime(os.path.realpath(path))


def write(
    task: Task,
    outcome: Outcome,
    entry: Entry,
    command: Command,
    states: Mapping[Path, State] | None = None,
) -> tuple[tuple[Remark, ...], tuple[Remark, ...]]:
    """Write every output of a task and put it in its place.

    Parameters
    ----------
    entry : the record of the task.
    states : what stood in the places of the outputs before the work.

    Returns
    -------
    what the formats could not hold, and what was kept of what stood there

    Raises
    ------
    HandcleanError
        What the writers raise; then nothing has changed.
    OSError
        If a disk is full or a folder cannot be made; it names the output.
    """
    places = [Path(os.path.realpath(output)) for output in task.outputs]
    staged: dict[Path, Path] = {}
    lost: list[Remark] = []
    kept: list[Remark] = []
    try:
        for number, output in enumerate(task.outputs):
            place = places[number]
            temporary = staging.temporary(place, task.token, number)
            staged[temporary] = place
            with _naming(output, temporary):
                history = (*outcome.history, entry)
                unkept = outcome.writers[number](temporary, history) or ()
                _flush(temporary)
                if is_there(output):
                    kind = command.formats.kind
                    expect_kind(kind(place), kind(temporary), output)
                if command.records.beside(place):
                    whole = provenance.with_remarks(entry, unkept, task.about)
                    _stage_record(staged, temporary, (*outcome.history, whole))
            lost += unkept
        with held_back():
            for output, place in zip(task.outputs, places, strict=True):
                with _naming(output):
                    place.parent.mkdir(parents=True, exist_ok=True)
            for output, place in zip(task.outputs, places, strict=True):
                with _naming(output):
                    if (states or {}).get(output) is State.MISSING:
                        _expect_nothing(place, output, command.records)
                    kept += _commit(staged, place, output, command.records)
            for folder in {place.parent for place in places}:
                _flush(folder)
        return tuple(lost), tuple(kept)
    finally:
        for temporary in staged:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def _stage_record(
    staged: dict[Path, Path], temporary: Path, history: Sequence[Entry]
) -> None:
    """Write the record of what was just written; it takes its place before that."""
    place = staged.pop(temporary)
    beside = temporary.with_suffix(".json")
    staged[beside], staged[temporary] = records.sidecar(place), place
    records.write_sidecar(beside, temporary, history)
    _flush(beside)


@contextmanager
def _naming(output: Path, temporary: Path | None = None) -> Iterator[None]:
    """Let errors name the output where they name the temporary file."""
    try:
        yield
    except HandcleanError as error:
        if temporary is None or error.file is None:
            raise
        if error.file.with_suffix("") != temporary.with_suffix(""):
            raise
        raise error.in_file(output) from None
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(output)) from None


def clean(task: Task) -> None:
    """Remove what a task of another process may have left half-written."""
    staging.remove(task.outputs, task.token)


def _expect_nothing(place: Path, output: Path, known: Records) -> None:
    """Expect that nobody else put a file where none was."""
    if place.exists() and not known.of(place):
        raise FileError(output, "was made by somebody else meanwhile")


def _commit(
    staged: Mapping[Path, Path], place: Path, output: Path, known: Records
) -> list[Remark]:
    """Put an output and its record in their places; remark on what was kept."""
    sources = {target: temporary for temporary, target in staged.items()}
    parts = (*known.beside(place), place)
    kept = [keep(part, output) for part in parts if _is_foreign(part, place, known)]
    if len(parts) > 1:
        place.unlink(missing_ok=True)
    for part in parts:
        os.replace(sources[part], part)
    return kept


def _is_foreign(part: Path, place: Path, known: Records) -> bool:
    """Whether handclean did not make what stands in the place of an output."""
    if not part.exists():
        return False
    if part != place:
        return not records.is_record(part)
    return not known.of(part) or known.intact(part) is False


def keep(place: Path, output: Path) -> Remark:
    """Keep a file that will be replaced as ``NAME~``, or ``NAME~2`` ...; remark on it.

    Parameters
    ----------
    place : the file.
    output : what the user called it, or what it stands beside.

    Raises
    ------
    OSError
        If it cannot be kept.
    """
    number = 1
    called = output.with_name(place.name)
    while True:
        other = place.with_name(f"{place.name}~{number if number > 1 else ''}")
        number += 1
        if other.is_file() and records.digest(other) == records.digest(place):
            break
        try:
            os.link(place, other)
        except FileExistsError:
            continue
        except OSError:  # a disk without hard links
            if os.path.lexists(other):
                continue
            os.rename(place, other)
        break
    text = f"the {called} that stood there is kept as {other.name}"
    return remark("replaced", text, kept=other.name)


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
