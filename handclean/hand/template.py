"""The built-in hand: 16 joints, 26 degrees of freedom, sized by length and breadth.

Written side-free, in the coordinates (towards the thumb, towards the fingers, out of
the back), which are those of a left hand's right-handed frame; a right hand is the
mirror image. The zero posture is the flat hand, fingers straight and parallel, the
thumb in the palm's plane `THUMB_YAW_RAD` away from them.

Lengths
    Segment lengths are fractions of hand length, wrist to metacarpal heads included:
    Buchholz, Armstrong and Goldstein, Anthropometric data for describing the kinematics
    of the human hand, Ergonomics 35 (1992) 261-273. Where the metacarpal heads lie
    across the hand is in fractions of hand breadth. Mean hand length and breadth are
    those of Greiner, Hand anthropometry of U.S. Army personnel, Natick TR-92/011
    (1991): men 193.8 and 90.4 mm, women 180.5 and 79.4 mm; the template takes the mean
    of the two.

Limits
    Active ranges of the American Academy of Orthopaedic Surgeons (Joint motion: method
    of measuring and recording, 1965), widened by what supple hands reach; abduction
    after Lin, Wu and Huang, Modeling the constraints of human hand motion (2000); the
    thumb's base after Cooney et al., The kinesiology of the thumb trapeziometacarpal
    joint, J Bone Joint Surg 63-A (1981) 1371-1381.

Axes
    Abduction is about the normal of the palm and comes first, flexion about the axis
    across the finger second. The thumb's first joint abducts out of the palm's plane,
    then flexes across it; its outer two joints flex about one axis, turned by
    `THUMB_ROLL_RAD` about the thumb, since the thumb's nail looks sideways.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats
from handclean.errors import UsageError
from handclean.tree import MIRROR, JointTree

HAND_LENGTH_M = 0.1872
"""[m] wrist crease to tip of the middle finger, mean of men and women (Greiner
1991)."""

HAND_BREADTH_M = 0.0849
"""[m] across the metacarpal heads, mean of men and women (Greiner 1991)."""

THUMB_YAW_RAD = np.radians(40.0)
"""[rad] between the thumb and the fingers in the zero posture (chosen)."""

THUMB_ROLL_RAD = np.radians(60.0)
"""[rad] by which the axis of the thumb's outer joints is turned about it (chosen)."""

FINGERS = ("thumb", "index", "middle", "ring", "little")


class _Finger(NamedTuple):
    reach: float  # wrist to knuckle, fraction of hand length
    across: float  # knuckle towards the thumb, fraction of hand breadth
    dorsal: float  # knuckle out of the back, fraction of hand breadth
    segments: tuple[float, float, float]  # fractions of hand length


_FINGERS = {
    "index": _Finger(0.463, 0.300, 0.000, (0.245, 0.143, 0.097)),
    "middle": _Finger(0.446, 0.050, 0.024, (0.266, 0.170, 0.108)),
    "ring": _Finger(0.421, -0.190, 0.000, (0.244, 0.165, 0.107)),
    "little": _Finger(0.414, -0.385, -0.047, (0.204, 0.117, 0.093)),
}
_THUMB = _Finger(0.118, 0.190, -0.105, (0.251, 0.196, 0.158))

_LIMITS_DEG = {  # [degrees]
    "thumb_cmc_abduction": (-25.0, 70.0),
    "thumb_cmc_flexion": (-30.0, 60.0),
    "thumb_mcp_flexion": (-20.0, 80.0),
    "thumb_ip_flexion": (-30.0, 95.0),
    "index_mcp_abduction": (-25.0, 35.0),
    "middle_mcp_abduction": (-25.0, 25.0),
    "ring_mcp_abduction": (-30.0, 25.0),
    "little_mcp_abduction": (-45.0, 25.0),
    "mcp_flexion": (-40.0, 100.0),
    "pip_flexion": (-15.0, 120.0),
    "dip_flexion": (-20.0, 95.0),
    "wrist_flexion": (-80.0, 90.0),
    "wrist_deviation": (-45.0, 35.0),
}
"""[degrees] lower and upper limit of each hinge (see above)."""

FOREARM_SHARE = 1.35
"""Wrist to elbow, share of hand length; nothing hangs on its end (chosen)."""

_X, _Y, _Z = np.eye(3)


def _thumb_frame() -> Floats:
    """(3, 3) the thumb's bones at zero: columns sideways, along it, out of its nail."""
    along = np.sin(THUMB_YAW_RAD) * _X + np.cos(THUMB_YAW_RAD) * _Y
    aside = np.cos(THUMB_YAW_RAD) * _X - np.sin(THUMB_YAW_RAD) * _Y
    nail = np.cos(THUMB_ROLL_RAD) * _Z + np.sin(THUMB_ROLL_RAD) * aside
    return np.column_stack([np.cross(along, nail), along, nail])


def bone_frame(bone: str) -> Floats:
    """Return the rest frame of a bone, side-free: y along it, z out of its back.

    The hand's and the fingers' are the common frame; the thumb's look along the thumb.
    Marker sets give places in these frames.

    Parameters
    ----------
    bone : its name.

    Returns
    -------
    (3, 3) columns are the frame's axes
    """
    return _thumb_frame() if bone.startswith("thumb") else np.eye(3)


