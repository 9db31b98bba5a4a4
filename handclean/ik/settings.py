"""Settings of ``solve``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, expect_limits


@dataclass(frozen=True, kw_only=True)
class SolveConfig:
    """Settings of ``solve``."""

    iterations: Annotated[
        int, "Gauss-Newton steps per frame at most.", Limits(least=1)
    ] = 20
    damping: Annotated[
        float,
        "Selective damping D [m^2/rad^2]; raised near joint limits.",
        Limits(above=0.0),
    ] = 1e-9
    enough_m: Annotated[
        float, "RMS below which a further step is not worth it.", Limits(above=0.0)
    ] = 1e-7
    lever_m: Annotated[
        float,
        "A joint is open if a radian of it moves the markers by less.",
        Limits(above=0.0),
    ] = 2e-3
    prior_m: Annotated[
        float,
        "Marker noise that weighs as much as one sd of the posture prior.",
        Limits(above=0.0),
    ] = 5e-4
    restart_m: Annotated[
        float,
        "RMS, beyond 1.5 times the usual, that starts a frame afresh.",
        Limits(above=0.0),
    ] = 5e-4

    def __post_init__(self) -> None:
        expect_limits(self)
