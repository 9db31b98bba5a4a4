"""Settings of ``calibrate-hand scan``; imports nothing heavy."""

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, kw_only=True)
class ScanConfig:
    """Settings of ``calibrate-hand scan``."""

    skin: Annotated[bool, "Leave out points that are not of the color of skin."] = True
    points: Annotated[int, "How many points of the scan to use at most."] = 150_000
    lonely: Annotated[
        float, "A point is lonely if its neighbours are so many sd farther than usual."
    ] = 6.0
    gap_m: Annotated[float, "Parts of a scan farther apart do not hang together."] = (
        0.008
    )
    far_m: Annotated[
        float, "Points farther than this from the aligned template are not the hand's."
    ] = 0.02
    least_landmarks: Annotated[int, "How many landmarks are needed."] = 8
    rounds: Annotated[int, "Rounds of alignment and posture with closest points."] = 12
    normal_rad: Annotated[
        float, "A point belongs to skin whose normal differs by less [rad]."
    ] = 0.9
    reach_m: Annotated[float, "Skin looks so far for its point of the scan."] = 0.012
    stiff: Annotated[float, "lambda_reg at the start, in hand lengths^4."] = 1.0
    middle: Annotated[float, "lambda_reg once the landmarks are fitted."] = 1e-6
    soft: Annotated[float, "lambda_reg at the end."] = 1e-8
    landmark_weight: Annotated[float, "lambda_lm beside the closest points."] = 1.0
    steps: Annotated[int, "Steps of lambda_reg for each factor of ten."] = 3

    def __post_init__(self) -> None:
        if self.points < 1000:
            raise ValueError(f"points should be 1000 or more, not {self.points}")
        if self.least_landmarks < 4:
            raise ValueError(
                f"least_landmarks should be 4 or more, not {self.least_landmarks}"
            )
        if self.rounds < 0:
            raise ValueError(f"rounds should be >= 0, not {self.rounds}")
        if self.steps < 1:
            raise ValueError(f"steps should be >= 1, not {self.steps}")
        for name in ("lonely", "gap_m", "far_m", "normal_rad", "reach_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} should be > 0, not {getattr(self, name)}")
        if not self.stiff >= self.middle >= self.soft > 0.0:
            raise ValueError("stiff, middle and soft should fall, and stay above 0")
        if not self.landmark_weight >= 0.0:
            raise ValueError(
                f"landmark_weight should be >= 0, not {self.landmark_weight}"
            )
