"""Settings of ``solve``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, kw_only=True)
class SolveConfig:
    """Settings of ``solve``."""

    iterations: Annotated[int, "Gauss-Newton steps per frame at most."] = 20
    damping: Annotated[
        float, "Selective damping D [m^2/rad^2]; raised near joint limits."
    ] = 1e-9
    enough_m: Annotated[float, "RMS below which a further step is not worth it."] = 1e-7
    lever_m: Annotated[
        float, "A joint is open if a radian of it moves the markers by less."
    ] = 2e-3
    prior_m: Annotated[
        float, "Marker noise that weighs as much as one sd of the posture prior."
    ] = 5e-4
    restart_m: Annotated[
        float, "RMS, beyond 1.5 times the usual, that starts a frame afresh."
    ] = 5e-4

    def __post_init__(self) -> None:
        if self.iterations < 1:
            raise ValueError(f"iterations should be >= 1, not {self.iterations}")
        for name in ("damping", "enough_m", "lever_m", "prior_m", "restart_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} should be > 0, not {getattr(self, name)}")
