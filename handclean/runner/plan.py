"""From what was asked for to tasks: which input becomes which output.

With one input, ``-o`` may be a file whose suffix picks the format. Otherwise it is a
folder: inputs keep their path below their common parent, and ``--format`` gives the
suffix. All of it is settled on the whole list, before a shard is taken, so an output's
place does not depend on shards.
"""

import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from handclean.errors import UnknownSettingError, UsageError
from handclean.runner import folders, manifest
from handclean.runner.batch import Batch, Source, Task
from handclean.runner.command import Command
from handclean.runner.manifest import Line
from handclean.runner.places import expect_apart
from handclean.runner.staging import token


def lines_of(batch: Batch, suffixes: Collection[str] = ()) -> tuple[Line, ...]:
    """List the inputs of the command line, then those of its manifest.

    Parameters
    ----------
    suffixes : of the files that are taken where a folder stands for those below it.

    Raises
    ------
    UsageError
        If there are none, the manifest is wrong, or nothing is in a folder.
    """
    lines = tuple(Line(input=path) for path in batch.inputs)
    if batch.manifest is not None:
        lines += manifest.read(batch.manifest, batch.given.columns)
    elif not lines:
        raise UsageError("inputs: there are none; name files, or a --manifest of them")
    return folders.with_files(batch, lines, suffixes) if batch.recursive else lines


def included(lines: Sequence[Line]) -> tuple[Line, ...]:
    """Return the lines that are not left out."""
    return tuple(line for line in lines if not line.excluded)


def mapping(batch: Batch, lines: Sequence[Line], command: Command) -> list[Task]:
    """Plan a command whose every input gives one output (none without suffixes).

    Inputs that are left out have a place, too, but no task.

    Raises
    ------
    UsageError
        If an output has no place or an unknown suffix, if two inputs would share one,
        or if one is an input itself.
    """
    if not command.suffixes:
        return [Task(sources=(_source(batch, line),)) for line in included(lines)]
    outputs = _outputs(batch, lines, command.suffixes)
    tasks = [
        Task(sources=(_source(batch, line),), outputs=(output,), token=token())
        for line, output in zip(lines, outputs, strict=True)
        if not line.excluded
    ]
    expect_apart(tasks, command.records, batch.reads)
    return tasks


def in_folders(
    batch: Batch,
    lines: Sequence[Line],
    command: Command,
    names: Sequence[str] = (),
    beside: Sequence[Path] = (),
) -> list[Task]:
    """Plan a command that may write files of fixed names for every input.

    Those of one input go into the folder ``-o``; of several each has a folder below it,
    which keeps the input's path below their common parent. Without ``-o`` there are
    none.

    Parameters
    ----------
    names : what the files are called.
    beside : further outputs, with any suffix, of one input.

    Raises
    ------
    UsageError
        If ``-o`` names a file, if there is a file beside several inputs, if two inputs
        would share a folder, or if an output is an input itself.
    """
    if beside and len(lines) > 1:
        wrong = f"is one file for {len(lines)} inputs; give one input, or -o"
        raise UsageError(wrong, where=beside[0])
    folders: list[Path | None] = [None] * len(lines)
    if batch.output is not None:
        top = Path(batch.output)
        if not _is_folder(batch.output):
            raise UsageError("should be a folder", where=top)
        parent = _common_parent(lines)
        below = [Path(_below(line.input, parent)).with_suffix("") for line in lines]
        folders = [top / part for part in below] if len(lines) > 1 else [top]
    tasks = [
        Task(
            sources=(_source(batch, line),),
            outputs=(*(folder / name for name in names if folder), *beside),
            token=token(),
        )
        for line, folder in zip(lines, folders, strict=True)
        if not line.excluded
    ]
    expect_apart(tasks, command.records, batch.reads)
    return tasks


def reducing(
    batch: Batch,
    lines: Sequence[Line],
    command: Command,
    beside: Sequence[Path] = (),
) -> Task:
    """Plan a command whose inputs together give one output (none without suffixes).

    Parameters
    ----------
    beside : further outputs, with any suffix.

    Raises
    ------
    UsageError
        As `mapping`.
    """
    sources = tuple(_source(batch, line) for line in included(lines))
    if not sources:
        where = batch.manifest or "inputs"
        raise UsageError("the manifest lists no takes", where=where)
    if not command.suffixes:
        return Task(sources=sources, reduces=True)
    if batch.output is None:
        raise UsageError("-o: is missing; it should name a file")
    output = Path(batch.output)
    _expect_suffix(output, output.suffix, command.suffixes)
    outputs = (output, *beside)
    task = Task(sources=sources, outputs=outputs, token=token(), reduces=True)
    expect_apart([task], command.records, batch.reads)
    return task


def _source(batch: Batch, line: Line) -> Source:
    return Source(
        path=line.input,
        given=batch.given.with_cells(line.cells, line.at).for_input(line.input),
        files=batch.files,
        seed=batch.seed or 0,
        at=line.at,
        failed=line.failed,
    )


def _outputs(
    batch: Batch, lines: Sequence[Line], suffixes: Sequence[str]
) -> list[Path]:
    unplaced = [line for line in lines if not line.output]
    places = iter(_places(batch, unplaced, suffixes) if unplaced else ())
    outputs = [Path(line.output) if line.output else next(places) for line in lines]
    for output in outputs:
        _expect_suffix(output, output.suffix, suffixes)
    return outputs


def _places(batch: Batch, lines: Sequence[Line], suffixes: Sequence[str]) -> list[Path]:
    """Give the inputs that name no output themselves a place under ``-o``."""
    if batch.output is None:
        raise UsageError("-o: is missing; it should name a file or a folder")
    output = Path(batch.output)
    if not _is_folder(batch.output):
        if len(lines) == 1 and lines[0].folder is None:
            return [output]
        inputs = f"{len(lines)} inputs" if len(lines) > 1 else "the files of a folder"
        raise UsageError(
            f"is one file for {inputs}; -o should name a folder", where=output
        )
    suffix = batch.format or suffixes[0]
    _expect_suffix("--format", suffix, suffixes)
    parent = _common_parent(lines)
    return [(output / _below(line.input, parent)).with_suffix(suffix) for line in lines]


def _is_folder(output: str) -> bool:
    """Whether ``-o`` names a folder: there is one, it ends in /, or has no suffix."""
    if os.path.isdir(output) or output.endswith(("/", os.sep)):
        return True
    return not Path(output).suffix


def _expect_suffix(where: Path | str, suffix: str, suffixes: Collection[str]) -> None:
    if not suffix:
        raise UsageError(f"should end in {' or '.join(suffixes)}", where=where)
    if suffix.lower() not in suffixes:
        raise UnknownSettingError(where, "format for writing", suffix, suffixes)


def _common_parent(lines: Iterable[Line]) -> str:
    """The folder above all inputs; what is in a folder that was named stays below it.

    So the place of an output does not depend on what else is in that folder.
    """
    parents = {
        os.path.abspath(line.folder or os.path.dirname(os.path.abspath(line.input)))
        for line in lines
    }
    return os.path.commonpath(parents)


def _below(path: Path, parent: str) -> str:
    return os.path.relpath(os.path.abspath(path), parent)


def failed_lines(tasks: Iterable[Task], lines: Iterable[Line]) -> list[Line]:
    """Lines of tasks, each saying where its output belongs."""
    return [
        replace(line, output=str(task.outputs[0]) if task.outputs else "")
        for task, line in zip(tasks, lines, strict=True)
    ]
