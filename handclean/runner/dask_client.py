"""A Dask cluster as the runner sees it; nothing else imports ``distributed``, an extra.

Messages of Dask are pickles: who can speak to its scheduler can run any code on its
workers and here. It listens in a network that is trusted, or speaks TLS, which Dask's
own configuration sets up.
"""

import asyncio
import json
import logging
import os
import pkgutil
import queue
import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from handclean.errors import UsageError

CONNECTS_WITHIN_S = 10.0
"""[s] for a scheduler to answer before it counts as unreachable (chosen)."""

_ENDED = ("closing", "closed", "failed")
"""What Dask calls a worker that does no more tasks."""

_ANSWERS_WITHIN_S = 30.0
"""[s] for a scheduler to answer before it counts as lost (chosen)."""

_COMES_WITHIN_S = 10.0
"""[s] for a report to come once it is there (chosen)."""


class ClusterLost(Exception):
    """The scheduler is no longer there, or no longer knows of us."""


class NotYet(Exception):
    """A report is on its way, or lost with the worker that has it."""


class Cluster:
    """A connection to a scheduler; made by `connected`."""

    def __init__(self, client: Any, distributed: Any) -> None:
        self._client = client
        self._distributed = distributed

    def threads(self) -> dict[str, int]:
        """Return how many threads each worker has, by its address.

        Raises
        ------
        ClusterLost
            If the scheduler does not answer.
        """
        found: dict[str, int] = self._answered(self._client.nthreads)
        return found

    def ask(
        self, function: Callable[..., Any], *given: Any, workers: Collection[str]
    ) -> Mapping[str, Any]:
        """Call a function on some workers; return its results by their addresses.

        Those where it fails, or where there is no such function, are left out.

        Raises
        ------
        ClusterLost
            If the scheduler does not answer.
        """
        if workers:  # one that cannot be found there would be an error of all
            name = f"{function.__module__}:{function.__qualname__}"
            workers = self._called(pkgutil.resolve_name, name, workers=workers)
        return self._called(function, *given, workers=workers) if workers else {}

    def _called(
        self, function: Callable[..., Any], *given: Any, workers: Collection[str]
    ) -> dict[str, Any]:
        found = self._answered(
            self._client.run,
            function,
            *given,
            workers=list(workers),
            on_error="return",
        )
        return {a: v for a, v in found.items() if not isinstance(v, BaseException)}

    def hear(self, topic: str, heard: Callable[[str], None]) -> None:
        """Call ``heard``, in another thread, with what workers `tell` on a topic.

        Raises
        ------
        ClusterLost
            If the scheduler does not answer.
        """
        self._answered(
            self._client.subscribe_topic, topic, lambda event: heard(str(event[1]))
        )

    def begin(
        self,
        function: Callable[[bytes, bytes], bytes],
        given: tuple[bytes, bytes],
        *,
        worker: str,
        key: str,
        ended: Callable[[], None],
    ) -> Any:
        """Let a worker call a function; return what `result` and `cancel` take.

        Parameters
        ----------
        key : a name that nothing else on the cluster has.
        ended : called, in another thread, when the result is there or never will be.

        Raises
        ------
        ClusterLost
            If the scheduler is no longer there.
        """
        if self._client.status != "running":
            raise ClusterLost
        future = self._client.submit(
            function, *given, key=key, pure=False, workers=[worker], retries=0
        )
        future.add_done_callback(lambda _: ended())
        return future

    def result(self, future: Any) -> bytes:
        """Return what the function returned.

        Raises
        ------
        NotYet
            If it does not come; the worker may be lost.
        ClusterLost
            If the cluster no longer knows of it.
        Exception
            What the function raised, or why it could not be called.
        """
        if future.cancelled() or self._client.status != "running":
            raise ClusterLost
        try:
            found: bytes = future.result(timeout=_COMES_WITHIN_S)
        except (TimeoutError, self._distributed.TimeoutError):
            raise NotYet from None
        except self._distributed.CancelledError:
            raise ClusterLost from None
        return found

    def is_killer(self, error: Exception) -> bool:
        """Whether an error is that all workers were lost that tried a task."""
        return isinstance(error, self._distributed.KilledWorker)

    def cancel(self, futures: Collection[Any]) -> None:
        """Let go of what was begun.

        Raises
        ------
        ClusterLost
            If the scheduler does not answer.
        """
        self._answered(self._client.cancel, list(futures), force=True)

    def _answered(self, call: Callable[..., Any], *given: Any, **named: Any) -> Any:
        """Return what a call of the client returns, unless it takes too long.

        The client itself would wait for ever where the other end has stopped.
        """
        if self._client.status != "running":
            raise ClusterLost
        answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

        def ask() -> None:
            try:
                answers.put((call(*given, **named), None))
            except BaseException as error:
                answers.put((None, error))

        threading.Thread(target=ask, daemon=True).start()
        try:
            answer, error = answers.get(timeout=_ANSWERS_WITHIN_S)
        except queue.Empty:
            raise ClusterLost from None
        if isinstance(error, OSError | self._distributed.CancelledError):
            raise ClusterLost from None
        if error is not None:
            raise error
        return answer


