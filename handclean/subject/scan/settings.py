"""Settings of ``calibrate-hand scan``; imports nothing heavy."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, expect_limits


@dataclass(frozen=True, kw_only=True)
class ScanConfig:
    """Settings of ``calibrate-hand scan``."""

    skin: Annotated[bool, "Leave out points that are not of the color of skin."] = True
    points: Annotated[
        int, "How many points of the scan to use at most.", Limits(least=1000)
    ] = 150_000
    lonely: Annotated[
        float,
        "A point is lonely if its neighbours are so many sd farther than usual.",
        Limits(above=0.0),
    ] = 6.0
    gap_m: Annotated[
        float, "Parts of a scan farther apart do not hang together.", Limits(above=0.0)
    ] = 0.008
    far_m: Annotated[
        float,
        "Points farther than this from the aligned template are not the hand's.",
        Limits(above=0.0),
    ] = 0.02
    least_landmarks: Annotated[
        int, "How many landmarks are needed.", Limits(least=4)
    ] = 8
    rounds: Annotated[
        int, "Rounds of alignment and posture with closest points.", Limits(least=0)
    ] = 12
    normal_rad: Annotated[
        float,
        "A point belongs to skin whose normal differs by less [rad].",
        Limits(above=0.0),
    ] = 0.9
    reach_m: Annotated[
        float, "Skin looks so far for its point of the scan.", Limits(above=0.0)
    ] = 0.012
    stiff: Annotated[float, "lambda_reg at the start, in hand lengths^4."] = 1.0
    middle: Annotated[float, "lambda_reg once the landmarks are fitted."] = 1e-6
    soft: Annotated[float, "lambda_reg at the end.", Limits(above=0.0)] = 1e-8
    landmark_weight: Annotated[
        float, "lambda_lm beside the closest points.", Limits(least=0.0)
    ] = 1.0
    steps: Annotated[
        int, "Steps of lambda_reg for each factor of ten.", Limits(least=1)
    ] = 3

    def __post_init__(self) -> None:
        expect_limits(self)
        if not self.stiff >= self.middle >= self.soft:
            raise ValueError("stiff, middle and soft should fall, and stay above 0")
