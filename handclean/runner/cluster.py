"""``--scheduler``: takes are done by the workers of a Dask cluster that is there.

Each worker gets as many tasks as it has threads, so that it is known which ones it had
in its hands when it was lost. These are done again; one that two workers were lost with
is failed. Workers that come later are used, too.
"""

import os
import pickle
import queue
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from handclean.errors import UsageError
from handclean.runner import on_worker, outputs
from handclean.runner.batch import Report, Task
from handclean.runner.command import Work
from handclean.runner.dask_client import Cluster, ClusterLost, NotYet, connected
from handclean.runner.execute import gone
from handclean.runner.interrupts import held_back
from handclean.runner.on_worker import Run
from handclean.runner.process import Surroundings
from handclean.runner.staging import token

Reports = Generator[tuple[int, Report], None, None]

LOOKS_EVERY_S = 1.0
"""[s] between two looks at which workers there are (chosen)."""

WORKERLESS_S = 600.0
"""[s] without any worker after which a run gives up (chosen; workers that wait in the
queue of a batch system come when they come, so they are started before)."""

MOST_LOSSES = 2
"""Workers that may be lost with a task before it is failed."""

ENVIRONMENT = ("SOURCE_DATE_EPOCH",)
"""Variables that decide what comes out, and go to the workers."""


@dataclass(frozen=True, kw_only=True)
class _Begun:
    """A task in the hands of a worker."""

    worker: str
    attempt: int
    future: Any


@dataclass
class _State:
    """What of a run is waiting, begun and lost; all by the task's index."""

    waiting: deque[int]
    begun: dict[int, _Begun] = field(default_factory=dict)
    losses: Counter[int] = field(default_factory=Counter)
    ended: "queue.SimpleQueue[tuple[int, int]]" = field(
        default_factory=queue.SimpleQueue
    )
    used: set[str] = field(default_factory=set)
    attempts: int = 0


class Workers:
    """The workers of a cluster that have the handclean that is here."""

    def __init__(
        self, cluster: Cluster, address: str, note: Callable[[str], None]
    ) -> None:
        self.cluster = cluster
        self.address = address
        self._note = note
        self._others: dict[str, str] = {}
        self._ours: set[str] = set()
        self._seen_s = time.monotonic()
        self._told: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._compile = False

    def listen(self, name: str) -> None:
        """Hear from now on what the workers tell of a run.

        Raises
        ------
        ClusterLost
            If the scheduler is.
        """
        self.cluster.hear(name, self._told.put)

    def pass_on(self) -> None:
        """Say that a worker compiles kernels, if one does; of the first only."""
        while not self._told.empty():
            text = self._told.get()
            if not self._compile:
                self._note(text)
            self._compile = True

    def look(self) -> dict[str, int]:
        """Return how many tasks each may have at a time, by its address.

        Those with another handclean are named once and are not among them.

        Raises
        ------
        ClusterLost
            If the scheduler is.
        """
        threads = self.cluster.threads()
        new = threads.keys() - self._ours - self._others.keys()
        told = self.cluster.ask(on_worker.about, workers=new) if new else {}
        for address in sorted(new):
            wrong = _difference(told.get(address))
            if not wrong:
                self._ours.add(address)
            else:
                self._others[address] = wrong
                self._note(f"worker {address} {wrong}; it gets no takes")
        found = {a: count for a, count in threads.items() if a in self._ours}
        if found:
            self._seen_s = time.monotonic()
        return found

    @property
    def are_missing(self) -> bool:
        """Whether there has been none for too long."""
        return time.monotonic() - self._seen_s > WORKERLESS_S

    def expect_some(self) -> None:
        """Expect workers with this handclean, or none yet.

        Raises
        ------
        UsageError
            If there are only others.
        """
        where = f"--scheduler {self.address}"
        if self.look():
            return
        if self._others:
            address, wrong = min(self._others.items())
            more = len(self._others) - 1
            right = "install the same on all machines"
            which = f"worker {address}" + (f" and {more} more" if more else "")
            raise UsageError(f"{which} {wrong}; {right}", where=where)
        self._note(f"{where}: has no workers yet; waiting for some")


def _difference(told: tuple[str, str] | None) -> str:
    """Say how the handclean of a worker is another than this one, or nothing."""
    version, code = on_worker.about()
    if told is None:
        return f"has no handclean, or one that knows no clusters, not {version}"
    if told == (version, code):
        return ""
    if told[0] == version:
        return f"has handclean {version} with other code (digest {told[1]}, not {code})"
    return f"has handclean {told[0]}, not {version}"


@contextmanager
def joined(address: str, note: Callable[[str], None]) -> Iterator[Workers]:
    """Join the cluster of a scheduler.

    Parameters
    ----------
    address : of the scheduler, or a file that it wrote.
    note : says a line to whoever started the run.

    Raises
    ------
    UsageError
        If it cannot be reached, or none of its workers has this handclean.
    """
    with connected(address) as cluster:
        workers = Workers(cluster, address, note)
        try:
            workers.expect_some()
        except ClusterLost:
            wrong = "does not answer any more"
            raise UsageError(wrong, where=f"--scheduler {address}") from None
        yield workers


