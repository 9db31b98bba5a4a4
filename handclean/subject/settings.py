"""Settings of ``calibrate-hand markers``; imports nothing heavy."""

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, kw_only=True)
class CalibrateConfig:
    """Settings of ``calibrate-hand markers``."""

    frames: Annotated[int, "How many well-spread frames to learn from at most."] = 400
    novel_m: Annotated[
        float, "A frame nearer than this to a chosen one teaches nothing new [m]."
    ] = 0.0005
    holdout: Annotated[
        float, "Share of the take kept aside to measure the error; 0 for none."
    ] = 0.2
    block_s: Annotated[
        float, "What is kept aside comes in blocks of this duration [s]."
    ] = 2.0
    independent: Annotated[
        int,
        "As how many independent frames the chosen ones count against the template, "
        "so far as their residuals are more than camera noise.",
    ] = 30
    robust: Annotated[
        float, "Residuals of so many standard deviations lose their say."
    ] = 10.0
    length: Annotated[
        float, "How far bones may differ from the template, relative."
    ] = 0.06
    place_m: Annotated[float, "How far markers may sit from the set's places [m]."] = (
        0.005
    )
    tilt_rad: Annotated[
        float, "How far finger axes may tilt against the template [rad]."
    ] = 0.08
    moved_rad: Annotated[
        float, "A joint that moved less is named in the report [rad]."
    ] = 0.26

    def __post_init__(self) -> None:
        if self.frames < 10:
            raise ValueError(f"frames should be 10 or more, not {self.frames}")
        if not 0 <= self.holdout <= 0.5:
            raise ValueError(
                f"holdout should lie between 0 and 0.5, not {self.holdout}"
            )
        if self.independent < 1:
            raise ValueError(f"independent should be 1 or more, not {self.independent}")
        for name in ("novel_m", "moved_rad"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name} should be >= 0, not {getattr(self, name)}")
        for name in ("block_s", "robust", "length", "place_m", "tilt_rad"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} should be > 0, not {getattr(self, name)}")
