"""From any BVH hierarchy to hinge angles of a hand, through a joint map.

Channels carry rest rotations (twists of 90 and 175 degrees are common), wrap around,
and may turn about a bone's axes in another order than our hinges do. Everything
therefore goes through rotation matrices.

Let S be the side-free frame of the hand: x towards the thumb, y towards the fingers, z
out of the back, laid so that the joints on the hand come to lie as on the template. A
bone's rotation in S is fitted by its hinges as `handclean.io.bvh.hinge_fit` says; what
they cannot hold is reported. A bone at the end of a finger whose end site is not given
is taken to lie in its frame as its parent bone lies in the parent's.

Tracking jumps (a joint at its stop for some frames and, within one frame, 20 to 90
degrees elsewhere) are steps of an angle faster than fingers move; the frames on both
sides of a step, and those between two opposite steps, are left out of the result.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Floats, runs
from handclean.errors import FileError
from handclean.hand.template import bone_frame, template
from handclean.io.bvh.hinge_fit import BoneFit, fit_hinges
from handclean.io.bvh.motion import BvhMotion
from handclean.io.shared.joint_map import JointMap, check_bones
from handclean.numerics.rotations import rotated
from handclean.tree import JointTree

MAX_HINGE_SPEED_RAD_S = np.radians(1800.0)
"""[rad/s] faster steps of an angle are tracking errors, not fingers (chosen)."""

_HAND_SIZE_RATIOS = (0.4, 1.8)
"""[-] sizes of hands against the template's; others are mistakes in a map's unit
(chosen)."""

_MAX_JUMP_S = 0.6
"""[s] two opposite steps within this time are one excursion (chosen)."""


@dataclass(frozen=True, kw_only=True)
class MappedMotion:
    """Hinge angles out of a BVH motion.

    Attributes
    ----------
    side : "left" or "right"
    hinges : names of the D hinges whose bones are mapped.
    angles : (T, D) [rad]
    jumps : (T,) frames beside or between tracking jumps.
    rotation : (T, 3, 3) the hand's frame to the (right-handed) laboratory.
    translation : (T, 3) [m] the hand's root in the laboratory.
    fits : how well the hinges hold each bone's motion.
    offsets : (B, 3) [m] from joint to joint in the zero posture, with the file's bone
        lengths, in the frame of a hand of that side; as the tree's where unmapped.
    size : the file's bones against those of the tree that the angles are of.
    unit_m : [m] the file's unit of length, as the map says.
    """

    side: str
    hinges: tuple[str, ...]
    angles: Floats
    jumps: Bools
    rotation: Floats
    translation: Floats
    fits: Mapping[str, BoneFit]
    offsets: Floats
    size: float
    unit_m: float


def map_motion(bvh: BvhMotion, joint_map: JointMap, tree: JointTree) -> MappedMotion:
    """Find the hinge angles of a hand that follow a BVH motion.

    Parameters
    ----------
    tree : a left hand, whose frame is S; its size does not matter.

    Raises
    ------
    FileError, UnknownNameError
        If the map does not fit the file or the tree.
    """
    check_bones(joint_map, tree)
    at = _joints(bvh, joint_map, tree)
    hand = _hand_frame(bvh, joint_map, tree, at)
    rest = {0: hand.T}
    angles = np.full((bvh.frames, len(tree.hinges)), np.nan)
    fits = {}
    for b, joint in at.items():
        if b == 0:
            continue
        hinges = np.flatnonzero(tree.hinge_bone == b)
        up = int(tree.parents[b])
        turned = rest[up] @ _relative(bvh, at[up], joint)
        along, own = _zero_direction(tree, b), _own_direction(bvh, tree, b, at)
        hinged = fit_hinges(turned, tree.axes[hinges], along, own)
        angles[:, hinges], rest[b] = hinged.angles, hinged.rest
        fits[tree.bones[b]] = hinged.fit
    found = np.isfinite(angles).all(axis=0)
    flip = np.array([1.0, 1.0, -1.0 if joint_map.left_handed else 1.0])
    side = "left" if np.linalg.det(hand) * flip[2] > 0 else "right"
    offsets = joint_map.unit_m * _offsets(bvh, tree, at, hand)
    known = np.flatnonzero(np.isfinite(offsets[:, 0]))
    size = _length(offsets[known]) / _length(tree.offsets[known])
    offsets = np.where(np.isfinite(offsets), offsets, size * tree.offsets)
    places, turns = bvh.forward()
    columns = hand * (np.array([-1.0, 1.0, 1.0]) if side == "right" else 1.0)
    return MappedMotion(
        side=side,
        hinges=tuple(np.array(tree.hinges)[found].tolist()),
        angles=angles[:, found],
        jumps=_jumps(angles[:, found], bvh.rate),
        rotation=flip[:, None] * (turns[:, at[0]] @ columns),
        translation=joint_map.unit_m * flip * places[:, at[0]],
        fits=fits,
        offsets=offsets * (np.array([-1.0, 1.0, 1.0]) if side == "right" else 1.0),
        size=size,
        unit_m=joint_map.unit_m,
    )


def is_a_hand(size: float) -> bool:
    """Whether bones of this size against the template's are a hand's."""
    low, high = _HAND_SIZE_RATIOS
    return low < size < high


def _length(offsets: Floats) -> float:
    """How long bones are, all together."""
    return float(np.linalg.norm(offsets, axis=1).sum())


def _offsets(
    bvh: BvhMotion, tree: JointTree, at: Mapping[int, int], hand: Floats
) -> Floats:
    """(B, 3) [unit of the file] from joint to joint in the zero posture, in S.

    Joints on the hand are where the file has them, those of fingers as far as the file
    has them in the tree's directions, which the angles are counted from; NaN unmapped.
    """
    out = np.full_like(tree.offsets, np.nan)
    for b, joint in at.items():
        up = int(tree.parents[b])
        if b:
            place = _mean_place(bvh, at[up], joint)
            far = float(np.linalg.norm(place))
            way = tree.offsets[b] / np.linalg.norm(tree.offsets[b])
            out[b] = hand.T @ place if up == 0 else far * way
    return out


def stand_in(mapped: MappedMotion) -> JointTree | None:
    """Return the hand that the angles are of: the template with the file's bones.

    Its hinge axes are the template's, as those that the angles are about. None if the
    map leaves some of its hinges out, or the size is no hand's.
    """
    tree = template(mapped.side)
    if set(tree.hinges) - set(mapped.hinges) or not is_a_hand(mapped.size):
        return None
    return replace(tree, offsets=mapped.offsets, scale=mapped.size)


def _joints(bvh: BvhMotion, joint_map: JointMap, tree: JointTree) -> dict[int, int]:
    """The joint of each mapped bone, parents first.

    Raises
    ------
    FileError
        If a joint is not there, or does not hang on its parent bone's joint.
    """
    at: dict[int, int] = {}
    where = f"joint map {joint_map.name}"
    for b, bone in enumerate(tree.bones):
        if bone not in joint_map.bones:
            continue
        name = joint_map.bones[bone]
        if name not in bvh.index:
            raise FileError(where, f"the file has no joint '{name}'")
        at[b] = bvh.index[name]
        up = at[int(tree.parents[b])] if b else -1
        joint = at[b]
        while b and joint >= 0 and joint != up:
            joint = int(bvh.parents[joint])
        if b and (joint < 0 or at[b] == up):
            wrong = f"joint '{name}' does not hang on '{bvh.names[up]}'"
            raise FileError(where, wrong)
    return at


def _chain(bvh: BvhMotion, top: int, joint: int) -> list[int]:
    """Joints below ``top`` down to ``joint``."""
    path = []
    while joint != top:
        path.append(joint)
        joint = int(bvh.parents[joint])
    return path[::-1]


def _relative(bvh: BvhMotion, top: int, joint: int) -> Floats:
    """(T, 3, 3) rotation of a joint's frame to that of a joint above."""
    out: Floats = np.tile(np.eye(3), (bvh.frames, 1, 1))
    for j in _chain(bvh, top, joint):
        out = out @ bvh.turns[:, j]
    return out


