"""A BVH file read as the joint angles of hands, through a joint map.

What handclean wrote comes back as it was; see `handclean.io.bvh.own`. Of another
program's file the angles are found as `handclean.io.bvh.mapping` says.
"""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from handclean.arrays import runs
from handclean.errors import FileError
from handclean.hand.template import template
from handclean.io.bvh.hinge_fit import BoneFit
from handclean.io.bvh.mapping import map_motion, stand_in
from handclean.io.bvh.motion import BvhMotion, read_bvh
from handclean.io.bvh.own import OwnMotion, heads_of, own_hands, own_objects
from handclean.io.bvh.write import WORLD
from handclean.io.shared.joint_map import JointMap, shipped
from handclean.io.shared.reading import Reading
from handclean.io.shared.rotations import quaternion_from_matrix
from handclean.io.shared.settle import AGREEMENT_SHARE, METRES, settle_rate, settle_unit
from handclean.recording import Event, Motion, Recording
from handclean.remarks import Remark, remark

_UP = "+y"
"""Axis that points up in BVH of other programs, by custom: the format does not say."""


def read_bvh_angles(
    path: Path,
    joint_map: JointMap | None = None,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
) -> Reading:
    """Read a BVH file as the joint angles of a hand.

    What `handclean.io.bvh.write.write_bvh` wrote comes back as it was, every hand of
    it with its joint tree. Other files get the template hand with their bone lengths
    (see `stand_in`); their angles are NaN and not trusted in frames beside and between
    tracking jumps; the events list them. Parameters ``BVH`` say what the hinges could
    not hold.

    Parameters
    ----------
    joint_map : default: the shipped one that fits.
    rate_hz, unit : options that must agree with the file and the map.
    lenient : read what is there of a file that was cut off.

    Raises
    ------
    FileError
        If it is not a BVH file, or no map fits it.
    UsageError
        If an option contradicts it.
    """
    bvh = read_bvh(path, lenient=lenient)
    joint_map = joint_map or _fitting(path, bvh)
    rate = settle_rate(path, bvh.rate, rate_hz)
    joint_map, overruled = _in_unit(path, joint_map, unit)
    bvh = replace(bvh, remarks=(*bvh.remarks, *overruled))
    if joint_map.exact and (hands := own_hands(bvh, joint_map)):
        return _own_reading(bvh, joint_map, hands, rate)
    try:
        mapped = map_motion(bvh, joint_map, template("left"))
    except np.linalg.LinAlgError:
        raise FileError(path, "its rotations cannot be told apart") from None
    trusted = ~mapped.jumps
    motion = Motion(
        names=mapped.hinges,
        angles=np.where(trusted[:, None], mapped.angles, np.nan),
        translation=mapped.translation,
        rotation=quaternion_from_matrix(mapped.rotation),
        trusted=trusted,
    )
    tree = stand_in(mapped)
    recording = Recording(
        rate=rate,
        frames=bvh.frames,
        up_axis=_UP,
        skeletons={} if tree is None else {mapped.side: tree},
        motions={mapped.side: motion},
        events=tuple(
            Event(start=start, stop=stop, text="tracking jump, angles left out")
            for start, stop in runs(mapped.jumps)
        ),
        parameters={"BVH": _parameters(joint_map, mapped.fits)},
    )
    remarks = [*bvh.remarks]
    if mapped.jumps.any():
        count = np.count_nonzero(mapped.jumps)
        remarks.append(
            remark(
                "trust",
                f"{count} frames beside or between tracking jumps are left out",
                count=int(count),
            )
        )
    remarks += _not_held(mapped.fits)
    if tree is not None:
        remarks.append(
            remark(
                "subject",
                "its joint tree has the file's bone lengths "
                f"({100 * mapped.size:.0f} % of the template's) and the template's "
                "axes, which the angles are about",
            )
        )
    length = f"{joint_map.unit_m:g} m"
    return Reading(recording=recording, unit=length, remarks=tuple(remarks))


def _own_reading(
    bvh: BvhMotion, joint_map: JointMap, hands: list[OwnMotion], rate: float
) -> Reading:
    """What a file of handclean's holds, each hand and object by its name."""
    things = [*hands, *own_objects(bvh, joint_map)]
    fits = {f"{hand.name} {b}": fit for hand in hands for b, fit in hand.fits.items()}
    if len(hands) == 1:
        fits = hands[0].fits
    recording = Recording(
        rate=rate,
        frames=bvh.frames,
        up_axis=f"+{bvh.first_turn}" if bvh.first_turn else _UP,
        skeletons={thing.name: thing.tree for thing in things},
        motions={thing.name: thing.motion for thing in things},
        parameters={"BVH": _parameters(joint_map, fits)},
    )
    known = (*heads_of(bvh, joint_map), *(thing.name for thing in things))
    others = [n for n in bvh.names if n != WORLD and not n.startswith(known)]
    remarks = [*bvh.remarks, *_not_held(fits)]
    unsure = [f"{hand.name} {bone}" for hand in hands for bone in hand.unsure]
    if unsure:
        remarks.append(
            remark(
                "subject",
                "move too little to tell their hinge axes, so angles are about the "
                f"template's as far as that goes: {', '.join(unsure)}",
                bones=unsure,
            )
        )
    if others:
        remarks.append(
            remark(
                "left-out",
                f"neither a hand's nor an object's, left out: {', '.join(others[:10])}",
                joints=others[:10],
            )
        )
    length = f"{joint_map.unit_m:g} m"
    return Reading(recording=recording, unit=length, remarks=tuple(remarks))


def _parameters(joint_map: JointMap, fits: Mapping[str, BoneFit]) -> dict[str, object]:
    held = {bone: asdict(fit) for bone, fit in fits.items()}
    return {"joint_map": joint_map.name, "not_held": held}


def _not_held(fits: Mapping[str, BoneFit]) -> list[Remark]:
    """Say what hinges cannot hold, if it is more than a degree."""
    worst = max(fits, key=lambda bone: fits[bone].rms_deg)
    fit = fits[worst]
    if fit.rms_deg <= 1.0:
        return []
    said = f"{fit.rms_deg:.1f} degrees RMS, {fit.max_deg:.1f} at most"
    text = f"rotation that hinges cannot hold: up to {said} ({worst})"
    return [remark("fit", text, bone=worst, rms_deg=fit.rms_deg)]


def _fitting(path: Path, bvh: BvhMotion) -> JointMap:
    for candidate in shipped():
        if set(candidate.bones.values()) <= set(bvh.names):
            return candidate
        if candidate.exact and heads_of(bvh, candidate):
            return candidate
    shown = ", ".join(bvh.names[:4])
    maps = ", ".join(candidate.name for candidate in shipped())
    raise FileError(path, f"no joint map fits its joints ({shown} ...)", f"have {maps}")


def _in_unit(
    path: Path, joint_map: JointMap, unit: str | None
) -> tuple[JointMap, list[Remark]]:
    """Return the map with the unit that ``--unit`` says, and a line if it says another.

    Raises
    ------
    UsageError
        If that is no unit.
    """
    if unit is None:
        return joint_map, []
    given = METRES[settle_unit(path, None, unit, []).lower()]
    if abs(given - joint_map.unit_m) <= AGREEMENT_SHARE * joint_map.unit_m:
        return joint_map, []
    said = f"{joint_map.unit_m:g} m of joint map {joint_map.name}"
    text = f"--unit {unit} is taken, though the unit is the {said}"
    return replace(joint_map, unit_m=given), [
        remark("unit", text, taken=unit, overruled=said)
    ]
