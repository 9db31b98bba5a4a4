"""SIGINT, SIGTERM and SIGHUP end a run in order: nothing half-written stays.

A signal becomes an exception that only ``main`` catches. Where an output takes its
place, a signal is held back until it stands there whole.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupted(BaseException):
    """A signal asked to end; no ``except Exception`` should catch it."""

    def __init__(self, signum: int) -> None:
        super().__init__(f"interrupted by {signal.Signals(signum).name}")
        self.exit_status = 128 + signum


class _State:
    holding = 0
    waiting: int | None = None
    raised: int | None = None


def _on_signal(signum: int, frame: FrameType | None) -> None:
    if _State.holding:
        _State.waiting = signum
    else:
        _State.raised = signum
        raise Interrupted(signum)


def raise_swallowed() -> None:
    """Raise `Interrupted` again if a compiler's callback swallowed or changed it."""
    if _State.raised is not None:
        raise Interrupted(_State.raised)


@contextmanager
def raising() -> Iterator[None]:
    """Turn signals into `Interrupted`; one that is ignored (nohup) stays ignored."""
    before = {s: signal.getsignal(s) for s in SIGNALS}
    _State.raised = None
    for signum, handler in before.items():
        if handler != signal.SIG_IGN:
            signal.signal(signum, _on_signal)
    try:
        yield
    finally:
        for signum, handler in before.items():
            signal.signal(signum, handler)
        _State.raised = None


@contextmanager
def held_back() -> Iterator[None]:
    """Let nothing come between; a signal meanwhile takes effect at the end."""
    _State.holding += 1
    try:
        yield
    finally:
        _State.holding -= 1
        signum = _State.waiting
        if signum is not None and not _State.holding:
            _State.waiting = None
            raise Interrupted(signum)


@contextmanager
def blocked() -> Iterator[None]:
    """Block the signals: a process started meanwhile never receives them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
