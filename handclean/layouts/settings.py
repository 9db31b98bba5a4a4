"""Settings of ``optimize-layout``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

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

    markers: Annotated[int, "How many markers to place (k)."] = 6
    dimensions: Annotated[
        int, "Directions of the posture subspace (l); 0: as many as hold the share."
    ] = 0
    share: Annotated[float, "Share of the posture's variance to hold."] = 0.95
    full: Annotated[bool, "All joint angles instead of the posture subspace."] = False
    anchor: Annotated[bool, "A marker on the forearm tells where the hand is."] = True
    keyframes: Annotated[int, "Postures of the motion that count."] = 10
    method: Annotated[str, f"How to search: {', '.join(METHODS)}.", METHODS] = "anneal"
    w1: Annotated[float, "Weight of the condition number."] = 0.1
    w2: Annotated[
        float, "Weight of the smallest distance, squared, in hand lengths."
    ] = 100.0
    visibility: Annotated[
        float, "Weight of the share of keyframes and directions a marker is hidden in."
    ] = 0.0
    normal: Annotated[float, "Least cosine between skin's normal and its back."] = 0.9
    back: Annotated[
        str, "Whose back that is: bone (the thumb's own) or hand (the papers').", BACKS
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
        int, "Particles of the swarm; anneal weighs half as many layouts."
    ] = 1000
    iterations: Annotated[int, "Iterations of the swarm, at most."] = 100
    patience: Annotated[int, "Iterations without a better layout before it stops."] = 40
    base_share: Annotated[
        float, "Share of the candidates that wheatland chooses from."
    ] = 0.01

    def __post_init__(self) -> None:
        for name, known in (("method", METHODS), ("back", BACKS)):
            value = getattr(self, name)
            if value not in known:
                names = ", ".join(known)
                raise ValueError(f"{name} should be one of {names}, not '{value}'")
        for name in ("markers", "keyframes", "particles", "iterations", "patience"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} should be >= 1, not {getattr(self, name)}")
        if self.dimensions < 0:
            raise ValueError(f"dimensions should be >= 0, not {self.dimensions}")
        for name in ("w1", "w2", "visibility"):
            if not 0.0 <= getattr(self, name) < float("inf"):
                raise ValueError(f"{name} should be >= 0, not {getattr(self, name)}")
        if not self.w1 + self.w2 + self.visibility > 0.0:
            raise ValueError("w1, w2 and visibility should not all be 0")
        for name in ("share", "base_share"):
            if not 0.0 < getattr(self, name) <= 1.0:
                value = getattr(self, name)
                raise ValueError(f"{name} should lie between 0 and 1, not {value}")
        if not -1.0 <= self.normal < 1.0:
            raise ValueError(f"normal should lie between -1 and 1, not {self.normal}")
        if len(self.without_boxes_m) % 6:
            count = len(self.without_boxes_m)
            raise ValueError(
                f"without_boxes_m should have six numbers each, not {count}"
            )
