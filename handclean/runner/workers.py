"""Worker processes that may die without taking the others along.

Each holds one task at a time. One that dies (out of memory, a fault in a library)
fails the task in its hands, and another takes its place.
"""

from collections import deque
from collections.abc import Callable, Generator, Sequence
from multiprocessing.connection import wait

from handclean.runner import outputs
from handclean.runner.batch import Report, Task
from handclean.runner.command import Work
from handclean.runner.compiling import Compiles, to_stderr
from handclean.runner.interrupts import held_back
from handclean.runner.process import TaskProcess, start


def in_workers(
    work: Work, tasks: Sequence[Task], jobs: int, may_start: Callable[[], bool]
) -> Generator[tuple[int, Report], None, None]:
    """Yield the index and the report of every task as it ends, in any order.

    Tasks that ``may_start`` forbids to begin are not among them.
    """
    waiting = deque(range(len(tasks)))
    idle: list[TaskProcess] = []
    busy: dict[TaskProcess, int] = {}
    compiles = False
    try:
        while True:
            while waiting and len(busy) < jobs and may_start():
                with held_back():
                    worker = _take(idle) or start(work)
                    index = busy[worker] = waiting.popleft()
                worker.send(tasks[index])
            if not busy:
                return
            ready = wait([worker.pipe for worker in busy])
            for worker in [w for w in busy if w.pipe in ready]:
                answer = worker.answer(tasks[busy[worker]])
                if isinstance(answer, Compiles):
                    if not compiles:
                        to_stderr(answer.text)
                    compiles = True
                    continue
                index = busy.pop(worker)
                if worker.process.exitcode is None:
                    idle.append(worker)
                yield index, answer
    finally:
        with held_back():
            for worker in [*busy, *idle]:
                worker.end()
            for index in busy.values():
                outputs.clean(tasks[index])


def _take(idle: list[TaskProcess]) -> TaskProcess | None:
    while idle:
        worker = idle.pop()
        if worker.process.is_alive():
            return worker
    return None
