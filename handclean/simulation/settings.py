"""Settings of ``simulate``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Formerly, Limits, Words, expect_limits

SCENARIOS = {
    "grasp": "grasp an object, put it in a bowl, return: the protocol of maycock2015",
    "rom": "every joint through its range, for calibrate-hand",
    "free": "gestures in the air, no object",
    "scan": "a hand held still before eight cameras: a point cloud with landmarks",
    "glove": "sessions with a data glove: key poses, widgets, touching, free movement",
    "demo": "one short grasp and nothing else, at 100 Hz",
}


_MANY = Limits(least=0.0, below=1e4, in_help=False)
"""No size or frequency of what disturbs a take is larger (chosen)."""


@dataclass(frozen=True, kw_only=True)
class SimulateConfig:
    """Settings of ``simulate``."""

    trials: Annotated[int, "How many takes to make.", Limits(least=1)] = 1
    subjects: Annotated[
        int, "How many different hands take turns.", Limits(least=1)
    ] = 1
    seed: Annotated[
        int, "Takes with the same seed and number are the same.", Limits(least=0)
    ] = 0
    rate_hz: Annotated[
        float, "Frames per second.", Limits(least=10.0, most=10000.0, unit="Hz")
    ] = 200.0
    duration_s: Annotated[
        float,
        "Length of a take; 0: the scenario's own.",
        Limits(least=0.5, most=3600.0, or_zero=True, unit="s"),
    ] = 0.0
    marker_set: Annotated[str, "Shipped name or TOML file."] = "maycock26"
    side: Annotated[
        str,
        "left or right; the marker set's own when empty.",
        Words(("left", "right"), or_empty=True),
    ] = ""
    grasps: Annotated[tuple[str, ...], "Grasp classes to draw from; empty: all."] = ()
    cameras: Annotated[
        int, "Cameras around the table; two must see a marker.", Limits(least=2)
    ] = 14
    noise_m: Annotated[
        float, "Standard deviation per axis seen by six cameras.", _MANY
    ] = 0.0002
    slide: Annotated[
        float, "Skin sliding over joints, 1: as on living hands.", _MANY
    ] = 1.0
    occlusion: Annotated[bool, "Whether hand and object hide markers."] = True
    dropouts_per_s: Annotated[float, "Further losses per marker and second.", _MANY] = (
        0.15
    )
    ghosts_per_s: Annotated[float, "Short-lived ghosts per second.", _MANY] = 0.5
    impostors_per_s: Annotated[
        float, "Ghosts per second that live on beside a hidden marker.", _MANY
    ] = 0.1
    scan_cameras: Annotated[
        int, "Cameras that scan a hand; two must see a place.", Limits(least=2)
    ] = 8
    scan_noise_m: Annotated[
        float, "Standard deviation per axis of a scan's points.", _MANY
    ] = 0.0005
    scan_points: Annotated[
        int, "Points of the hand in a scan, at most.", Limits(least=1000)
    ] = 100_000

    glove: Annotated[str, "The data glove of the scenario of that name."] = (
        "cyberglove18"
    )
    donnings: Annotated[
        int,
        "How often each puts the glove on; 2nd and later: tests.",
        Limits(least=1),
        Formerly("wearings"),
    ] = 2

    def __post_init__(self) -> None:
        expect_limits(self)
