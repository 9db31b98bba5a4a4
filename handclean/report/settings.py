"""Settings of ``compare``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, kw_only=True)
class CompareConfig:
    """Settings of ``compare``."""

    frames: Annotated[int, "Compare only so many first frames; 0: all."] = 0
    tolerance_m: Annotated[
        float,
        "Samples nearer than this are the same point, where no source column tells.",
    ] = 0.002

    def __post_init__(self) -> None:
        if self.frames < 0:
            raise ValueError(f"frames should be >= 0, not {self.frames}")
        if not self.tolerance_m > 0.0:
            raise ValueError(f"tolerance_m should be > 0 m, not {self.tolerance_m}")
