"""``--recursive``: an input that is a folder stands for the files below it.

Taken are files that the command reads, by their suffix, in the order of their names.
Left out are hidden files and folders, what the command reads beside its inputs (the
subjects of takes, a manifest), its list of failed inputs, and what is below ``-o``.
"""

import os
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from handclean.errors import UsageError
from handclean.runner.batch import Batch
from handclean.runner.manifest import Line
from handclean.runner.places import identity


def with_files(
    batch: Batch, lines: Sequence[Line], suffixes: Collection[str]
) -> tuple[Line, ...]:
    """Return lines in which the files below a folder stand in its place.

    Parameters
    ----------
    suffixes : of the files that are taken, in lower case.

    Raises
    ------
    UsageError
        If a folder cannot be read, or there is no such file below it.
    """
    output = None
    if batch.output is not None and os.path.isdir(batch.output):
        output = identity(Path(batch.output))
    found: list[Line] = []
    for line in lines:
        if not line.input.is_dir():
            found.append(line)
            continue
        files = [
            path
            for path in _below(line.input, output, set())
            if path.suffix.lower() in suffixes
        ]
        files = _without_read(batch, line, files)
        if not files:
            known = " ".join(sorted(suffixes))
            wrong = f"has no file below it that the command reads ({known})"
            raise UsageError(wrong, where=line.input)
        found += [replace(line, input=path, folder=line.input) for path in files]
    return tuple(found)


def _below(folder: Path, output: object, seen: set[object]) -> Iterator[Path]:
    """Yield the files below a folder; a folder that links lead to again is passed over.

    Parameters
    ----------
    output : the folder of outputs, which is passed over unless it is the first.
    seen : folders on the way.
    """
    seen.add(identity(folder))
    try:
        with os.scandir(folder) as entries:
            names = sorted(e.name for e in entries if not e.name.startswith("."))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise UsageError(f"cannot be read: {reason}", where=folder) from None
    for name in names:
        path = folder / name
        if not path.is_dir():
            yield path
        elif identity(path) not in {output, *seen}:
            yield from _below(path, output, seen)


def _without_read(batch: Batch, line: Line, files: Sequence[Path]) -> list[Path]:
    """Leave out what the command reads beside its inputs, and its list of failed."""
    given = batch.given.with_cells(line.cells, line.at)
    read = [*batch.reads, *batch.files.values(), *given.files().values()]
    read += [batch.failed] if batch.failed is not None else []
    for path in files:
        read += given.for_input(path).files().values()
    known = {identity(path) for path in dict.fromkeys(read)}
    return [path for path in files if identity(path) not in known]
