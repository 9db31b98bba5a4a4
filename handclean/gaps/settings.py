"""Settings of ``fill-gaps``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, Words, expect_limits

POSTURE_METHODS = ("min-acceleration", "coupled")
"""Ways to fill that follow the posture of a hand."""

METHODS = (
    "auto",
    "take",
    *POSTURE_METHODS,
    "last",
    "average",
    "affine",
    "linear",
    "cubic",
    "c1",
    "spline",
    "pattern",
    "rigid",
    "pca",
    "kalman",
    "ridge",
)
"""Names of the ways to fill; ``handclean.gaps.fill.sources_of`` knows the functions."""


@dataclass(frozen=True, kw_only=True)
class FillConfig:
    """Settings of ``fill-gaps``."""

    method: Annotated[str, f"How to fill: {', '.join(METHODS)}.", Words(METHODS)] = (
        "auto"
    )
    max_sigma_m: Annotated[
        float,
        "Error per axis to expect of a gap that is filled, at most; others stay open.",
        Limits(above=0.0, unit="m"),
    ] = 0.003
    max_gap_s: Annotated[
        float,
        "Longest gap to fill; 0: as long as --max-sigma-m allows.",
        Limits(least=0.0, unit="s"),
    ] = 0.0
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
