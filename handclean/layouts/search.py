"""What every way to find a layout takes and returns."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.layouts.problem import Problem

Watch = Callable[[int, float], None]
"""Called after each step with the layouts weighed and the least energy so far."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """A layout, and how it was found.

    Attributes
    ----------
    layout : (k,) candidates.
    history : (H, 2) layouts weighed and least energy so far, after each step.
    stopped : why the search ended.
    """

    layout: Ints
    history: Floats
    stopped: str


class Log:
    """History of a search."""

    def __init__(self, watch: Watch | None) -> None:
        self._rows: list[tuple[float, float]] = []
        self._watch = watch

    @property
    def least(self) -> float:
        """The least energy so far."""
        return self._rows[-1][1] if self._rows else np.inf

    def note(self, weighed: int, energy: float) -> None:
        """Add that so many more layouts were weighed, one of them with this energy."""
        least = min(energy, self.least)
        before = self._rows[-1][0] if self._rows else 0.0
        self._rows.append((before + weighed, least))
        if self._watch:
            self._watch(int(before + weighed), least)

    def history(self) -> Floats:
        """(H, 2) layouts weighed and least energy."""
        return np.array(self._rows, dtype=np.float64).reshape(-1, 2)


def random_layouts(
    problem: Problem, markers: int, count: int, rng: np.random.Generator
) -> Ints:
    """(S, k) layouts of k different candidates each.

    Parameters
    ----------
    markers : k; count : S
    """
    size = len(problem.home)
    out = rng.integers(0, size, (count, markers))
    if size < 4 * markers**2:
        keys = rng.random((count, size))
        out = np.argpartition(keys, markers - 1, axis=1)[:, :markers]
    while True:
        ordered = np.sort(out, axis=1)
        twice = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
        if not twice.any():
            return np.ascontiguousarray(out, dtype=np.int64)
        out[twice] = rng.integers(0, size, (int(twice.sum()), markers))
