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
from handclean.io.bvh.mapping import MappedMotion, is_a_hand, map_motion, stand_in
from handclean.io.bvh.motion import BvhMotion, read_bvh
from handclean.io.bvh.own import OwnMotion, heads_of, own_hands, own_objects
from handclean.io.bvh.write import WORLD
from handclean.io.shared.joint_map import JointMap, for_hands, shipped
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
    maps = _fitting(path, bvh) if joint_map is None else [joint_map]
    rate = settle_rate(path, bvh.rate, rate_hz)
    maps, overruled = _in_unit(path, maps, unit)
    bvh = replace(bvh, remarks=(*bvh.remarks, *overruled))
    if maps[0].exact and (hands := own_hands(bvh, maps[0])):
        return _own_reading(bvh, maps[0], hands, rate)
    try:
        mapped = [_mapped(bvh, one) for one in maps]
    except np.linalg.LinAlgError:
        raise FileError(path, "its rotations cannot be told apart") from None
    return _mapped_reading(bvh, maps, mapped, rate)


def _mapped(bvh: BvhMotion, joint_map: JointMap) -> MappedMotion:
    """Map one hand, in the first of the map's units with which it is a hand's size."""
    tree = template("left")
    mapped = map_motion(bvh, joint_map, tree)
    for unit_m in joint_map.other_units_m:
        if not is_a_hand(mapped.size) and is_a_hand(
            mapped.size * unit_m / joint_map.unit_m
        ):
            return map_motion(bvh, replace(joint_map, unit_m=unit_m), tree)
    return mapped


def _mapped_reading(
    bvh: BvhMotion, maps: list[JointMap], mapped: list[MappedMotion], rate: float
) -> Reading:
    """What the file of another program holds, each hand by its side."""
    names = _names(maps, mapped)
    hands = dict(zip(names, mapped, strict=True))
    trees = {name: stand_in(hand) for name, hand in hands.items()}
    several = len(hands) > 1
    fits = {
        f"{name} {bone}" if several else bone: fit
        for name, hand in hands.items()
        for bone, fit in hand.fits.items()
    }
    recording = Recording(
        rate=rate,
        frames=bvh.frames,
        up_axis=_UP,
        skeletons={name: tree for name, tree in trees.items() if tree is not None},
        motions={name: _motion(hand) for name, hand in hands.items()},
        events=tuple(
            Event(
                start=start,
                stop=stop,
                text="tracking jump, angles left out",
                model=name if several else "",
            )
            for name, hand in hands.items()
            for start, stop in runs(hand.jumps)
        ),
        parameters={"BVH": _parameters(maps[0], fits)},
    )
    remarks = [*bvh.remarks]
    for name, hand in hands.items():
        remarks += _of_hand(hand, trees[name] is not None, name if several else "")
    remarks += _not_held(fits)
    if mapped[0].unit_m != maps[0].unit_m:
        text = (
            f"its unit is taken for {mapped[0].unit_m:g} m: with {maps[0].unit_m:g} m, "
            f"as joint map {maps[0].name} has it, a hand is none (--unit says another)"
        )
        remarks.append(remark("unit", text, metres=mapped[0].unit_m))
    length = f"{mapped[0].unit_m:g} m"
    return Reading(recording=recording, unit=length, remarks=tuple(remarks))


def _names(maps: list[JointMap], mapped: list[MappedMotion]) -> list[str]:
    """Name hands by their sides; where two have one, by how their joints begin, too."""
    sides = [hand.side for hand in mapped]
    return [
        side if sides.count(side) == 1 else f"{one.head.strip('_: ')}_{side}"
        for one, side in zip(maps, sides, strict=True)
    ]


def _motion(mapped: MappedMotion) -> Motion:
    trusted = ~mapped.jumps
    return Motion(
        names=mapped.hinges,
        angles=np.where(trusted[:, None], mapped.angles, np.nan),
        translation=mapped.translation,
        rotation=quaternion_from_matrix(mapped.rotation),
        trusted=trusted,
    )


def _of_hand(mapped: MappedMotion, has_tree: bool, name: str) -> list[Remark]:
    """Remarks on a hand out of the file of another program."""
    remarks = []
    of_it = f" of '{name}'" if name else ""
    if mapped.jumps.any():
        count = int(np.count_nonzero(mapped.jumps))
        text = f"{count} frames{of_it} beside or between tracking jumps are left out"
        remarks.append(remark("trust", text, count=count, model=name))
    if has_tree:
        text = (
            f"{f'the joint tree{of_it}' if name else 'its joint tree'} has the file's "
            f"bone lengths ({100 * mapped.size:.0f} % of the template's) and the "
            "template's axes, which the angles are about"
        )
        remarks.append(remark("subject", text, model=name))
    return remarks


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


def _fitting(path: Path, bvh: BvhMotion) -> list[JointMap]:
    """Return the shipped map whose joints are there, for each hand of the file."""
    for candidate in shipped():
        if found := for_hands(candidate, bvh.names):
            return found
        if candidate.exact and heads_of(bvh, candidate):
            return [candidate]
    shown = ", ".join(bvh.names[:4])
    maps = ", ".join(candidate.name for candidate in shipped())
    raise FileError(path, f"no joint map fits its joints ({shown} ...)", f"have {maps}")


def _in_unit(
    path: Path, maps: list[JointMap], unit: str | None
) -> tuple[list[JointMap], list[Remark]]:
    """Return maps with the unit that ``--unit`` says, and a line if it says another.

    Raises
    ------
    UsageError
        If that is no unit.
    """
    if unit is None:
        return maps, []
    given = METRES[settle_unit(path, None, unit, []).lower()]
    first = maps[0]
    others = [replace(one, unit_m=given, other_units_m=()) for one in maps]
    near = (
        abs(given - known) <= AGREEMENT_SHARE * known
        for known in (first.unit_m, *first.other_units_m)
    )
    if any(near):
        return others, []
    said = f"{first.unit_m:g} m of joint map {first.name}"
    text = f"--unit {unit} is taken, though the unit is the {said}"
    return others, [remark("unit", text, taken=unit, overruled=said)]