def _mean_place(bvh: BvhMotion, top: int, joint: int) -> Floats:
    """(3,) where a joint is in the frame of a joint above, on average."""
    place = np.zeros((bvh.frames, 3))
    turn: Floats = np.tile(np.eye(3), (bvh.frames, 1, 1))
    for j in _chain(bvh, top, joint):
        place += rotated(turn, bvh.places[:, j])
        turn = turn @ bvh.turns[:, j]
    return np.array(place.mean(axis=0))


def _unit(direction: Floats, where: str) -> Floats:
    with np.errstate(over="ignore"):
        length = float(np.linalg.norm(direction))
    if not 1e-9 < length < np.inf:
        raise FileError(where, "the bone has no length, so no direction")
    return direction / length


def _hand_frame(
    bvh: BvhMotion, joint_map: JointMap, tree: JointTree, at: Mapping[int, int]
) -> Floats:
    """(3, 3) columns: S in the frame of the root bone's joint; maybe a reflection.

    The orthogonal matrix that lays the joints on the hand best on the template's
    (Procrustes), of the two, rotation and reflection, the one with the given back, or
    the one that makes a hand of the given side.
    """
    bones = [b for b in at if b and tree.parents[b] == 0]
    ours = tree.offsets[bones]
    theirs = np.array([_mean_place(bvh, at[0], at[b]) for b in bones])
    _unit(theirs.ravel(), f"joint map {joint_map.name}, hand")
    u, _, v = np.linalg.svd(theirs.T @ ours)
    frames = [(u * [1.0, 1.0, sign]) @ v for sign in (1.0, -1.0)]
    if joint_map.back is not None:
        back = joint_map.back
        return max(frames, key=lambda frame: float(frame[:, 2] @ back))
    wanted = 1.0 if (joint_map.side == "left") != joint_map.left_handed else -1.0
    return max(frames, key=lambda frame: wanted * float(np.linalg.det(frame)))


