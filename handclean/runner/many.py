"""Run a step over many inputs: shards, jobs, resume, and one exit status."""

import os
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager, redirect_stdout
from functools import partial
from pathlib import Path

from handclean.errors import UsageError
from handclean.runner import (
    conditions as require,
)
from handclean.runner import (
    failed,
    manifest,
    plan,
    staging,
    terminal,
)
from handclean.runner.batch import Batch, Report, Task
from handclean.runner.command import Command, Work
from handclean.runner.compiling import Once, silent, to_stderr
from handclean.runner.conditions import Condition
from handclean.runner.console import Console
from handclean.runner.execute import execute, figures_of
from handclean.runner.manifest import Line
from handclean.runner.workers import in_workers

Reports = Generator[tuple[int, Report], None, None]

DoAll = Callable[[Work, Sequence[Task], Callable[[], bool]], Reports]
"""Yields the index and the report of every task as it ends, in any order; those that
may not begin any more, as the last asks, are not among them."""

FAILED, WRONG_USAGE, NOT_MET = 1, 2, 3
"""Exit statuses beside 0: an input failed, wrong usage or configuration, a requirement
was not met."""

DIFFERENT = 1
"""The exit status of ``inspect --verify`` where two readers differ."""


Plan = Callable[[Batch, Sequence[Line], Command], list[Task]]
"""Plans the tasks of inputs, one for each that is not left out."""


def run(work: Work, batch: Batch, planned: Plan = plan.mapping) -> int:
    """Run a step once for every input; return the exit status.

    Parameters
    ----------
    work : what to do.
    batch : with what.
    planned : plans what is written for each input.

    Raises
    ------
    UsageError
        If something is wrong with the request as a whole; then nothing is done.
    """
    lines = plan.lines_of(batch, work.command.reads)
    tasks = planned(batch, lines, work.command)
    work.command.expect_right(batch, tasks)
    lines = plan.included(lines)
    return run_tasks(
        work,
        batch,
        manifest.shard(tasks, batch.shard),
        manifest.shard(lines, batch.shard),
    )


def reduce(work: Work, batch: Batch, beside: Sequence[Path] = ()) -> int:
    """Run a step once over all inputs together; return the exit status.

    Parameters and errors are those of `run`.

    Parameters
    ----------
    beside : further outputs.
    """
    lines = plan.lines_of(batch, work.command.reads)
    task = plan.reducing(batch, lines, work.command, beside)
    work.command.expect_right(batch, [task])
    return run_tasks(work, batch, [task], ())


def run_tasks(
    work: Work, batch: Batch, tasks: Sequence[Task], lines: Sequence[Line]
) -> int:
    """Run planned tasks; ``lines`` are what they came from, for ``--failed``."""
    if not tasks and not batch.quiet:
        sys.stderr.write(terminal.line(_nothing(batch)) + "\n")
    known = figures_of(work) if batch.require else {}
    conditions = [require.parse(text, known) for text in batch.require]
    failed.expect_free(batch, tasks, work.command.records)
    staging.remove_dead(path for task in tasks for path in task.outputs)
    console = Console(batch, len(tasks))
    with _means(batch, len(tasks), console) as do_all:
        return _run_by(do_all, work, batch, tasks, lines, conditions, console)


def _run_by(
    do_all: DoAll,
    work: Work,
    batch: Batch,
    tasks: Sequence[Task],
    lines: Sequence[Line],
    conditions: Sequence[Condition],
    console: Console,
) -> int:
    """Run tasks by these means, tell of each, and return the exit status."""
    reports: dict[int, Report] = {}
    met = True
    begun = _reports(do_all, work, batch, tasks, console)
    try:
        with closing(_in_order(begun)) as ordered:
            for index, report in ordered:
                reports[index] = report
                unmet = _unmet(conditions, report)
                met = met and not unmet
                console.tell(tasks[index], report, unmet)
    finally:
        console.close()
        unfinished = {
            i: terminal.line(reports[i].error) if i in reports else "not done"
            for i in range(len(tasks))
            if i not in reports or reports[i].status == "failed"
        }
        unlisted, kept = failed.write(batch, tasks, lines, unfinished)
        for text in filter(None, (unlisted, kept)):
            console.note(text)
    console.summarise(list(reports.values()))
    status = _exit_status(list(reports.values()), met)
    return FAILED if unlisted and status != WRONG_USAGE else status


