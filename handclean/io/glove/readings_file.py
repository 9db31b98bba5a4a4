"""A file of a glove's readings, whatever its format: what it says, and its frames."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, Place

FORMAT = "handclean glove readings"

MARK = "# handclean readings"
"""What a CSV of ours begins with."""

Piece = tuple[Floats, Floats, Sequence[int]]
"""Times, readings, and the number of each frame's line (CSV) or of the frame (HDF5)."""


@dataclass(frozen=True, kw_only=True)
class ReadingsFile(ABC):
    """What a file of readings says before its numbers.

    Attributes
    ----------
    path : the file.
    sensors : names of its columns of readings; empty if it has no header.
    columns : how many columns of readings there are.
    rate : [Hz] for files without times; nan for those with.
    facts : what else it says of itself.
    row, clock_name : what a row, and what holds the times, is called in messages.
    """

    row: ClassVar[str]
    clock_name: ClassVar[str]
    path: Path
    sensors: tuple[str, ...]
    columns: int
    rate: float
    facts: Mapping[str, Any] = field(default_factory=dict)

    def chunks(self, size: int) -> Iterator[tuple[Floats, Floats]]:
        """Go through (t,) [s] times and (t, S) readings, so many frames at a time.

        Raises
        ------
        FileError
            If a line is not as the header says, or times do not rise.
        """
        pieces = self.pieces(size)
        last, frames = -math.inf, 0
        for times, values, numbers in pieces:
            if len(times) == 0:
                continue
            blank = ~np.isfinite(times)
            if blank.any():
                at = numbers[int(np.argmax(blank))]
                raise FileError(self._where(at), "is without a time")
            steps = np.diff(times, prepend=last)
            if np.any(steps <= 0.0):
                k = int(np.argmax(steps <= 0.0))
                before = times[k - 1] if k else last
                raise FileError(
                    self._where(numbers[k]),
                    f"its time {times[k]:.10g} s is not later than the {before:.10g} s "
                    "before it",
                    f"without the {self.clock_name}, --rate tells",
                )
            last, frames = float(times[-1]), frames + len(times)
            yield times, values
        if frames == 0:
            raise FileError(self.path, "has no readings")

    def _where(self, number: int) -> Place:
        return Place(self.path, f" {self.row} {number}")

    @property
    @abstractmethod
    def has_times(self) -> bool:
        """Whether it says when its frames were."""

    @property
    @abstractmethod
    def says_time_unit(self) -> bool:
        """Whether it says in what unit its times are."""

    @abstractmethod
    def pieces(self, size: int) -> Iterator[Piece]:
        """Go through times, readings and numbers of rows, so many frames at a time."""

    def all(self) -> tuple[Floats, Floats]:
        """(T,) [s] times and (T, S) readings of the whole file."""
        pieces = list(self.chunks(100_000))
        return (
            np.concatenate([times for times, _ in pieces]),
            np.concatenate([values for _, values in pieces]),
        )
