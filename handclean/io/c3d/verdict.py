"""What came of reading a C3D file twice, part for part: as data and in words."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Part:
    """One part of a file, as both read it.

    Attributes
    ----------
    name : what it is.
    compared, differing : values that both have, and how many of them differ.
    largest : difference of numbers, None where they are none.
    unit : of the numbers.
    frames : numbers of first and last frame of runs in which values differ; the first
        runs only.
    ours, theirs : single values, None for arrays.
    """

    name: str
    compared: int
    differing: int = 0
    largest: float | None = None
    unit: str = ""
    frames: tuple[tuple[int, int], ...] = ()
    ours: Any = None
    theirs: Any = None

    def line(self) -> str:
        """Say how the part differs."""
        if self.ours is not None or self.theirs is not None:
            return f"{self.name}: {self.ours} here, {self.theirs} by the c3d package"
        words = f"{self.name}: {self.differing} of {self.compared} differ"
        if self.largest is not None:
            words += f", by up to {self.largest:.6g} {self.unit}".rstrip()
        if self.frames:
            runs = [f"{a}" if a == b else f"{a} to {b}" for a, b in self.frames]
            words += f", in frames {', '.join(runs)}"
        return words


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What the comparison found.

    Attributes
    ----------
    unread : why the package cannot read the file, "" if it can.
    parts : what was compared; none where the package cannot read it.
    """

    unread: str = ""
    parts: tuple[Part, ...] = ()

    @property
    def status(self) -> str:
        """Return "equal", "different" or "unread"."""
        if self.unread:
            return "unread"
        return "different" if self.differing else "equal"

    @property
    def differing(self) -> int:
        """Values that differ, over all parts."""
        return sum(part.differing for part in self.parts)

    def lines(self) -> tuple[str, ...]:
        """Say how the parts differ, one line each."""
        return tuple(part.line() for part in self.parts if part.differing)

    def as_data(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        return {
            "status": self.status,
            "reason": self.unread or None,
            "parts": {part.name: _data(part) for part in self.parts},
        }


def _data(part: Part) -> dict[str, Any]:
    about: dict[str, Any] = {"compared": part.compared, "differing": part.differing}
    if part.ours is not None or part.theirs is not None:
        about |= {"handclean": part.ours, "c3d": part.theirs}
    if part.largest is not None:
        about |= {"largest": part.largest, "unit": part.unit}
    if part.frames:
        about["frames"] = [list(run) for run in part.frames]
    return about