def _nothing(batch: Batch) -> str:
    """Say that nothing is to be done; no mistake, as ``--failed`` may list nothing."""
    where = "stdin" if batch.manifest == "-" else batch.manifest or "inputs"
    if batch.shard:
        return f"{where}: none is left for shard {batch.shard}"
    return f"{where}: the manifest lists no takes"


def _unmet(conditions: Sequence[Condition], report: Report) -> list[str]:
    if report.status == "failed":
        return []
    texts = (condition.unmet(report.figures) for condition in conditions)
    return [text for text in texts if text]


def _exit_status(reports: Sequence[Report], met: bool) -> int:
    wrong = [report for report in reports if report.status == "failed"]
    if wrong:
        all_wrong = all(report.exit_status == WRONG_USAGE for report in wrong)
        nothing_done = len(wrong) == len(reports)
        return WRONG_USAGE if all_wrong and nothing_done else FAILED
    if any(report.differs for report in reports):
        return DIFFERENT
    return 0 if met else NOT_MET


@contextmanager
def _means(batch: Batch, count: int, console: Console) -> Iterator[DoAll]:
    """Choose how tasks are done: here, in workers of this machine, or on a cluster.

    Raises
    ------
    UsageError
        If the cluster cannot be reached.
    """
    if batch.scheduler and count:
        from handclean.runner import cluster  # late: it brings asyncio, 0.03 s

        note = (lambda text: None) if batch.quiet else console.note
        with cluster.joined(batch.scheduler, note) as workers:
            yield partial(cluster.on_cluster, workers, batch.jobs)
    elif count <= 1:
        yield _here
    else:
        jobs = jobs_of(batch)
        yield lambda work, tasks, may_start: in_workers(work, tasks, jobs, may_start)


def _reports(
    do_all: DoAll, work: Work, batch: Batch, tasks: Sequence[Task], console: Console
) -> Reports:
    """Yield the report of every task as it ends; those never begun come last."""
    failing: Report | None = None
    begun = set()
    ended = do_all(work, tasks, lambda: not (failing and batch.fail_fast))
    with closing(ended):
        for index, report in ended:
            if failing is None and report.status == "failed":
                failing = report
            begun.add(index)
            console.ended()
            yield index, report
    for index in sorted(set(range(len(tasks))) - begun):
        where = tasks[index].sources[0].name
        error = f"{where}: not begun, as another input failed (--fail-fast)"
        status = failing.exit_status if failing else FAILED
        yield index, Report(status="failed", error=error, exit_status=status)


def _here(work: Work, tasks: Sequence[Task], may_start: Callable[[], bool]) -> Reports:
    """Do tasks in this process; what a library prints must not meet the results."""
    notice = silent if work.quiet else Once(work.command.compiling, to_stderr)
    for index, task in enumerate(tasks):
        with redirect_stdout(sys.stderr):
            report = execute(work, task, notice)
        yield index, report


def _in_order(reports: Reports) -> Reports:
    early: dict[int, Report] = {}
    due = 0
    with closing(reports):
        for index, report in reports:
            early[index] = report
            while due in early:
                yield due, early.pop(due)
                due += 1


def jobs_of(batch: Batch) -> int:
    """Return how many worker processes to use: as asked, as Slurm grants, else one.

    Raises
    ------
    UsageError
        If Slurm's number is none.
    """
    if batch.jobs is not None:
        return batch.jobs
    granted = os.environ.get("SLURM_CPUS_PER_TASK", "1")
    if not granted.isdecimal() or int(granted) < 1:
        raise UsageError(
            f"SLURM_CPUS_PER_TASK: should be a number of processors, not '{granted}'"
        )
    return int(granted)
