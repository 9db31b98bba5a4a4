"""Settings of judging layouts; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, kw_only=True)
class EvaluateConfig:
    """Settings of ``optimize-layout --evaluate``."""

    noise_m: Annotated[float, "Noise of simulated markers per axis, one sd."] = 0.0002
    frames: Annotated[
        int, "Frames of all motion whose skin is compared; all are solved."
    ] = 1000

    def __post_init__(self) -> None:
        if not 0.0 <= self.noise_m < float("inf"):
            raise ValueError(f"noise_m should be >= 0, not {self.noise_m}")
        if self.frames < 1:
            raise ValueError(f"frames should be >= 1, not {self.frames}")
