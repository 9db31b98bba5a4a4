"""Do one task and say how it went; whatever goes wrong, it is a report."""

import glob
import time
import traceback
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import threadpoolctl

from handclean.errors import TAKE, FileError, HandcleanError, TakeNumber
from handclean.remarks import Remark
from handclean.runner import (
    conditions,
    interrupts,
    outputs,
    provenance,
    read_remarks,
    records,
    standing,
    steps,
    terminal,
)
from handclean.runner.batch import Report, Source, Task
from handclean.runner.command import Work
from handclean.runner.compiling import Notice, silent, watching
from handclean.runner.outcome import Outcome
from handclean.runner.places import written_by
from handclean.runner.standing import State

Step = Callable[[Any, Any], Outcome]


def execute(work: Work, task: Task, notice: Notice = silent) -> Report:
    """Do one task; any failure is a report, except that of a signal.

    A failed one still says what was odd about the takes it had read.
    ``notice`` is called when a kernel is about to be compiled.
    """
    started = time.perf_counter()
    with read_remarks.collected() as odd, steps.collected() as taken:
        report = _attempt(work, task, notice)
    if report.status == "failed":
        report = replace(report, remarks=read_remarks.all_of(odd))
    seconds = round(time.perf_counter() - started, 3)
    return replace(report, about=task.about, seconds=seconds, steps=taken)


def _attempt(work: Work, task: Task, notice: Notice) -> Report:
    where = task.sources[0].name
    try:
        report = _do(work, task, notice)
    except HandcleanError as error:
        report = _failed(_placed(work, task, error), exit_status=error.exit_status)
    except MemoryError:
        report = _failed(f"{where}: there is not enough memory for it")
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        report = _failed(f"{error.filename or where}: {reason}")
    except Exception as error:
        interrupts.raise_swallowed()
        text = f"{where}: internal error, please report it: {type(error).__name__}: "
        report = _failed(text + str(error), trace=traceback.format_exc())
    interrupts.raise_swallowed()
    return report


def figures_of(work: Work) -> dict[str, str]:
    """Names and meanings of the figures a step reports."""
    figures: dict[str, str] = import_module(work.command.step).FIGURES
    return figures


def _placed(work: Work, task: Task, error: HandcleanError) -> str:
    """Let an error that names no file of the task begin with its input.

    What is wrong with another file that a line of a manifest gives, or with what that
    line does not give, names input and line.
    """
    where, file = task.sources[0].name, error.file
    if error.where == TAKE:
        return str(error.at(where))
    if isinstance(error.where, TakeNumber):
        return str(error.at(task.sources[error.where.number].name))
    if file in (*_inputs(task), *written_by([task], work.command.records)):
        return str(error)
    for source in task.sources:
        given = file in source.reads.values()
        if source.at and (given or error.where in _options_of(source)):
            return f"{source.name}: {error} ({source.at})"
        if given:
            return str(error)
    return f"{where}: {error}"


def _options_of(source: Source) -> list[str]:
    """Options in whose place a manifest may have a column."""
    return [f"--{column.replace('_', '-')}" for column in source.given.columns]


def _inputs(task: Task) -> list[Path]:
    return [source.path for source in task.sources]


def _failed(error: str, **parts: Any) -> Report:
    text = terminal.shortened(" ".join(error.split()))
    return Report(status="failed", error=text, **parts)


def _do(work: Work, task: Task, notice: Notice) -> Report:
    for source in task.sources:
        _expect_made(source)
        if source.is_file:
            _expect_file(source.path, work.command.formats.usual)
        source.given.expect_found()
    if not task.outputs:
        outcome = _outcome(work, task, notice)
        return _done(provenance.plain(outcome.figures), outcome)
    digests = {
        path: records.digest(path)
        for source in task.sources
        for path in source.reads.values()
    }
    begun = provenance.entry(work, task, digests)
    states = {path: standing.state(path, begun, work, digests) for path in task.outputs}
    if set(states.values()) == {State.SAME}:
        outputs.touch(task)
        made = work.command.records.of(task.outputs[0])[-1]
        return Report(
            status="skipped",
            line=made.get("line", ""),
            figures=made.get("figures", {}),
            remarks=provenance.remarks_of(made, task),
        )
    target = task.outputs[0].suffix.lower()
    sources = tuple(
        replace(source, sha256=digests.get(source.path, ""), target=target)
        for source in task.sources
    )
    outcome = _outcome(work, replace(task, sources=sources), notice)
    entry = provenance.finished(
        begun,
        outcome.figures,
        outcome.remarks,
        line=outcome.line,
        about=task.about,
    )
    with steps.step("write"):
        lost, stood = outputs.write(task, outcome, entry, work.command, states)
    return _done(entry["figures"], outcome, (*lost, *stood))


def _expect_made(source: Source) -> None:
    """Expect a file that an earlier command should have made.

    Raises
    ------
    HandcleanError
        If that failed.
    """
    if source.failed:
        wrong = f"was not made, as an earlier command failed: {source.failed}"
        raise HandcleanError(wrong, where=source.path)


def _expect_file(path: Path, usual: Sequence[str]) -> None:
    """Expect no folder and no pattern where a file should be named.

    Parameters
    ----------
    usual : suffixes of inputs, the most usual one first.

    Raises
    ------
    FileError
        If it is one.
    """
    if path.is_dir():
        some = Counter(p.suffix for p in path.iterdir() if p.suffix in usual)
        suffix = min(some, key=lambda s: (-some[s], s), default=usual[0])
        right = f"give its files, such as {path / '*'}{suffix}"
        raise FileError(path, "is a folder", right)
    if glob.has_magic(str(path)) and not path.exists():
        count = len(glob.glob(str(path)))
        those = f"{count} files that match" if count > 1 else "one file that matches"
        right = f"without quotes it is the {those} it"
        right = right if count else "as a pattern it matches none either"
        raise FileError(path, "no such file", right)


def _done(
    figures: dict[str, Any], outcome: Outcome, lost: tuple[Remark, ...] = ()
) -> Report:
    return Report(
        status="done",
        line=outcome.line,
        details=outcome.details,
        figures=figures,
        remarks=(*outcome.remarks, *lost),
        differs=outcome.differs,
    )


def _outcome(work: Work, task: Task, notice: Notice) -> Outcome:
    command = work.command
    with command.formats.reading(task.sources) as broken:
        with steps.step("import"):
            module = import_module(command.step)
        step: Step = getattr(module, command.step.rsplit(".", 1)[-1])
        given: Source | tuple[Source, ...]
        given = task.sources if task.reduces else task.sources[0]
        with threadpoolctl.threadpool_limits(1), watching(notice):
            try:
                outcome = step(given, work.settings)
            finally:
                read_remarks.note(None, broken)
    once = dict.fromkeys((*broken, *outcome.remarks))
    outcome = replace(outcome, remarks=tuple(once))
    unknown = [n for n in outcome.figures if not conditions.is_known(n, module.FIGURES)]
    assert not unknown, f"figures without a meaning: {unknown}"
    assert len(outcome.writers) == len(task.outputs), "a writer for each output"
    return outcome


def gone(task: Task, cause: str) -> Report:
    """Report a task whose worker is no more, and clear up after it."""
    outputs.clean(task)
    return _failed(f"{task.sources[0].name}: {cause}")
