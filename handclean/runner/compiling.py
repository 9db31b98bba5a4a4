"""Say once that kernels are being compiled, which makes a first run long.

numba tells of a compilation by an event, and not of a load from the cache; so a run
that finds all it needs in the cache says nothing. Only a process that has loaded numba
can compile, and nothing here loads it.
"""

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from importlib import import_module
from typing import Any

Notice = Callable[[], None]
"""What is called when a kernel is about to be compiled."""


@dataclass(frozen=True)
class Compiles:
    """What a process sends to whoever started it, before it compiles kernels.

    Attributes
    ----------
    text : what to say of it.
    """

    text: str


def silent() -> None:
    """Say nothing."""


class Once:
    """Say that kernels are compiled, the first time that it is called.

    Parameters
    ----------
    text : asked what to say, when it is said.
    say : says it.
    """

    def __init__(self, text: Callable[[], str], say: Callable[[str], None]) -> None:
        self._text = text
        self._say = say
        self._said = False

    def __call__(self) -> None:
        """Say it, unless it has been said."""
        if not self._said:
            self._said = True
            self._say(self._text())


def to_stderr(text: str) -> None:
    """Write a line, clear of the progress."""
    clear = "\r\033[K" if sys.stderr.isatty() else ""
    with suppress(OSError):
        sys.stderr.write(f"{clear}{text}\n")
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
