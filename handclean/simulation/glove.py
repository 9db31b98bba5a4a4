"""A simulated session with a data glove: what is recorded, with the true angles.

Several people put on one glove, each at least twice: the first donning is for
calibration (key poses, widgets, touching, each joint alone for ``examine``, a take with
markers), every other for tests (nine poses, a widget at an angle never seen, touching,
free movement); it ends with what ``rewear`` takes (two poses once more, pinches). Trial
k of a seed is person k.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from handclean.arrays import Floats
from handclean.simulation import glove_motions as motions
from handclean.simulation.glove_hardware import (
    Hardware,
    donned,
    draw_fit,
    make_hardware,
)
from handclean.simulation.glove_motions import Wearer, make_wearer
from handclean.simulation.glove_sensors import sensors_of
from handclean.simulation.settings import SimulateConfig

GLOVE_RATE_HZ = 60.0
"""[Hz] frames per second, where the settings have that of cameras (chosen)."""

CALIBRATION_POSES = ("flat", "spread", "fist", "overbend")
"""Key poses of a calibration (figure 4)."""

FURTHER_POSES = ("half", "thumb-hook", "thumb-bend", "thumb-across")
"""Further ones, of a bend half way and of the thumb's joints one by one (chosen)."""

REFIT_POSES = ("flat", "fist")
"""Poses that tell how the glove sits this time (chosen)."""

TEST_POSES = (*CALIBRATION_POSES, "thumb-up", "pointing", "pinky-up", "rest", "ok")
"""Poses of the tests (table 3)."""

WIDGETS: Mapping[str, tuple[tuple[str, float], tuple[int, ...]]] = {
    "index_middle_abduction": (("index_mcp_abduction", 1.0), (0, 10, 20, 30)),
    "middle_ring_abduction": (("ring_mcp_abduction", -1.0), (0, 10, 20)),
    "ring_little_abduction": (("little_mcp_abduction", -1.0), (0, 10, 20, 30)),
    "thumb_cmc_abduction": (("thumb_cmc_abduction", 1.0), (0, 15, 30, 45)),
    "wrist_flexion": (("wrist_flexion", 1.0), (-40, -20, 0, 20, 40)),
    "wrist_deviation": (("wrist_deviation", 1.0), (-20, -10, 0, 10, 20)),
}
"""Rotations that widgets hold: the hinge that takes them, and the angles [degrees]
(chosen)."""

TEST_WIDGETS = {"index_middle_abduction": (0, 25)}
"""Widgets of the tests (figure 11)."""

_PAIRS = (("I_MCP", "M_MCP"), ("M_MCP", "R_MCP"), ("R_MCP", "P_MCP"))
_GLOVE, _WEARER, _DONNING, _TAKE = 21, 22, 23, 24  # what a seed's streams are for


@dataclass(frozen=True, kw_only=True)
class GloveTake:
    """One recording.

    Attributes
    ----------
    name : such as "w1/hold-index_middle_abduction+10".
    times : (T,) [s].
    readings : (T, S).
    angles : (T, D) [rad] true hinge angles.
    moved : sensors whose joints move in a recording for ``examine``.
    late : [s] what the glove's clock shows when that of the truth shows 0.
    """

    name: str
    times: Floats
    readings: Floats
    angles: Floats
    moved: tuple[str, ...] = ()
    late: float = 0.0


@dataclass(frozen=True, kw_only=True)
class GloveSession:
    """What one person recorded.

    Attributes
    ----------
    glove : name of the glove.
    wearer : who, with the hand's true lengths.
    sensors : S names.
    takes : in the order of `takes_of`.
    """

    glove: str
    wearer: Wearer
    sensors: tuple[str, ...]
    takes: tuple[GloveTake, ...] = field(repr=False)


@cache
def takes_of(glove: str, donnings: int = 2) -> tuple[str, ...]:
    """Names of a session's recordings.

    Raises
    ------
    UnknownNameError
        If the glove cannot be simulated.
    """
    return tuple(name for _, name in _numbered(glove, donnings))


def _numbered(glove: str, donnings: int) -> list[tuple[int, str]]:
    """Recordings, and which random stream each has, whatever the glove measures."""
    felt = {hinge for sensor in sensors_of(glove) for hinge in sensor.measures}
    names = [sensor.name for sensor in sensors_of(glove)]
    alone = [s.name for s in sensors_of(glove) if s.measures]
    out = [
        f"w1/pose-{pose}-{n}"
        for pose in (*CALIBRATION_POSES, *FURTHER_POSES)
        for n in (1, 2)
    ]
    out += [f"w1/hold-{rot}{a:+d}" for rot, (_, at) in WIDGETS.items() for a in at]
    out += [f"w1/touch-thumb-{finger}" for finger in motions.LONG]
    out += [f"w1/free-{name}" for name in alone]
    out += [f"w1/free-{a}+{b}" for a, b in _PAIRS if a in names]
    out.append("w1/markers")
    for w in range(2, donnings + 1):
        out += [f"w{w}/pose-{pose}-1" for pose in TEST_POSES]
        out += [
            f"w{w}/hold-{rot}{a:+d}" for rot, at in TEST_WIDGETS.items() for a in at
        ]
        out += [f"w{w}/touch-thumb-{finger}" for finger in motions.LONG]
        out.append(f"w{w}/motion")
        out += [f"w{w}/pose-{pose}-2" for pose in REFIT_POSES]
        out += [f"w{w}/pinch-thumb-{finger}" for finger in ("index", "little")]
    idle = {rot for rot, ((hinge, _), _) in WIDGETS.items() if hinge not in felt}
    return [(k, name) for k, name in enumerate(out) if _held(name) not in idle]


