"""Seconds that the steps of a task take, for ``-v``."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar

Seconds = dict[str, float]
"""[s] by step, in the order in which the steps began."""

_TAKEN: ContextVar[Seconds | None] = ContextVar("taken", default=None)


@contextmanager
def collected() -> Iterator[Seconds]:
    """Within, what steps take is added to the mapping that this yields."""
    taken: Seconds = {}
    token = _TAKEN.set(taken)
    try:
        yield taken
    finally:
        _TAKEN.reset(token)


@contextmanager
def step(name: str) -> Iterator[None]:
    """Measure a step; one within another counts for itself and not for that one."""
    taken = _TAKEN.get()
    if taken is None:
        yield
        return
    taken.setdefault(name, 0.0)
    others = sum(taken.values()) - taken[name]
    began = time.perf_counter()
    try:
        yield
    finally:
        inner = sum(taken.values()) - taken[name] - others
        taken[name] += time.perf_counter() - began - inner


def in_words(taken: Mapping[str, float]) -> str:
    """Say what steps took: "read 0.01, label 0.24"."""
    return ", ".join(f"{name} {seconds:.3f}" for name, seconds in taken.items())
