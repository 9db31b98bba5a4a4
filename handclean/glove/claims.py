"""Whether what is claimed of a recording can be: hinges, angles, a hand held still."""

from collections.abc import Mapping

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import FileError, UnknownNameError, Where
from handclean.glove.gloves import Glove
from handclean.glove.hands import GloveHand
from handclean.glove.readings import smooth
from handclean.hand.pronation import with_pronation
from handclean.hand.template import template
from handclean.remarks import Remark, first_of, remark

_REMARK_BEYOND_RAD, _ERROR_BEYOND_RAD = np.radians(5.0), np.radians(20.0)
"""[rad] beyond an active range: worth a remark; more than any hand does (chosen)."""

_MOTION_CUTOFF_HZ = 2.0
"""[Hz] readings that change more slowly do so because the hand moves (chosen)."""

_MOST_DRIFT_RAD = np.radians(10.0)
"""[rad] by which readings of a pose may drift, with the sensor's noise (chosen)."""

_MOST_DRIFT_SHARE = 0.05
"""[-] the same in shares of the converter's range, where a sensor's own is not known
(chosen)."""

_DRIFT_QUANTILES = (0.025, 0.975)
"""[-] quantiles of the readings between which drift is measured (chosen)."""


def expect_pose(
    where: Where, hand: GloveHand, pose: Mapping[str, float]
) -> tuple[Remark, ...]:
    """Expect hinges that hands have at angles they can take; remark on what is odd.

    Parameters
    ----------
    where : what errors and remarks begin with.
    pose : hinge to angle [rad].

    Raises
    ------
    UnknownNameError
        If a hinge does not exist.
    FileError
        If one is far beyond what it can do.
    """
    tree = with_pronation(template("right", forearm=True))
    known = dict.fromkeys((*tree.hinges, *hand.hinges, *hand.reference))
    for hinge, angle in pose.items():
        if hinge not in known:
            raise UnknownNameError(where, "joint", hinge, known)
        if not np.isfinite(angle):
            raise FileError(where, f"{hinge} is {angle}", "give an angle in degrees")
        if hinge in tree.hinges:
            low, high = tree.limits[tree.hinges.index(hinge)]
            _expect(where, hinge, angle, low, high)
    names = list(pose)
    rotations = hand.from_hinges(names) @ np.array([pose[name] for name in names])
    return expect_reachable(where, hand, rotations)


def expect_reachable(
    where: Where, hand: GloveHand, rotations: Floats
) -> tuple[Remark, ...]:
    """Expect rotations about their active ranges; remark on those that lie beyond.

    Parameters
    ----------
    rotations : (R,) [rad], NaN where not known.

    Raises
    ------
    FileError
        If one lies far beyond.
    """
    remarks: list[Remark] = []
    for name, angle, (low, high) in zip(
        hand.rotations, rotations, hand.ranges, strict=True
    ):
        if (
            np.isfinite(angle)
            and _expect(where, name, angle, low, high) > _REMARK_BEYOND_RAD
        ):
            remarks.append(
                remark(
                    "fit",
                    f"{where}: {name} is {np.degrees(angle):g} degrees; its active "
                    f"range goes from {np.degrees(low):g} to {np.degrees(high):g}",
                    rotation=name,
                    angle_rad=float(angle),
                )
            )
    return tuple(remarks)


def _expect(where: Where, name: str, angle: float, low: float, high: float) -> float:
    """[rad] by how much an angle lies beyond a range; far beyond is an error."""
    beyond = max(low - angle, angle - high)
    if beyond > _ERROR_BEYOND_RAD:
        raise FileError(
            where,
            f"{name} is {np.degrees(angle):g} degrees",
            f"it goes from {np.degrees(low):g} to {np.degrees(high):g}",
        )
    return beyond


def expect_measured(where: Where, glove: Glove, rotations: Floats) -> None:
    """Expect a rotation that the glove measures among those known.

    Parameters
    ----------
    where : what the error is about.
    rotations : (R,) [rad] in the order of ``glove.hand``, NaN where not known.

    Raises
    ------
    FileError
        If there is none: nothing could be learnt.
    """
    measured = [row.rotation for row in glove.measured]
    places = [glove.hand.index(name) for name in measured]
    if not np.isfinite(rotations[places]).any():
        few = first_of(measured)
        raise FileError(
            where, f"{glove.name} measures nothing of it", f"it measures {few}"
        )


def moved(glove: Glove, times: Floats, readings: Floats, rows: Ints) -> str:
    """Say which sensors moved where the hand should be still, or nothing.

    Parameters
    ----------
    times : (T,) [s]; readings : (T, S).
    rows : frames that are looked at.
    """
    slow = smooth(glove, times, readings, _MOTION_CUTOFF_HZ)[rows]
    found: dict[str, tuple[float, str]] = {}
    for row in glove.measured:
        sensor = row.measured_by
        values = slow[:, glove.sensors.index(sensor)]
        if not np.isfinite(values).any():
            continue
        low, high = np.nanquantile(values, _DRIFT_QUANTILES)
        if sensor in glove.reading:
            first, last = glove.reading[sensor]
            active = float(np.ptp(glove.hand.ranges[glove.hand.index(row.rotation)]))
            turn = active * (high - low) / abs(last - first)
            words = f"by {np.degrees(turn):.0f} degrees"
            excess = turn / _MOST_DRIFT_RAD
        elif glove.limits is not None:
            full = glove.limits[1] - glove.limits[0]
            words = f"by {high - low:.0f} of {full:g}"
            excess = (high - low) / (_MOST_DRIFT_SHARE * full)
        else:
            continue
        if excess > 1.0:
            found[sensor] = (excess, words)
    most = sorted(found, key=lambda sensor: -found[sensor][0])
    if not most:
        return ""
    words = ", ".join(f"{sensor} {found[sensor][1]}" for sensor in most[:4])
    more = f" and {len(most) - 4} more" if len(most) > 4 else ""
    return f"the hand should be still, but there moved {words}{more}"
