"""What a worker of a cluster does: each of its threads has a process for the takes.

So a take is done there as it is by ``-j``, in a process of its own that may die; the
worker itself computes nothing and stays small.
"""

import pickle
import threading
import time
from dataclasses import dataclass, field, replace
from multiprocessing import current_process
from multiprocessing.util import Finalize
from pathlib import Path

from handclean import __version__
from handclean.runner import dask_client, outputs, process
from handclean.runner.batch import Report, Task
from handclean.runner.command import Work
from handclean.runner.compiling import Compiles
from handclean.runner.process import Surroundings, TaskProcess
from handclean.runner.provenance import code

_CANCELLED_EVERY_S = 0.2
"""[s] between two looks at whether anybody still wants a task (chosen)."""

_GRACE_S = 1.0
"""[s] that the end of a process is kept back: if what killed it kills the worker, too,
the task is not lost by its own fault and done again (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """What is the same for all tasks of a run.

    Attributes
    ----------
    name : that no other run has.
    work : what to do.
    surroundings : where.
    """

    name: str
    work: Work
    surroundings: Surroundings

    def absolute(self, task: Task) -> Task:
        """Return a task whose outputs can be found from any folder."""
        folder = Path(self.surroundings.folder)
        return replace(task, outputs=tuple(folder / path for path in task.outputs))


@dataclass
class _Processes:
    """Those of one run on this worker; a lock guards them."""

    idle: list[TaskProcess] = field(default_factory=list)
    busy: dict[TaskProcess, Task] = field(default_factory=dict)


_runs: dict[str, _Processes] = {}
_lock = threading.Lock()


class Stopped(Exception):
    """Nobody wants the task any more."""


def about() -> tuple[str, str]:
    """Return version and code of the handclean that is here."""
    return __version__, code()


def do(run_pickled: bytes, task_pickled: bytes) -> bytes:
    """Do a task, in a process that has done others of the run; return its report.

    Raises
    ------
    Stopped
        If the task was cancelled meanwhile.
    """
    run: Run = pickle.loads(run_pickled)
    task: Task = pickle.loads(task_pickled)
    is_cancelled = dask_client.cancellation()
    worker = _begin(run, task)
    lives = False
    try:
        worker.send(task)
        report: Report | None = None
        while report is None:
            if worker.pipe.poll(_CANCELLED_EVERY_S):
                answer = worker.answer(task)
                if isinstance(answer, Compiles):
                    dask_client.tell(run.name, answer.text)
                else:
                    report = answer
            elif is_cancelled():
                raise Stopped
        lives = worker.process.exitcode is None
    finally:
        _give_back(run, task, worker, lives=lives)
    if not lives:
        time.sleep(_GRACE_S)
    return pickle.dumps(report)


def stop(name: str) -> None:
    """End all processes of a run; nothing half-written stays."""
    with _lock:
        found = _runs.pop(name, _Processes())
    for worker in (*found.busy, *found.idle):
        worker.end()
    for task in found.busy.values():
        outputs.clean(task)


def _stop_all() -> None:
    for name in list(_runs):
        stop(name)


Finalize(None, _stop_all, exitpriority=10)  # before a worker that ends waits for them


def _begin(run: Run, task: Task) -> TaskProcess:
    with _lock:
        held = _runs.setdefault(run.name, _Processes())
        while held.idle:
            worker = held.idle.pop()
            if worker.is_ready:
                break
            worker.end()
        else:
            current_process().daemon = False  # else it may start none
            worker = process.start(run.work, run.surroundings)
        held.busy[worker] = run.absolute(task)
    return worker


def _give_back(run: Run, task: Task, worker: TaskProcess, *, lives: bool) -> None:
    """Keep a process for the next task, or end one that did not do its own."""
    with _lock:
        held = _runs.get(run.name)
        if held is not None:
            held.busy.pop(worker, None)
            if lives:
                held.idle.append(worker)
                return
    worker.end()
    outputs.clean(run.absolute(task))
