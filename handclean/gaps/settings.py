"""Settings of ``fill-gaps``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, Words, expect_limits

POSTURE_METHODS = ("min-acceleration", "coupled")
"""Ways to fill that follow the posture of a hand."""

CAUSAL_METHODS = ("affine", "average", "last")
"""Ways to fill that look at nothing after the frame they fill, the best first."""

METHODS = (
    "auto",
    "take",
    *POSTURE_METHODS,
    *reversed(CAUSAL_METHODS),
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
"""Names of the ways to fill; ``handclean.gaps.sources`` knows the functions."""


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
    causal: Annotated[
        bool,
        "Whether to look at nothing after the frame that is filled, as a program that "
        f"runs along must: {', '.join(CAUSAL_METHODS)}, or auto for the best of them.",
    ] = False
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
        if self.causal and self.method not in ("auto", *CAUSAL_METHODS):
            right = f"with causal it should be auto, {', '.join(CAUSAL_METHODS)}"
            raise ValueError(f"method '{self.method}' looks ahead; {right}")
