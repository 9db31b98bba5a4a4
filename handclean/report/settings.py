"""Settings of ``compare``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, expect_limits


@dataclass(frozen=True, kw_only=True)
class CompareConfig:
    """Settings of ``compare``."""

    frames: Annotated[
        int, "Compare only so many first frames; 0: all.", Limits(least=0)
    ] = 0
    tolerance_m: Annotated[
        float,
        "Samples nearer than this are the same point, where no source column tells.",
        Limits(above=0.0, unit="m"),
    ] = 0.002

    def __post_init__(self) -> None:
        expect_limits(self)
