"""Settings of ``label``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

COLUMNS = ("auto", "use", "ignore")

MAX_OF_ANY_HAND = {"small_m": 1.0, "reach_m": 1.0, "acceleration_m_s2": 1e4}
"""[m], [m/s^2] no hand has more. Beyond, every point could be any marker, and a take
takes hours."""


@dataclass(frozen=True, kw_only=True)
class LabelConfig:
    """Settings of ``label``."""

    columns: Annotated[
        str,
        "Whether a raw column is one point's path: auto (where it moves like one), "
        "use, ignore.",
        COLUMNS,
    ] = "auto"
    alpha: Annotated[
        float, "Weight of missing markers in the score of a first frame."
    ] = 1.0
    start_frames: Annotated[
        int, "How many frames, the early and full ones first, to try as the first."
    ] = 8
    small_m: Annotated[
        float, "What the distance threshold adds to a marker's usual distance."
    ] = 1e-3
    strict: Annotated[
        float, "Standard deviations of that distance that the threshold allows."
    ] = 4.0
    acceleration_m_s2: Annotated[
        float, "How hard a hand accelerates; opens the gates at low rates."
    ] = 40.0
    drift_m_s: Annotated[
        float, "How fast a marker that nobody sees may leave its frozen place."
    ] = 0.10
    reach_m: Annotated[
        float, "Farthest a marker may reappear from its frozen place."
    ] = 0.05
    ghosts_per_hand: Annotated[
        float, "Points of no marker to expect in a volume the size of a hand."
    ] = 0.25
    repair: Annotated[
        bool, "Whether stretches that fit poorly are tracked again from a better fit."
    ] = True
    review: Annotated[
        bool, "Whether points' paths in doubt are tried under other names, as wholes."
    ] = True

    def __post_init__(self) -> None:
        if self.columns not in COLUMNS:
            known = ", ".join(COLUMNS)
            raise ValueError(f"columns should be one of {known}, not '{self.columns}'")
        if self.start_frames < 1:
            raise ValueError(f"start_frames should be >= 1, not {self.start_frames}")
        if self.alpha < 0.0:
            raise ValueError(f"alpha should be >= 0, not {self.alpha}")
        positive = (
            "small_m", "strict", "acceleration_m_s2", "drift_m_s", "reach_m",
            "ghosts_per_hand",
        )  # fmt: skip
        for name in positive:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} should be > 0, not {getattr(self, name)}")
        for name, most in MAX_OF_ANY_HAND.items():
            if getattr(self, name) > most:
                wrong = f"{name} should be {most:g} at most"
                raise ValueError(f"{wrong}, not {getattr(self, name)}")
