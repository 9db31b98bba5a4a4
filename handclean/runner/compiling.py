"""Say once that kernels are being compiled, which makes a first run long.

numba tells of a compilation by an event, and not of a load from the cache; so a run
that finds all it needs in the cache says nothing. Only a process that has loaded numba
can compile, and nothing here loads it.
"""

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from importlib import import_module
from typing import Any, Protocol

Notice = Callable[[], None]
"""What is called when a kernel is about to be compiled."""


class Lock(Protocol):
    """What a lock of threads and one of processes have in common."""

    def acquire(self, block: bool = ..., /) -> bool:
        """Take the lock; with ``block`` false only if it is free."""
        ...


def silent() -> None:
    """Say nothing."""


class Once:
    """Say on stderr that kernels are compiled, in the first process that does so.

    The lock is what these processes share; whoever gets it speaks.

    Parameters
    ----------
    text : asked what to say, in the process that says it.
    """

    def __init__(self, lock: Lock, text: Callable[[], str]) -> None:
        self._lock = lock
        self._text = text

    def __call__(self) -> None:
        """Say it, unless it has been said."""
        if not self._lock.acquire(False):
            return
        clear = "\r\033[K" if sys.stderr.isatty() else ""
        with suppress(OSError):
            sys.stderr.write(f"{clear}{self._text()}\n")
            sys.stderr.flush()


def watching(notice: Notice) -> AbstractContextManager[Any]:
    """Call ``notice`` whenever a kernel is about to be compiled."""
    if notice is silent or "numba" not in sys.modules:
        return nullcontext()
    event = import_module("numba.core.event")

    class _Listener(event.Listener):  # type: ignore[misc, name-defined]
        def on_start(self, event: Any) -> None:
            notice()

        def on_end(self, event: Any) -> None:
            pass

    context: AbstractContextManager[Any] = event.install_listener(
        "numba:compile", _Listener()
    )
    return context
