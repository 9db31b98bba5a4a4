"""Settings of judging layouts; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, expect_limits


@dataclass(frozen=True, kw_only=True)
class EvaluateConfig:
    """Settings of ``optimize-layout --evaluate``."""

    noise_m: Annotated[
        float, "Noise of simulated markers per axis, one sd.", Limits(least=0.0)
    ] = 0.0002
    frames: Annotated[
        int,
        "Frames of all motion whose skin is compared; all are solved.",
        Limits(least=1),
    ] = 1000

    def __post_init__(self) -> None:
        expect_limits(self)
