"""The sixteen classes of Cutkosky's grasp taxonomy, and the hook.

M. R. Cutkosky, On grasp choice, grasp models, and the design of hands for
manufacturing tasks, IEEE Trans. Robotics and Automation 5 (1989) 269-279.

A class is a posture to close towards, what it opens to before, the object it suits, and
where the object sits: in the *palm* (moved up against it, then fingers and thumb close
around) or between the *pads* (thumb against fingers, the object centred between them).
All numbers are for a left hand, side-free: x towards the thumb, y to the fingers, z out
of the back. Angles in degrees, sizes in millimetres (half axes and radii).
"""

from dataclasses import dataclass, field

import numpy as np

from handclean.arrays import Floats
from handclean.kernels.solids import BOX, CYLINDER, ELLIPSOID

Four = tuple[float, float, float, float]


def posture(
    thumb: Four,
    mcp: Four,
    pip: Four,
    dip: Four | None = None,
    spread: Four = (4.0, 1.0, -2.0, -6.0),
) -> Floats:
    """(20,) [rad] angles from degrees, finger by finger; DIPs follow the PIPs if free.

    Parameters
    ----------
    thumb : abduction, then three flexions.
    mcp, pip, dip : flexion of index to little.
    spread : abduction of index to little, towards the thumb.
    """
    last = dip or tuple(0.6 * angle for angle in pip)
    fingers = np.array([spread, mcp, pip, last]).T
    out: Floats = np.radians(np.concatenate([thumb, fingers.ravel()]))
    return out


REST = posture(
    (4, -18, 2, -2), (2, 1, 2, 3), (6, 7, 7, 6), (4, 4, 4, 4), (8, 2, -5, -13)
)
"""The calibration posture: flat on the table, fingers spread, thumb out."""

RELAXED = posture((22, -4, 12, 14), (22, 24, 28, 32), (26, 30, 32, 30))


@dataclass(frozen=True, kw_only=True)
class Grasp:
    """One class of grasps.

    Attributes
    ----------
    seat : "palm" or "pads".
    kind : kind of solid, see ``handclean.kernels.solids``.
    size : four (low, high) ranges of the solid's numbers [mm].
    across : axis of the object in the hand's frame, the solid's z.
    at : [mm] where the object sits against the palm (x, y); not used between pads.
    closed, opened : (20,) [rad] posture to close towards and to open to before.
    meets : fingers whose pads meet the thumb's; "side" is the index finger's side.
    roll, pitch : [degrees] of the hand at the object: thumb up, fingers down.
    """

    seat: str
    kind: int
    size: tuple[tuple[float, float], ...]
    across: tuple[float, float, float]
    closed: Floats
    opened: Floats
    at: tuple[float, float] = (0.0, 0.0)
    meets: tuple[str, ...] = ()
    roll: float = 20.0
    pitch: float = 25.0
    family: str = field(default="power")


_FULL_MCP, _FULL_PIP = (80.0, 85.0, 88.0, 88.0), (100.0, 102.0, 102.0, 98.0)
_WRAP = posture((48, 48, 55, 60), _FULL_MCP, _FULL_PIP)
_WIDE = posture(
    (52, -18, 2, 5), (8, 6, 8, 10), (22, 24, 24, 22), spread=(9, 2, -6, -14)
)
_READY = posture((46, -10, 4, 8), (16, 16, 18, 20), (28, 30, 32, 30))
_PINCH_OPEN = posture((40, -12, 2, 6), (26, 28, 30, 32), (28, 32, 34, 32))
_FANNED = (14.0, 3.0, -9.0, -20.0)
_FANNED_OPEN = posture(
    (46, -22, 0, 4), (10, 8, 10, 12), (26, 28, 28, 26), spread=_FANNED
)


def _pinch(curl: float, others: float) -> Floats:
    """Thumb against fingertips; fingers that do not take part curl by ``others``."""
    return posture(
        (44, 12, 18, 24),
        (48 + curl, 46 + curl, 46 + others, 46 + others),
        (44, 46, 40 + others, 38 + others),
        (22, 22, 22, 20),
    )


_TIPS = posture((44, 14, 18, 22), (50, 50, 50, 52), (46, 50, 50, 46), (22, 24, 24, 22))
_RIM = posture((42, 8, 20, 24), (38, 36, 38, 42), (52, 56, 56, 52), spread=_FANNED)
_ALL = ("index", "middle", "ring", "little")

