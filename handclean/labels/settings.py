"""Settings of ``label``; imports nothing heavy, so that help is instant.

Distances and accelerations have a most that no hand exceeds: beyond it, every point
could be any marker, and a take would be searched for hours.
"""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, Words, expect_limits

COLUMNS = ("auto", "use", "ignore")

LEAST_MARKERS = 4
"""Markers that labelling needs: fewer points are no hand's. Chosen."""


@dataclass(frozen=True, kw_only=True)
class LabelConfig:
    """Settings of ``label``."""

    columns: Annotated[
        str,
        "Whether a raw column is one point's path: auto (where it moves like one), "
        "use, ignore.",
        Words(COLUMNS),
    ] = "auto"
    alpha: Annotated[
        float,
        "Weight of missing markers in the score of a first frame.",
        Limits(least=0.0),
    ] = 1.0
    start_frames: Annotated[
        int,
        "How many frames, the early and full ones first, to try as the first.",
        Limits(least=1),
    ] = 8
    small_m: Annotated[
        float,
        "What the distance threshold adds to a marker's usual distance.",
        Limits(above=0.0, most=1.0),
    ] = 1e-3
    strict: Annotated[
        float,
        "Standard deviations of that distance that the threshold allows.",
        Limits(above=0.0),
    ] = 4.0
    acceleration_m_s2: Annotated[
        float,
        "How hard a hand accelerates; opens the gates at low rates.",
        Limits(above=0.0, most=1e4),
    ] = 40.0
    drift_m_s: Annotated[
        float,
        "How fast a marker that nobody sees may leave its frozen place.",
        Limits(above=0.0),
    ] = 0.10
    reach_m: Annotated[
        float,
        "Farthest a marker may reappear from its frozen place.",
        Limits(above=0.0, most=1.0),
    ] = 0.05
    ghosts_per_hand: Annotated[
        float,
        "Points of no marker to expect in a volume the size of a hand.",
        Limits(above=0.0),
    ] = 0.25
    repair: Annotated[
        bool, "Whether stretches that fit poorly are tracked again from a better fit."
    ] = True
    review: Annotated[
        bool, "Whether points' paths in doubt are tried under other names, as wholes."
    ] = True

    def __post_init__(self) -> None:
        expect_limits(self)
