"""Settings of ``fill-gaps``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

METHODS = (
    "min-acceleration",
    "coupled",
    "linear",
    "cubic",
    "spline",
    "pattern",
    "rigid",
)
"""Names of the ways to fill; ``handclean.gaps.fill.FILLERS`` holds the functions."""


@dataclass(frozen=True, kw_only=True)
class FillConfig:
    """Settings of ``fill-gaps``."""

    method: Annotated[str, f"How to fill: {', '.join(METHODS)}.", METHODS] = "coupled"
    max_gap_s: Annotated[float, "Longest gap to fill; longer ones stay open."] = 0.5
    seed_frames: Annotated[
        int,
        "Measured frames a gap needs on each side, within twice as many frames; "
        "a shorter gap as many as it has.",
    ] = 5

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            known = ", ".join(METHODS)
            raise ValueError(f"method should be one of {known}, not '{self.method}'")
        if not self.max_gap_s >= 0.0:
            raise ValueError(f"max_gap_s should be >= 0 s, not {self.max_gap_s}")
        if self.seed_frames < 5:
            raise ValueError(f"seed_frames should be >= 5, not {self.seed_frames}")
