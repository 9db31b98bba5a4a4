"""Which file a path leads to: nothing that is read is written, nothing written twice.

A file that is there is known by device and number, so that links, hard links and every
spelling of its path give the same. A place where none is yet is known by the nearest
folder that is there and the names below it; case and the composition of letters do not
count where that folder does not tell them apart.
"""

import os
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path

from handclean.errors import UsageError
from handclean.runner.batch import Task
from handclean.runner.records import Records

_TRIED_NAMES = 16
"""Names of a folder that are tried for whether their case counts (chosen)."""


def identity(path: Path) -> object:
    """Name the file a path leads to so that every way to it gives the same."""
    place = Path(os.path.realpath(path))
    try:
        status = place.stat()
    except OSError:
        return _future(place)
    return status.st_dev, status.st_ino


def _future(place: Path) -> object:
    folder = nearest(place)
    below = str(place.relative_to(folder))
    if ignores_case(folder):
        below = unicodedata.normalize("NFC", below).casefold()
    status = folder.stat()
    return status.st_dev, status.st_ino, below


def nearest(place: Path) -> Path:
    """Return the nearest folder above an absolute path that is there."""
    return next(folder for folder in place.parents if os.path.isdir(folder))


def ignores_case(folder: Path) -> bool:
    """Whether names in a folder that differ only in case are one, as far as is seen.

    Nothing is written to find out: names that are there are looked up in other case.
    """
    try:
        with os.scandir(folder) as entries:
            some = [entry.name for entry in islice(entries, _TRIED_NAMES)]
    except OSError:
        some = []
    names = [folder / name for name in some] + [folder]
    for path in names:
        other = path.with_name(path.name.swapcase()) if path.name else path
        if other != path:
            return _is_same(path, other)
    return False


def _is_same(one: Path, other: Path) -> bool:
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False


def read_by(tasks: Iterable[Task], records: Records) -> list[Path]:
    """List all files that tasks read, records beside them too."""
    sources = (source for task in tasks for source in task.sources)
    return records.with_theirs(path for s in sources for path in s.reads.values())


def written_by(tasks: Iterable[Task], records: Records) -> list[Path]:
    """List all files that tasks write, records beside them too."""
    return records.with_theirs(path for task in tasks for path in task.outputs)


def expect_apart(
    tasks: Sequence[Task], records: Records, read: Iterable[Path] = ()
) -> None:
    """Expect every output in a place of its own where nothing is read.

    Parameters
    ----------
    records : where the records of files stand, which count as well.
    read : files that the command reads beside those of its tasks.

    Raises
    ------
    UsageError
        If two outputs are one file, or an output is one of the files read.
    """
    if not any(task.outputs for task in tasks):
        return
    used = {identity(path) for path in (*read, *read_by(tasks, records))}
    taken: dict[object, str] = {}
    for task in tasks:
        for output in task.outputs:
            for path in (output, *records.beside(output)):
                known = identity(path)
                if known in used:
                    wrong = "is read as well as written; -o should name another place"
                    raise UsageError(wrong, where=path)
                if known in taken:
                    raise UsageError(
                        f"would be written twice, from {taken[known]} and from "
                        f"{task.sources[0].name}",
                        where=path,
                    )
                taken[known] = task.sources[0].name


def expect_unused(
    path: Path, tasks: Sequence[Task], records: Records, read: Iterable[Path] = ()
) -> None:
    """Expect that no task reads or writes a file; parameters as of `expect_apart`.

    Raises
    ------
    UsageError
        If one does.
    """
    known = identity(path)
    used = [*read_by(tasks, records), *written_by(tasks, records)]
    if known in map(identity, [*read, *used]):
        wrong = "is also an input or an output of this command"
        raise UsageError(wrong, where=path)