def on_cluster(
    workers: Workers,
    most: int | None,
    work: Work,
    tasks: Sequence[Task],
    may_start: Callable[[], bool],
) -> Reports:
    """Yield the index and the report of every task as it ends, in any order.

    Tasks that ``may_start`` forbids to begin are not among them. When the scheduler is
    lost, or all workers are, those that are not done are failed.

    Parameters
    ----------
    most : tasks at a time, None for as many as the workers have threads.
    """
    environment = {k: os.environ[k] for k in ENVIRONMENT if k in os.environ}
    surroundings = Surroundings(folder=os.getcwd(), environment=environment)
    run = Run(name=token(), work=work, surroundings=surroundings)
    state = _State(waiting=deque(range(len(tasks))))
    batch = _Batch(workers=workers, run=run, tasks=tasks, state=state)
    try:
        yield from batch.reports(most, may_start)
    except ClusterLost:
        cause = f"the scheduler {workers.address} was lost"
        yield from batch.all_failed(cause, may_start)
    finally:
        with held_back():
            batch.stop()


@dataclass
class _Batch:
    """A run on a cluster; see `on_cluster`."""

    workers: Workers
    run: Run
    tasks: Sequence[Task]
    state: _State
    pickled: bytes = b""

    def __post_init__(self) -> None:
        self.pickled = pickle.dumps(self.run)

    def reports(self, most: int | None, may_start: Callable[[], bool]) -> Reports:
        """Begin tasks and yield their reports, until none is left."""
        state = self.state
        self.workers.listen(self.run.name)
        threads, looked_s = self.workers.look(), time.monotonic()
        while True:
            self._begin_some(threads, most or len(self.tasks), may_start)
            if not state.begun and not (state.waiting and may_start()):
                return
            with suppress(queue.Empty):
                index, attempt = state.ended.get(timeout=LOOKS_EVERY_S)
                begun = state.begun.get(index)
                if begun is not None and begun.attempt == attempt:
                    yield from self._ended(index, begun)
            self.workers.pass_on()
            if time.monotonic() - looked_s < LOOKS_EVERY_S:
                continue
            threads, looked_s = self.workers.look(), time.monotonic()
            yield from self._lost(threads)
            if self.workers.are_missing:
                cause = f"the cluster has had no worker for {WORKERLESS_S:.0f} s"
                yield from self.all_failed(cause, may_start)
                return

    def _begin_some(
        self, threads: Mapping[str, int], most: int, may_start: Callable[[], bool]
    ) -> None:
        """Give every free thread a task, the workers in turn."""
        state = self.state
        busy = Counter(begun.worker for begun in state.begun.values())
        free = {a: n - busy[a] for a, n in threads.items() if n > busy[a]}
        while state.waiting and free and len(state.begun) < most and may_start():
            worker = max(free, key=lambda address: free[address])
            free[worker] -= 1
            if not free[worker]:
                del free[worker]
            with held_back():
                self._begin(state.waiting[0], worker)
                state.waiting.popleft()

    def _begin(self, index: int, worker: str) -> None:
        state = self.state
        state.attempts += 1
        state.used.add(worker)
        attempt = state.attempts
        future = self.workers.cluster.begin(
            on_worker.do,
            (self.pickled, pickle.dumps(self.tasks[index])),
            worker=worker,
            key=f"handclean-{self.run.name}-{attempt}",
            ended=lambda: state.ended.put((index, attempt)),
        )
        state.begun[index] = _Begun(worker=worker, attempt=attempt, future=future)

    def _ended(self, index: int, begun: _Begun) -> Reports:
        """Yield the report of a task that ended, if it is there."""
        cluster = self.workers.cluster
        try:
            report: Report = pickle.loads(cluster.result(begun.future))
        except NotYet:
            self.state.ended.put((index, begun.attempt))
            return
        except ClusterLost:
            raise
        except Exception as error:
            if cluster.is_killer(error):
                cause = f"its worker {begun.worker} was lost again and again"
            else:
                kind = type(error).__name__
                cause = f"worker {begun.worker} cannot do it: {kind}: {error}"
            report = gone(self.tasks[index], cause)
        del self.state.begun[index]
        yield index, report

    def _lost(self, threads: Mapping[str, int]) -> Reports:
        """Let tasks of workers that are lost be done again, or fail them."""
        state = self.state
        lost = [i for i, begun in state.begun.items() if begun.worker not in threads]
        for index in sorted(lost, reverse=True):
            begun = state.begun[index]
            self.workers.cluster.cancel([begun.future])
            del state.begun[index]
            state.losses[index] += 1
            outputs.clean(self.tasks[index])
            if state.losses[index] < MOST_LOSSES:
                state.waiting.appendleft(index)
                continue
            cause = f"{MOST_LOSSES} workers were lost with it, the last {begun.worker}"
            yield index, gone(self.tasks[index], cause)

    def all_failed(self, cause: str, may_start: Callable[[], bool]) -> Reports:
        """Yield reports that tasks which are not done are failed.

        Those that would not have begun any more are not among them.
        """
        state = self.state
        begun = sorted(state.begun)
        waiting = sorted(state.waiting) if may_start() else []
        state.begun.clear()
        state.waiting.clear()
        for index in begun:
            yield index, gone(self.tasks[index], f"not known to be done, as {cause}")
        for index in waiting:
            yield index, gone(self.tasks[index], f"not done, as {cause}")

    def stop(self) -> None:
        """Cancel what is not done, and end the processes of the workers."""
        state = self.state
        cluster = self.workers.cluster
        with suppress(ClusterLost):
            if state.begun:
                cluster.cancel([begun.future for begun in state.begun.values()])
            there = cluster.threads().keys() & state.used
            cluster.ask(on_worker.stop, self.run.name, workers=there)
        for index in state.begun:
            outputs.clean(self.tasks[index])