@contextmanager
def connected(address: str) -> Iterator[Cluster]:
    """Connect to a scheduler, by its address or the file that it wrote.

    Raises
    ------
    UsageError
        If ``distributed`` is not installed, or the scheduler cannot be reached.
    """
    where = f"--scheduler {address}"
    try:
        distributed = import_module("distributed")
    except ImportError:
        wrong = "needs Dask; 'pip install handclean[cluster]' installs it"
        raise UsageError(wrong, where=where) from None
    place = _place(address, where)
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)  # what goes wrong is said here, on one line
    try:
        try:
            asyncio.run(asyncio.wait_for(_try_to_reach(place), CONNECTS_WITHIN_S))
            client = distributed.Client(
                place, timeout=CONNECTS_WITHIN_S, set_as_default=False
            )
        except Exception as error:
            wrong = f"no scheduler of Dask answers there ({_reason(error)})"
            raise UsageError(f"{wrong}; is it running?", where=where) from None
        try:
            yield Cluster(client, distributed)
        finally:
            client.close(timeout=2.0)
    finally:
        logging.disable(before)


async def _try_to_reach(place: str) -> None:
    """Connect once; a client that cannot would wait again when it is taken apart."""
    security = import_module("distributed.security").Security()
    given = security.get_connection_args("client")
    comm = import_module("distributed.comm")
    reached = await comm.connect(place, timeout=CONNECTS_WITHIN_S, **given)
    await reached.close()


def _place(address: str, where: str) -> str:
    """Return the address of a scheduler, perhaps out of the file that it wrote.

    Raises
    ------
    UsageError
        If it is not of a kind that Dask knows, or the file is another.
    """
    if os.path.isfile(address):
        try:
            with open(address, "rb") as file:
                address = json.load(file)["address"]
        except (OSError, ValueError, KeyError, TypeError):
            wrong = "is no file that a scheduler of Dask wrote"
            raise UsageError(wrong, where=where) from None
    comm = import_module("distributed.comm.registry")
    scheme, found, _ = address.rpartition("://")
    known = sorted(comm.backends)
    if found and scheme not in known:
        right = f"known: {', '.join(known)}"
        raise UsageError(f"no protocol is called '{scheme}'; {right}", where=where)
    return address


def _reason(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return " ".join(text.split())


def cancellation() -> Callable[[], bool]:
    """Return what tells a task on a worker whether it was cancelled, or its worker."""
    worker = import_module("distributed").get_worker()
    key = worker.get_current_task()

    def cancelled() -> bool:
        task = worker.state.tasks.get(key)
        is_wanted = task is not None and task.state != "cancelled"
        return not is_wanted or worker.status.name in _ENDED

    return cancelled


def tell(topic: str, text: str) -> None:
    """Tell whoever listens on a topic, from a task on a worker; the worker is named."""
    worker = import_module("distributed").get_worker()
    worker.log_event(topic, f"worker {worker.address}: {text}")
