"""Worker processes that may die without taking the others along.

Each holds one task at a time. One that dies (out of memory, a fault in a library)
fails the task in its hands, and another takes its place. Workers are fresh
interpreters and never receive the signals meant for the command: it ends them.
"""

import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess

from handclean.runner import outputs, terminal
from handclean.runner.batch import Report, Task
from handclean.runner.command import Work
from handclean.runner.compiling import Notice, Once, silent
from handclean.runner.execute import execute, gone
from handclean.runner.interrupts import blocked, held_back


@dataclass
class _Worker:
    process: SpawnProcess
    pipe: Connection
    index: int = -1  # of the task in its hands


def in_workers(
    work: Work, tasks: Sequence[Task], jobs: int, may_start: Callable[[], bool]
) -> Generator[tuple[int, Report], None, None]:
    """Yield the index and the report of every task as it ends, in any order.

    Tasks that ``may_start`` forbids to begin are not among them.
    """
    waiting = deque(range(len(tasks)))
    idle: list[_Worker] = []
    busy: list[_Worker] = []
    notice: Notice = silent
    if not work.quiet:
        notice = Once(get_context("spawn").Lock(), work.command.compiling)
    try:
        while True:
            while waiting and len(busy) < jobs and may_start():
                with held_back():
                    worker = _take(idle) or _start(work, notice)
                    worker.index = waiting.popleft()
                    busy.append(worker)
                with suppress(ConnectionError):  # it died; its pipe will tell
                    worker.pipe.send(tasks[worker.index])
            if not busy:
                return
            ready = wait([worker.pipe for worker in busy])
            for worker in [w for w in busy if w.pipe in ready]:
                busy.remove(worker)
                report = _report(worker, tasks[worker.index])
                if worker.process.exitcode is None:
                    idle.append(worker)
                yield worker.index, report
    finally:
        with held_back():
            for worker in busy + idle:
                worker.process.kill()
            for worker in busy + idle:
                worker.process.join()
            for worker in busy:
                outputs.clean(tasks[worker.index])


def _take(idle: list[_Worker]) -> _Worker | None:
    while idle:
        worker = idle.pop()
        if worker.process.is_alive():
            return worker
    return None


def _start(work: Work, notice: Notice) -> _Worker:
    here, there = get_context("spawn").Pipe()
    process = get_context("spawn").Process(
        target=_serve, args=(there, work, notice), daemon=True
    )
    resource_tracker.ensure_running()  # starting it would unblock the signals
    with blocked():
        process.start()
    there.close()
    return _Worker(process=process, pipe=here)


def _report(worker: _Worker, task: Task) -> Report:
    try:
        report: Report = worker.pipe.recv()
    except (EOFError, OSError):
        worker.process.join()
        return gone(task, _cause(worker.process.exitcode or 0))
    return report


def _cause(exitcode: int) -> str:
    if exitcode >= 0:
        return f"the worker process ended with status {exitcode}"
    name = signal.Signals(-exitcode).name
    hint = ", perhaps for want of memory" if name == "SIGKILL" else ""
    return f"the worker process was killed ({name}){hint}"


def _serve(pipe: Connection, work: Work, notice: Notice) -> None:
    """Do tasks until the other end closes."""
    os.dup2(2, 1)  # stdout belongs to the results
    terminal.hush()
    while True:
        try:
            task = pipe.recv()
        except EOFError:
            return
        pipe.send(execute(work, task, notice))
