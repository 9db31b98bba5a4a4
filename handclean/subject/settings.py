"""Settings of ``calibrate-hand markers``; imports nothing heavy."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, expect_limits


@dataclass(frozen=True, kw_only=True)
class CalibrateConfig:
    """Settings of ``calibrate-hand markers``."""

    frames: Annotated[
        int, "How many well-spread frames to learn from at most.", Limits(least=10)
    ] = 400
    novel_m: Annotated[
        float,
        "A frame nearer than this to a chosen one teaches nothing new [m].",
        Limits(least=0.0),
    ] = 0.0005
    holdout: Annotated[
        float,
        "Share of the take kept aside to measure the error; 0 for none.",
        Limits(least=0.0, most=0.5),
    ] = 0.2
    block_s: Annotated[
        float,
        "What is kept aside comes in blocks of this duration [s].",
        Limits(above=0.0),
    ] = 2.0
    independent: Annotated[
        int,
        "As how many independent frames the chosen ones count against the template, "
        "so far as their residuals are more than camera noise.",
        Limits(least=1),
    ] = 30
    robust: Annotated[
        float,
        "Residuals of so many standard deviations lose their say.",
        Limits(above=0.0),
    ] = 10.0
    length: Annotated[
        float,
        "How far bones may differ from the template, relative.",
        Limits(above=0.0),
    ] = 0.06
    place_m: Annotated[
        float, "How far markers may sit from the set's places [m].", Limits(above=0.0)
    ] = 0.005
    tilt_rad: Annotated[
        float,
        "How far finger axes may tilt against the template [rad].",
        Limits(above=0.0),
    ] = 0.08
    moved_rad: Annotated[
        float,
        "A joint that moved less is named in the report [rad].",
        Limits(least=0.0),
    ] = 0.26

    def __post_init__(self) -> None:
        expect_limits(self)