def _zero_direction(tree: JointTree, bone: int) -> Floats:
    """(3,) where a bone points in the zero posture, in S."""
    children = np.flatnonzero(tree.parents == bone)
    if not len(children):
        return bone_frame(tree.bones[bone])[:, 1]
    return _unit(tree.offsets[children[0]], tree.bones[bone])


def _own_direction(
    bvh: BvhMotion, tree: JointTree, bone: int, at: Mapping[int, int]
) -> Floats:
    """(3,) where a bone points in the frame of its joint."""
    joint = at[bone]
    children = [int(c) for c in np.flatnonzero(tree.parents == bone) if c in at]
    if children:
        way = _mean_place(bvh, joint, at[children[0]])
    elif np.nan_to_num(bvh.ends[joint]).any():
        way = bvh.ends[joint]
    elif len(below := np.flatnonzero(bvh.parents == joint)):
        way = _mean_place(bvh, joint, int(below[0]))
    else:
        way = _mean_place(bvh, at[int(tree.parents[bone])], joint)
    return _unit(way, f"joint '{bvh.names[joint]}'")


def _jumps(angles: Floats, rate: float) -> Bools:
    """(T,) frames beside a step too fast, or between two opposite ones."""
    jumps = np.zeros(len(angles), dtype=bool)
    for steps in np.diff(angles, axis=0).T:
        before = (0, 0.0)
        for start, stop in runs(np.abs(steps) > MAX_HINGE_SPEED_RAD_S / rate):
            height = float(steps[start:stop].sum())
            jumps[start : stop + 1] = True
            back = height * before[1] < 0
            if back and start - before[0] < _MAX_JUMP_S * rate:
                jumps[before[0] : start] = True
            before = (stop, height)
    return jumps
