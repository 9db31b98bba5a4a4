"""Sensors of the gloves that can be simulated: what each answers to.

Strengths of cross-coupling are those of Wang & Neff (2013), table 1, in shares of the
active range. Hinges are those of the pose vector; a sensor's rotation is a sum of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handclean.errors import UnknownNameError


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """What a sensor answers to.

    Attributes
    ----------
    name : of the sensor.
    measures : hinge to factor; empty for one that only others stretch.
    low, high : [rad] active range of the sum.
    stretched : (other sensor, strength) pairs, in shares of the active range.
    together : strength of the product of the first two.
    """

    name: str
    measures: Mapping[str, float]
    low: float
    high: float
    stretched: tuple[tuple[str, float], ...] = ()
    together: float = 0.0


_RANGES_DEG = {  # [degrees]
    "T_TMC": ("thumb_cmc_flexion", -20, 50),
    "TI_ABD": ("thumb_cmc_abduction", -10, 60),
    "T_MCP": ("thumb_mcp_flexion", -10, 60),
    "T_IP": ("thumb_ip_flexion", -15, 80),
    "W_FLEX": ("wrist_flexion", -65, 70),
    "W_ABD": ("wrist_deviation", -35, 25),
}
_ABDUCTION_SENSORS = {
    "IM_ABD": ("index", "middle", 35),
    "MR_ABD": ("middle", "ring", 25),
    "RP_ABD": ("ring", "little", 35),
}
"""Fingers that sensors of abduction lie between, and how far these spread [degrees]
(chosen)."""

_FINGERS = {"I": "index", "M": "middle", "R": "ring", "P": "little"}
_STRETCH: dict[str, tuple[tuple[tuple[str, float], ...], float]] = {
    "TI_ABD": ((("T_TMC", 0.5),), 0.0),
    "IM_ABD": ((("I_MCP", 0.5), ("M_MCP", 0.75)), 0.8),
    "MR_ABD": ((("M_MCP", 1.2), ("R_MCP", 1.25)), -1.3),
    "RP_ABD": ((("R_MCP", 0.5), ("P_MCP", 0.6)), -0.6),
    "W_FLEX": ((("W_ABD", 0.45),), 0.0),
    "W_ABD": ((("W_FLEX", 0.36),), 0.0),
    "PALM_ARCH": (
        (
            ("T_TMC", 0.40), ("TI_ABD", 0.75), ("I_MCP", 0.18), ("IM_ABD", 0.18),
            ("M_MCP", 0.45), ("R_MCP", 0.62), ("MR_ABD", 0.3), ("P_MCP", 0.9),
            ("RP_ABD", 0.2),
        ),
        -0.4,
    ),
}  # fmt: skip


def _sensor(name: str) -> Sensor:
    stretched, together = _STRETCH.get(name, ((), 0.0))
    if name in _RANGES_DEG:
        hinge, low, high = _RANGES_DEG[name]
        measures = {hinge: 1.0}
    elif name in _ABDUCTION_SENSORS:
        one, other, high = _ABDUCTION_SENSORS[name]
        measures, low = (
            {f"{one}_mcp_abduction": 1.0, f"{other}_mcp_abduction": -1.0},
            -5,
        )
    elif name == "PALM_ARCH":
        measures, low, high = {}, 0, 40
    else:
        finger, part = _FINGERS[name[0]], name[2:].lower()
        measures = {f"{finger}_{part}_flexion": 1.0}
        low, high = {"mcp": (-25, 90), "pip": (-5, 105), "dip": (-5, 70)}[part]
    return Sensor(
        name=name,
        measures=measures,
        low=float(np.radians(low)),
        high=float(np.radians(high)),
        stretched=stretched,
        together=together,
    )


def _bend(name: str, finger: str) -> Sensor:
    parts = ("mcp", "ip") if finger == "thumb" else ("mcp", "pip")
    measures = {f"{finger}_{part}_flexion": 0.5 for part in parts}
    return Sensor(
        name=name, measures=measures, low=np.radians(-13.0), high=np.radians(98.0)
    )


_OF_18 = (
    "T_TMC TI_ABD T_MCP T_IP I_MCP I_PIP IM_ABD M_MCP M_PIP R_MCP R_PIP MR_ABD "
    "P_MCP P_PIP RP_ABD PALM_ARCH W_FLEX W_ABD"
)
_OF_22 = _OF_18
for _letter in "IMRP":
    _OF_22 = _OF_22.replace(f"{_letter}_PIP", f"{_letter}_PIP {_letter}_DIP")
_OF_14 = (
    "T_MCP T_IP TI_ABD I_MCP I_PIP IM_ABD M_MCP M_PIP MR_ABD R_MCP R_PIP RP_ABD "
    "P_MCP P_PIP"
)

GLOVES: dict[str, tuple[Sensor, ...]] = {
    "cyberglove18": tuple(map(_sensor, _OF_18.split())),
    "cyberglove22": tuple(map(_sensor, _OF_22.split())),
    "generic14": tuple(map(_sensor, _OF_14.split())),
    "generic5": tuple(
        _bend(name, finger)
        for name, finger in (
            ("THUMB", "thumb"), ("INDEX", "index"), ("MIDDLE", "middle"),
            ("RING", "ring"), ("PINKY", "little"),
        )
    ),
}  # fmt: skip
"""Sensors of the gloves that can be simulated, in their order."""


def sensors_of(glove: str) -> tuple[Sensor, ...]:
    """Return the sensors of a glove.

    Raises
    ------
    UnknownNameError
        If it cannot be simulated.
    """
    if glove not in GLOVES:
        raise UnknownNameError("simulate", "glove", glove, tuple(GLOVES))
    return GLOVES[glove]
