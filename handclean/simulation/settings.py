"""Settings of ``simulate``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

SCENARIOS = {
    "grasp": "grasp an object, put it in a bowl, return: the protocol of maycock2015",
    "rom": "every joint through its range, for calibrate-hand",
    "free": "gestures in the air, no object",
    "scan": "a hand held still before eight cameras: a point cloud with landmarks",
    "glove": "sessions with a data glove: key poses, widgets, touching, free movement",
    "demo": "one short grasp and nothing else, at 100 Hz",
}


@dataclass(frozen=True, kw_only=True)
class SimulateConfig:
    """Settings of ``simulate``."""

    trials: Annotated[int, "How many takes to make."] = 1
    subjects: Annotated[int, "How many different hands take turns."] = 1
    seed: Annotated[int, "Takes with the same seed and number are the same."] = 0
    rate_hz: Annotated[float, "Frames per second."] = 200.0
    duration_s: Annotated[float, "Length of a take; 0: the scenario's own."] = 0.0
    marker_set: Annotated[str, "Shipped name or TOML file."] = "maycock26"
    side: Annotated[
        str, "left or right; the marker set's own when empty.", ("left", "right")
    ] = ""
    grasps: Annotated[tuple[str, ...], "Grasp classes to draw from; empty: all."] = ()
    cameras: Annotated[int, "Cameras around the table; two must see a marker."] = 14
    noise_m: Annotated[float, "Standard deviation per axis seen by six cameras."] = (
        0.0002
    )
    slide: Annotated[float, "Skin sliding over joints, 1: as on living hands."] = 1.0
    occlusion: Annotated[bool, "Whether hand and object hide markers."] = True
    dropouts_per_s: Annotated[float, "Further losses per marker and second."] = 0.15
    ghosts_per_s: Annotated[float, "Short-lived ghosts per second."] = 0.5
    impostors_per_s: Annotated[
        float, "Ghosts per second that live on beside a hidden marker."
    ] = 0.1
    scan_cameras: Annotated[int, "Cameras that scan a hand; two must see a place."] = 8
    scan_noise_m: Annotated[
        float, "Standard deviation per axis of a scan's points."
    ] = 0.0005
    scan_points: Annotated[int, "Points of the hand in a scan, at most."] = 100_000

    glove: Annotated[
        str, "The data glove that is worn in the scenario of that name."
    ] = "cyberglove18"
    wearings: Annotated[
        int, "How often each puts the glove on; 2nd and later: tests."
    ] = 2

    def __post_init__(self) -> None:
        for name, least in (
            ("wearings", 1),
            ("trials", 1),
            ("subjects", 1),
            ("cameras", 2),
            ("scan_cameras", 2),
            ("scan_points", 1000),
        ):
            if getattr(self, name) < least:
                wrong = f"{name} should be at least {least}, not {getattr(self, name)}"
                raise ValueError(wrong)
        if not 10.0 <= self.rate_hz <= 10000.0:
            raise ValueError(
                f"rate_hz should lie between 10 and 10000 Hz, not {self.rate_hz}"
            )
        if self.side not in ("", "left", "right"):
            raise ValueError(f"side should be left or right, not '{self.side}'")
        if self.seed < 0:
            raise ValueError(f"seed should be >= 0, not {self.seed}")
        if self.duration_s and not 0.5 <= self.duration_s <= 3600.0:
            raise ValueError(
                "duration_s should be 0 or lie between 0.5 and 3600 s, "
                f"not {self.duration_s}"
            )
        for name in (
            "noise_m",
            "scan_noise_m",
            "slide",
            "dropouts_per_s",
            "ghosts_per_s",
            "impostors_per_s",
        ):
            if not 0.0 <= getattr(self, name) < 1e4:
                raise ValueError(f"{name} should be >= 0, not {getattr(self, name)}")
