"""Settings of ``optimize-layout``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, Words, expect_limits

METHODS = (
    "anneal",
    "swarm",
    "greedy",
    "wheatland",
    "hoyet6",
    "hoyet8",
    "hoyet20",
)
"""Names of the ways to find a layout; `handclean.layouts.optimize.METHODS` has them."""

BACKS = ("bone", "hand")


@dataclass(frozen=True, kw_only=True)
class LayoutConfig:
    """Settings of ``optimize-layout``."""

    markers: Annotated[int, "How many markers to place (k).", Limits(least=1)] = 6
    dimensions: Annotated[
        int,
        "Directions of the posture subspace (l); 0: as many as hold the share.",
        Limits(least=0),
    ] = 0
    share: Annotated[
        float, "Share of the posture's variance to hold.", Limits(above=0.0, most=1.0)
    ] = 0.95
    full: Annotated[bool, "All joint angles instead of the posture subspace."] = False
    anchor: Annotated[bool, "A marker on the forearm tells where the hand is."] = True
    keyframes: Annotated[int, "Postures of the motion that count.", Limits(least=1)] = (
        10
    )
    method: Annotated[str, f"How to search: {', '.join(METHODS)}.", Words(METHODS)] = (
        "anneal"
    )
    w1: Annotated[float, "Weight of the condition number.", Limits(least=0.0)] = 0.1
    w2: Annotated[
        float,
        "Weight of the smallest distance, squared, in hand lengths.",
        Limits(least=0.0),
    ] = 100.0
    visibility: Annotated[
        float,
        "Weight of the share of keyframes and directions a marker is hidden in.",
        Limits(least=0.0),
    ] = 0.0
    normal: Annotated[
        float,
        "Least cosine between skin's normal and its back.",
        Limits(least=-1.0, below=1.0),
    ] = 0.9
    back: Annotated[
        str,
        "Whose back that is: bone (the thumb's own) or hand (the papers').",
        Words(BACKS),
    ] = "bone"
    without_bones: Annotated[
        tuple[str, ...], "Bones on which no marker should be placed."
    ] = ()
    without_boxes_m: Annotated[
        tuple[float, ...],
        "Boxes without markers, six numbers each: lowest and highest (to the thumb, "
        "to the fingers, out of the back) from the wrist in the zero posture.",
    ] = ()
    particles: Annotated[
        int,
        "Particles of the swarm; anneal weighs half as many layouts.",
        Limits(least=1),
    ] = 1000
    iterations: Annotated[int, "Iterations of the swarm, at most.", Limits(least=1)] = (
        100
    )
    patience: Annotated[
        int, "Iterations without a better layout before it stops.", Limits(least=1)
    ] = 40
    base_share: Annotated[
        float,
        "Share of the candidates that wheatland chooses from.",
        Limits(above=0.0, most=1.0),
    ] = 0.01

    def __post_init__(self) -> None:
        expect_limits(self)
        if not self.w1 + self.w2 + self.visibility > 0.0:
            raise ValueError("w1, w2 and visibility should not all be 0")
        if len(self.without_boxes_m) % 6:
            count = len(self.without_boxes_m)
            raise ValueError(
                f"without_boxes_m should have six numbers each, not {count}"
            )
