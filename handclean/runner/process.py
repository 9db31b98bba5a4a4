"""A process that does one task at a time, and may die without taking others along.

It is a fresh interpreter and never receives the signals meant for the command: whoever
started it ends it. If that one dies, it ends by itself.
"""

import os
import signal
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from handclean.errors import FileError
from handclean.runner import terminal
from handclean.runner.batch import Report, Task
from handclean.runner.command import Work
from handclean.runner.compiling import Compiles, Once, silent
from handclean.runner.execute import execute, gone
from handclean.runner.interrupts import blocked

USED_AFTER_S = 30.0
"""[s] without a task after which a process that may leave gets none (chosen)."""

LEAVES_AFTER_S = 2.0 * USED_AFTER_S
"""[s] without a task after which it leaves; longer, so that no task meets its end."""


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """Where a task belongs that another machine does.

    Attributes
    ----------
    folder : of the command, to which relative paths belong.
    environment : variables that decide what comes out.
    """

    folder: str
    environment: Mapping[str, str] = field(default_factory=dict)

    def enter(self) -> None:
        """Let this process work there.

        Raises
        ------
        OSError
            If there is no such folder.
        """
        os.chdir(self.folder)
        os.environ.update(self.environment)


@dataclass(eq=False)
class TaskProcess:
    """A process with a pipe to it; made by `start`."""

    process: SpawnProcess
    pipe: Connection
    used_s: float = 0.0

    @property
    def is_ready(self) -> bool:
        """Whether it lives and does not leave soon."""
        fresh = time.monotonic() - self.used_s < USED_AFTER_S
        return fresh and self.process.is_alive()

    def send(self, task: Task) -> None:
        """Give it a task; if it died, `answer` will tell."""
        with suppress(ConnectionError):
            self.pipe.send(task)

    def answer(self, task: Task) -> Report | Compiles:
        """Wait for the report of the task that it has, or news that it compiles."""
        try:
            answer: Report | Compiles = self.pipe.recv()
        except (EOFError, OSError):
            self.process.join()
            return gone(task, _cause(self.process.exitcode or 0))
        self.used_s = time.monotonic()
        return answer

    def end(self) -> None:
        """End it at once, whatever it does."""
        self.process.kill()
        self.process.join()


def start(work: Work, surroundings: Surroundings | None = None) -> TaskProcess:
    """Start a process that does tasks of this work.

    Parameters
    ----------
    surroundings : where it should work, if not here; there it leaves by itself when it
        gets nothing to do, as nobody may be left to end it.
    """
    here, there = get_context("spawn").Pipe()
    process = get_context("spawn").Process(
        target=_serve, args=(there, work, surroundings), daemon=True
    )
    resource_tracker.ensure_running()  # starting it would unblock the signals
    with blocked():
        process.start()
    there.close()
    return TaskProcess(process=process, pipe=here, used_s=time.monotonic())


def _cause(exitcode: int) -> str:
    if exitcode >= 0:
        return f"the worker process ended with status {exitcode}"
    name = signal.Signals(-exitcode).name
    hint = ", perhaps for want of memory" if name == "SIGKILL" else ""
    return f"the worker process was killed ({name}){hint}"


def _serve(pipe: Connection, work: Work, surroundings: Surroundings | None) -> None:
    """Do tasks until the other end closes."""

    def send(text: str) -> None:
        pipe.send(Compiles(text))

    notice = silent if work.quiet else Once(work.command.compiling, send)
    os.dup2(2, 1)  # stdout belongs to the results
    threading.Thread(target=_end_with_parent, daemon=True).start()
    terminal.hush()
    lost = ""
    if surroundings is not None:
        try:
            surroundings.enter()
        except OSError as error:
            lost = (error.strerror or str(error)).lower()
    while surroundings is None or pipe.poll(LEAVES_AFTER_S):
        try:
            task = pipe.recv()
        except EOFError:
            return
        if surroundings is not None and lost:
            pipe.send(_unseen(task, surroundings, lost))
        else:
            pipe.send(execute(work, task, notice))


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _unseen(task: Task, surroundings: Surroundings, reason: str) -> Report:
    """Report a task of a folder that this machine does not have."""
    host = os.uname().nodename
    wrong = f"{host} cannot go to {surroundings.folder}: {reason}"
    right = "workers of a cluster should see the files of the command at the same paths"
    error = FileError(task.sources[0].path, wrong, right)
    return Report(status="failed", error=str(error), about=task.about)
