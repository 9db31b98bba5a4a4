"""Settings of ``fill-gaps``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, Words, expect_limits

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

    method: Annotated[str, f"How to fill: {', '.join(METHODS)}.", Words(METHODS)] = (
        "coupled"
    )
    max_gap_s: Annotated[
        float,
        "Longest gap to fill; longer ones stay open.",
        Limits(least=0.0, unit="s"),
    ] = 0.5
    seed_frames: Annotated[
        int,
        "Measured frames a gap needs on each side, within twice as many frames; "
        "a shorter gap as many as it has.",
        Limits(least=5),
    ] = 5
    despike: Annotated[
        bool,
        "Whether spikes, up to three measured frames of a marker, are interpolated.",
    ] = False
    smooth: Annotated[
        float,
        "Cut-off [Hz] of a low-pass without delay (Butterworth, second order, forwards "
        "and backwards) over measured samples; 0 for none.",
        Limits(least=0.0, unit="Hz"),
    ] = 0.0

    def __post_init__(self) -> None:
        expect_limits(self)