def _held(name: str) -> str:
    """The rotation that a widget holds in a recording, or nothing."""
    kind, _, rest = name.split("/")[1].partition("-")
    return rest[: max(rest.rfind("+"), rest.rfind("-"))] if kind == "hold" else ""


def simulate_glove(
    settings: SimulateConfig,
    number: int,
    poses: Mapping[str, Mapping[str, float]],
) -> GloveSession:
    """Let one person put the glove on and do all that `takes_of` lists.

    Parameters
    ----------
    number : of the trial, from 0; subjects take turns.
    poses : key poses by name, hinge to angle [rad].

    Raises
    ------
    UnknownNameError
        If the glove cannot be simulated.
    """
    seed = settings.seed
    hardware = make_hardware(settings.glove, np.random.default_rng([seed, _GLOVE]))
    subject = number % settings.subjects
    rng = np.random.default_rng([seed, _WEARER, subject])
    wearer = make_wearer(f"S{subject + 1:02d}", rng, settings.side or "right")
    fits = draw_fit(hardware, rng)
    on_hand: dict[int, Hardware] = {}
    takes = []
    for k, name in _numbered(settings.glove, settings.donnings):
        w = int(name[1 : name.index("/")])
        if w not in on_hand:
            stream = np.random.default_rng([seed, _DONNING, number, w])
            on_hand[w] = donned(hardware, wearer.size, fits, stream)
        stream = np.random.default_rng([seed, _TAKE, number, k])
        takes.append(_take(name, wearer, on_hand[w], poses, stream))
    return GloveSession(
        glove=settings.glove,
        wearer=wearer,
        sensors=tuple(sensor.name for sensor in hardware.sensors),
        takes=tuple(takes),
    )


def _take(
    name: str,
    wearer: Wearer,
    hardware: Hardware,
    poses: Mapping[str, Mapping[str, float]],
    rng: np.random.Generator,
) -> GloveTake:
    kind, _, rest = name.split("/")[1].partition("-")
    lasts = {
        "pose": 1.5,
        "hold": 8.0,
        "touch": 6.0,
        "pinch": 6.0,
        "free": 6.0,
        "markers": 25.0,
    }
    times = np.arange(round(lasts.get(kind, 20.0) * GLOVE_RATE_HZ)) / GLOVE_RATE_HZ
    moved: tuple[str, ...] = ()
    late = 0.0
    if kind == "pose":
        angles = motions.held(wearer, poses[rest.rpartition("-")[0]], times, rng)
    elif kind == "hold":
        at = max(rest.rfind("+"), rest.rfind("-"))
        (hinge, sign), _ = WIDGETS[rest[:at]]
        angle = sign * np.radians(float(rest[at:]))
        free = motions.free(wearer, times, rng)
        if hinge == "little_mcp_abduction":  # held against the ring finger
            ring = wearer.tree.hinges.index("ring_mcp_abduction")
            free[:, ring] = free[0, ring]
            angle += free[0, ring]
        off = rng.normal(0.0, np.radians(0.5))
        angles = motions.with_held(wearer, free, {hinge: angle}, off)
    elif kind in ("touch", "pinch"):
        angles = motions.touching(wearer, rest.rpartition("-")[2], times, rng)
    elif kind == "free":
        moved = tuple(rest.split("+"))
        own = {sensor.name: sensor for sensor in hardware.sensors}
        hinges = [h for m in moved for h, f in own[m].measures.items() if _turns(h, f)]
        angles = motions.moving(wearer, tuple(dict.fromkeys(hinges)), times, rng)
        if "MR_ABD" in moved and "RP_ABD" not in moved:  # the little finger goes along
            ring, little = (
                wearer.tree.hinges.index(f"{finger}_mcp_abduction")
                for finger in ("ring", "little")
            )
            angles[:, little] += angles[:, ring]
    else:
        angles = motions.free(wearer, times, rng)
        late = float(rng.uniform(-3.0, 3.0)) if kind == "markers" else 0.0
    readings = hardware.readings(wearer.tree.hinges, angles, rng)
    return GloveTake(
        name=name,
        times=times,
        readings=readings,
        angles=angles,
        moved=moved,
        late=late,
    )


def _turns(hinge: str, factor: float) -> bool:
    """Whether this hinge moves when a sensor's rotation is swept alone.

    Of two fingers the one farther from the middle finger moves.
    """
    if not hinge.endswith("mcp_abduction"):
        return True
    finger = hinge.split("_")[0]
    return finger == "index" if factor > 0 else finger in ("ring", "little")