GRASPS: dict[str, Grasp] = {
    "large_diameter": Grasp(
        seat="palm",
        kind=CYLINDER,
        size=((32, 42), (0, 0), (60, 100), (1, 3)),
        across=(1.0, 0.15, 0.0),
        at=(0, 66),
        closed=_WRAP,
        opened=_WIDE,
        roll=75,
        pitch=5,
    ),
    "small_diameter": Grasp(
        seat="palm",
        kind=CYLINDER,
        size=((10, 15), (0, 0), (60, 100), (1, 2)),
        across=(1.0, 0.32, 0.0),
        at=(0, 74),
        closed=_WRAP,
        opened=_READY,
        roll=50,
        pitch=20,
    ),
    "medium_wrap": Grasp(
        seat="palm",
        kind=CYLINDER,
        size=((17, 27), (0, 0), (50, 90), (1, 2)),
        across=(1.0, 0.22, 0.0),
        at=(0, 70),
        closed=_WRAP,
        opened=_WIDE,
        roll=65,
        pitch=10,
    ),
    "adducted_thumb": Grasp(
        seat="palm",
        kind=CYLINDER,
        size=((11, 16), (0, 0), (70, 110), (1, 2)),
        across=(1.0, 0.55, 0.0),
        at=(0, 68),
        closed=posture((6, 4, 6, 8), _FULL_MCP, _FULL_PIP),
        opened=posture((26, -22, 2, 0), (16, 16, 18, 20), (28, 30, 32, 30)),
        roll=60,
        pitch=15,
    ),
    "light_tool": Grasp(
        seat="palm",
        kind=CYLINDER,
        size=((5, 9), (0, 0), (60, 100), (1, 2)),
        across=(1.0, 0.4, 0.0),
        at=(0, 76),
        closed=posture((30, 22, 30, 30), (62, 72, 80, 84), (72, 84, 96, 98)),
        opened=_READY,
        roll=45,
        pitch=25,
    ),
    "disk_power": Grasp(
        seat="palm",
        kind=CYLINDER,
        size=((40, 50), (0, 0), (8, 13), (2, 4)),
        across=(0.0, 0.0, 1.0),
        at=(2, 92),
        closed=posture(
            (30, 10, 45, 60), (50, 48, 50, 54), (90, 92, 92, 90), spread=_FANNED
        ),
        opened=_FANNED_OPEN,
        roll=10,
        pitch=25,
    ),
    "sphere_power": Grasp(
        seat="palm",
        kind=BOX,
        size=((0, 0), (0, 0), (0, 0), (30, 40)),
        across=(0.0, 0.0, 1.0),
        at=(6, 76),
        closed=posture(
            (46, 40, 45, 50), (70, 70, 72, 76), (80, 84, 84, 80), spread=_FANNED
        ),
        opened=_FANNED_OPEN,
        roll=25,
        pitch=25,
    ),
    "hook": Grasp(
        seat="palm",
        kind=CYLINDER,
        size=((8, 14), (0, 0), (50, 70), (1, 2)),
        across=(1.0, 0.1, 0.0),
        at=(0, 96),
        closed=posture((14, 4, 10, 12), (45, 48, 50, 52), (105, 106, 106, 102)),
        opened=posture((20, -10, 6, 8), (6, 6, 8, 10), (40, 42, 42, 38)),
        roll=30,
        pitch=40,
    ),
    "platform": Grasp(
        seat="palm",
        kind=BOX,
        size=((45, 70), (45, 70), (3, 8), (1, 2)),
        across=(0.0, 0.0, 1.0),
        at=(0, 105),
        closed=posture((30, -5, 12, 12), (22, 20, 20, 22), (24, 24, 24, 22)),
        opened=posture((26, -18, 2, 4), (4, 2, 4, 6), (10, 10, 10, 10)),
        roll=70,
        pitch=0,
        family="non-prehensile",
    ),
    "lateral_pinch": Grasp(
        seat="pads",
        kind=BOX,
        size=((0.7, 2.5), (14, 22), (20, 35), (0.3, 0.8)),
        across=(0.2, 1.0, -0.5),
        closed=posture((20, 26, 20, 26), (48, 54, 60, 64), (72, 78, 80, 76)),
        opened=posture((30, -14, 4, 2), (40, 46, 52, 58), (58, 64, 66, 64)),
        meets=("side",),
        roll=55,
        pitch=20,
        family="precision",
    ),
    "thumb_4_finger": Grasp(
        seat="pads",
        kind=CYLINDER,
        size=((9, 18), (0, 0), (40, 80), (1, 2)),
        across=(1.0, 0.0, 0.1),
        closed=_TIPS,
        opened=_PINCH_OPEN,
        meets=_ALL,
        roll=35,
        pitch=35,
        family="precision",
    ),
    "thumb_3_finger": Grasp(
        seat="pads",
        kind=CYLINDER,
        size=((7, 14), (0, 0), (30, 60), (1, 2)),
        across=(1.0, 0.0, 0.1),
        closed=_TIPS,
        opened=_PINCH_OPEN,
        meets=_ALL[:3],
        roll=35,
        pitch=35,
        family="precision",
    ),
    "thumb_2_finger": Grasp(
        seat="pads",
        kind=CYLINDER,
        size=((5, 10), (0, 0), (20, 50), (1, 2)),
        across=(1.0, 0.1, 0.1),
        closed=_pinch(2, 10),
        opened=_PINCH_OPEN,
        meets=_ALL[:2],
        roll=30,
        pitch=40,
        family="precision",
    ),
    "thumb_index": Grasp(
        seat="pads",
        kind=BOX,
        size=((3, 9), (4, 12), (6, 20), (0.5, 2)),
        across=(1.0, 0.0, 0.3),
        closed=_pinch(4, -24),
        opened=posture((38, -14, 2, 4), (28, 22, 22, 24), (26, 22, 22, 22)),
        meets=_ALL[:1],
        roll=25,
        pitch=45,
        family="precision",
    ),
    "disk_precision": Grasp(
        seat="pads",
        kind=CYLINDER,
        size=((22, 34), (0, 0), (4, 10), (1, 3)),
        across=(0.0, 0.55, -0.83),
        closed=_RIM,
        opened=_FANNED_OPEN,
        meets=_ALL,
        roll=5,
        pitch=35,
        family="precision",
    ),
    "sphere_precision": Grasp(
        seat="pads",
        kind=BOX,
        size=((0, 0), (0, 0), (0, 0), (18, 30)),
        across=(0.0, 0.55, -0.83),
        closed=_RIM,
        opened=_FANNED_OPEN,
        meets=_ALL,
        roll=10,
        pitch=40,
        family="precision",
    ),
    "tripod": Grasp(
        seat="pads",
        kind=ELLIPSOID,
        size=((7, 15), (8, 16), (10, 20), (0, 0)),
        across=(0.7, 0.3, 0.4),
        closed=_pinch(3, 14),
        opened=_PINCH_OPEN,
        meets=_ALL[:2],
        roll=25,
        pitch=45,
        family="precision",
    ),
}
"""Cutkosky's sixteen classes and the hook."""