def template(
    side: str,
    length_m: float = HAND_LENGTH_M,
    breadth_m: float = HAND_BREADTH_M,
    *,
    forearm: bool = False,
    subject: str = "template",
) -> JointTree:
    """Return the built-in hand.

    Parameters
    ----------
    side : "left" or "right"
    length_m : [m] wrist crease to tip of the middle finger.
    breadth_m : [m] across the metacarpal heads, thumb not counted.
    forearm : whether a forearm hangs on the wrist, with two more hinges at the end.
    subject : whose hand it is.

    Raises
    ------
    UsageError
        If the side is unknown or the size is not a hand's.
    """
    if side not in ("left", "right"):
        raise UsageError(f"side should be left or right, not '{side}'")
    if not (0.08 < length_m < 0.30 and 0.03 < breadth_m < 0.16):
        raise UsageError(
            f"a hand of {1e3 * length_m:.4g} x {1e3 * breadth_m:.4g} mm: length should "
            "lie between 80 and 300 mm, breadth between 30 and 160 mm"
        )
    tree = _left(length_m, breadth_m, forearm, subject)
    return tree if side == "left" else tree.mirrored()


def _left(length: float, breadth: float, forearm: bool, subject: str) -> JointTree:
    bones, joints, parents, offsets = ["hand"], ["wrist"], [-1], [np.zeros(3)]
    hinges: list[str] = []
    hinge_bone: list[int] = []
    axes: list[Floats] = []
    for name in FINGERS:
        finger = _THUMB if name == "thumb" else _FINGERS[name]
        frame = bone_frame(name)
        parts = ("cmc", "mcp", "ip") if name == "thumb" else ("mcp", "pip", "dip")
        if name == "thumb":
            segments = ("metacarpal", "proximal", "distal")
        else:
            segments = ("proximal", "middle", "distal")
        at = _knuckle(finger, length, breadth)
        for part, segment, size in zip(parts, segments, finger.segments, strict=True):
            bone = len(bones)
            bones.append(f"{name}_{segment}")
            joints.append(f"{name}_{part}")
            parents.append(0 if part == parts[0] else bone - 1)
            offsets.append(at)
            if part == parts[0]:
                hinges.append(f"{name}_{part}_abduction")
                axes.append(np.cross(_Z, frame[:, 1]) if name == "thumb" else -_Z)
                hinge_bone.append(bone)
            hinges.append(f"{name}_{part}_flexion")
            axes.append(_Z if part == "cmc" else -frame[:, 0])
            hinge_bone.append(bone)
            at = size * length * frame[:, 1]
    if forearm:
        bones.append("forearm")
        joints.append("forearm_wrist")
        parents.append(0)
        offsets.append(np.zeros(3))
        hinges += ["wrist_flexion", "wrist_deviation"]
        hinge_bone += [len(bones) - 1] * 2
        axes += [_X, _Z]
    return JointTree(
        kind="hand",
        side="left",
        bones=tuple(bones),
        joints=tuple(joints),
        parents=np.array(parents, dtype=np.int64),
        offsets=np.array(offsets),
        hinges=tuple(hinges),
        hinge_bone=np.array(hinge_bone, dtype=np.int64),
        axes=np.array(axes),
        limits=np.radians([_limits_of(name) for name in hinges]),
        subject=subject,
        scale=length / HAND_LENGTH_M,
    )


def _knuckle(finger: _Finger, length: float, breadth: float) -> Floats:
    """(3,) [m] where a finger's first joint is, side-free."""
    across, dorsal = finger.across * breadth, finger.dorsal * breadth
    reach = finger.reach * length
    forward = np.sqrt(max(reach**2 - across**2 - dorsal**2, 0.0))
    return np.array([across, forward, dorsal])


def _limits_of(hinge: str) -> tuple[float, float]:
    return _LIMITS_DEG.get(hinge) or _LIMITS_DEG[hinge.split("_", 1)[1]]


def distal_length(tree: JointTree, finger: str) -> float:
    """Return the length of a finger's last segment, from its joint to the tip.

    The tree has no joint at the tip; the segment scales with the middle one.

    Parameters
    ----------
    finger : "thumb", "index", "middle", "ring" or "little".

    Returns
    -------
    [m]

    Raises
    ------
    KeyError
        If the tree has no such finger.
    """
    shape = _THUMB if finger == "thumb" else _FINGERS[finger]
    last = tree.bone(f"{finger}_distal")
    middle = float(np.linalg.norm(tree.offsets[last]))
    return middle * shape.segments[2] / shape.segments[1]


def bone_places(tree: JointTree, bones: list[str], at: Floats) -> Floats:
    """(M, 3) [m] places in the tree's bones of places in their rest frames.

    Parameters
    ----------
    bones : M bone names.
    at : (M, 3) [m] side-free: sideways towards the thumb, along the bone, out of its
        back; on the template hand, so that they scale with the tree.
    """
    turned = [bone_frame(bone) @ place for bone, place in zip(bones, at, strict=True)]
    mirror = MIRROR if tree.side == "right" else np.ones(3)
    return tree.scale * np.array(turned).reshape(-1, 3) * mirror
