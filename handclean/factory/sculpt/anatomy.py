"""The template hand's flesh as tubes, in a posture with the fingers spread.

Side-free, as `handclean.hand.template`: (towards the thumb, towards the fingers, out of
the back). Fingers are spread while the skin is made, so that it cannot grow together.
Sizes are those of `sizes`.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Floats
from handclean.factory.sculpt.sizes import (
    FINGER,
    GIRTH_SHARE,
    HEEL,
    HYPOTHENAR,
    METACARPALS,
    PADS,
    STUB_MM,
    THENAR,
    THUMB,
    TIP_CAP_SHARE,
    WRIST,
)
from handclean.factory.sculpt.tubes import Tube, blend
from handclean.hand.surface import rest_joints
from handclean.hand.template import FINGERS, bone_frame, distal_length, template

SPREAD_DEG = {"thumb": 0.0, "index": 9.0, "middle": 1.0, "ring": -7.0, "little": -16.0}
"""[degrees] abduction of each finger while its skin is made, towards the thumb
(chosen)."""

WEB_REACH_SHARE = 0.42
"""[-] share of the first phalanx that the webs reach beyond the knuckle (see
`sizes`)."""

_MM = 1e-3
"""Metres of a millimetre."""


@dataclass(frozen=True, kw_only=True)
class Finger:
    """A finger in the spread posture.

    Attributes
    ----------
    name : which.
    tube : its flesh; zero of its axis is its first joint.
    joints : (4,) [m] its three joints and its tip along the axis.
    """

    name: str
    tube: Tube
    joints: Floats


@dataclass(frozen=True, kw_only=True)
class Anatomy:
    """A hand's flesh in the spread posture, side-free.

    Attributes
    ----------
    fingers : thumb to little finger.
    palm : tubes of the palm with the width over which each is blended in [m].
    webs : those of the webs, the same.
    """

    fingers: tuple[Finger, ...]
    palm: tuple[tuple[Tube, float], ...]
    webs: tuple[tuple[Tube, float], ...]

    def palm_distance(self, points: Floats) -> Floats:
        """(N,) [m] how far (N, 3) [m] places lie outside palm and wrist."""
        out = self.palm[0][0].distance(points)
        for tube, width in self.palm[1:]:
            out = blend(out, tube.distance(points), width)
        cut = -STUB_MM * _MM - points[:, 1]
        return -blend(-out, -cut, 5.0 * _MM)

    def distance(self, points: Floats) -> Floats:
        """(N,) [m] how far (N, 3) [m] places lie outside the hand."""
        out = self.palm_distance(points)
        for finger in self.fingers:
            width = (10.0 if finger.name == "thumb" else 6.0) * _MM
            out = blend(out, finger.tube.distance(points), width)
        for tube, width in self.webs:
            out = blend(out, tube.distance(points), width)
        return out

    def outward(self, points: Floats, step: float = 1e-4) -> Floats:
        """(N, 3) gradient of `distance`, by central differences of a step [m]."""
        out = np.zeros(points.shape)
        for k in range(3):
            ahead, behind = points.copy(), points.copy()
            ahead[:, k] += step
            behind[:, k] -= step
            out[:, k] = (self.distance(ahead) - self.distance(behind)) / (2.0 * step)
        return out

    def onto_skin(self, points: Floats, steps: int = 1) -> Floats:
        """(N, 3) [m] places moved to where `distance` is zero, by Newton's method."""
        out = points.copy()
        for _ in range(steps):
            slope = self.outward(out)
            size = np.maximum((slope**2).sum(axis=1), 0.1)
            far = np.clip(self.distance(out), -2.0 * _MM, 2.0 * _MM)
            out -= (far / size)[:, None] * slope
        return out


def turn_of(finger: str) -> Floats:
    """(3, 3) rotation of a finger from the zero posture to the spread one."""
    angle = np.radians(-SPREAD_DEG[finger])
    out: Floats = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
    return out


def anatomy() -> Anatomy:
    """Return the template's flesh."""
    tree = template("left")
    knuckles = rest_joints(tree)
    fingers = tuple(_finger(name) for name in FINGERS)
    palm = [(_wrist(), 0.0)]
    for name, row in METACARPALS.items():
        knuckle = knuckles[tree.bone(f"{name}_proximal")]
        palm.append((_metacarpal(knuckle, *row), 13.0 * _MM))
    mounds = (HEEL, THENAR, HYPOTHENAR, PADS)
    palm += [(_mound(*row), 10.0 * _MM) for row in mounds]
    webs = [
        web for first, second in pairwise(fingers[1:]) for web in _web(first, second)
    ]
    return Anatomy(
        fingers=fingers, palm=tuple(palm), webs=(*webs, *_thumb_web(fingers))
    )


def _finger(name: str) -> Finger:
    tree = template("left")
    bones = [b for b, bone in enumerate(tree.bones) if bone.startswith(name)]
    sizes = [float(np.linalg.norm(tree.offsets[b])) for b in bones[1:]]
    sizes.append(distal_length(tree, name))
    joints = np.concatenate([[0.0], np.cumsum(sizes)])
    rows = np.array(THUMB if name == "thumb" else FINGER)
    segment = rows[1:, 0].astype(np.int64)
    along = joints[segment] + rows[1:, 1] * np.array(sizes)[segment]
    knots = np.concatenate([[-rows[0, 1] * _MM], along])
    half, back, palm = GIRTH_SHARE[name] * _MM * rows[:, 2:].T
    tube = Tube(
        origin=rest_joints(tree)[bones[0]],
        frame=turn_of(name) @ bone_frame(name),
        at=knots,
        half=half,
        back=back,
        palm=palm,
        caps=(8.0 * _MM, TIP_CAP_SHARE[name] * sizes[2]),
    )
    return Finger(name=name, tube=tube, joints=joints)


def _wrist() -> Tube:
    y, half, back, palm = _MM * np.array(WRIST).T
    return Tube(
        origin=np.array([0.0, 0.0, -1.5]) * _MM,
        frame=np.eye(3),
        at=y,
        half=half,
        back=back,
        palm=palm,
        caps=(3.0 * _MM, 12.0 * _MM),
    )


def _frame(along: Floats, back: Floats) -> Floats:
    """(3, 3) frame with y along a direction and z as near another as can be."""
    y = along / np.linalg.norm(along)
    z = back - (back @ y) * y
    z /= np.linalg.norm(z)
    return np.column_stack([np.cross(y, z), y, z])


_Three = tuple[float, float, float]


def _metacarpal(knuckle: Floats, start: _Three, first: _Three, last: _Three) -> Tube:
    origin = np.array(start) * _MM
    size = float(np.linalg.norm(knuckle - origin))
    # The palm is hollow, the head of the bone tapers into the finger.
    middle = 0.5 * (np.array(first) + np.array(last)) * [0.98, 0.97, 0.86]
    half, back, palm = _MM * np.array([first, first, middle, last, last]).T
    return Tube(
        origin=origin,
        frame=_frame(knuckle - origin, np.array([0.0, 0.0, 1.0])),
        at=np.array([-10.0 * _MM, 0.0, 0.55 * size, size, size + 16.0 * _MM]),
        half=half,
        back=back,
        palm=palm,
        caps=(10.0 * _MM, 21.0 * _MM),
    )


def _mound(start: _Three, stop: _Three, half: float, back: float, palm: float) -> Tube:
    first, last = np.array(start) * _MM, np.array(stop) * _MM
    size = float(np.linalg.norm(last - first))
    ones = np.ones(3) * _MM
    return Tube(
        origin=first,
        frame=_frame(last - first, np.array([0.0, 0.0, 1.0])),
        at=np.array([0.0, 0.5, 1.0]) * size,
        half=half * ones,
        back=back * ones,
        palm=palm * ones,
        caps=(0.5 * size, 0.5 * size),
    )


def _across(start: Floats, stop: Floats, forward: _Three, sizes: Floats) -> Tube:
    """Return a sheet from one place to another: as wide (forward), high and deep."""
    size = float(np.linalg.norm(stop - start))
    frame = _frame(stop - start, np.array(forward))
    frame = np.column_stack([frame[:, 2], frame[:, 1], -frame[:, 0]])
    if frame[2, 2] < 0.0:
        frame[:, [0, 2]] *= -1.0
    half, back, palm = (_MM * np.full(2, value) for value in sizes)
    return Tube(
        origin=start,
        frame=frame,
        at=np.array([0.0, size]),
        half=half,
        back=back,
        palm=palm,
        caps=(2.0 * _MM, 2.0 * _MM),
    )


def _at(finger: Finger, along: float, back: float) -> Floats:
    """(3,) [m] the place so far along a finger, so far above its axis."""
    tube = finger.tube
    out: Floats = tube.origin + tube.frame @ np.array([0.0, along, back])
    return out


def _web(first: Finger, second: Finger) -> list[tuple[Tube, float]]:
    """Return the web between two fingers: its edge, and what fills it to the palm.

    Blending rounds its edge, which brings it further out.
    """
    out = []
    for share, sizes, low in (
        (WEB_REACH_SHARE - 0.05, (6.5, 3.0, 7.5), -3.5),
        (0.10, (9.0, 6.0, 12.0), -1.0),
    ):
        start, stop = (
            _at(finger, share * finger.joints[1] - sizes[0] * _MM, low * _MM)
            for finger in (first, second)
        )
        sheet = _across(start, stop, (0.0, 1.0, 0.0), np.array(sizes))
        out.append((sheet, 3.0 * _MM))
    return out


def _thumb_web(fingers: tuple[Finger, ...]) -> list[tuple[Tube, float]]:
    """Return the wedge of flesh between the thumb's and the index finger's metacarpals.

    It runs from their bases between them, widening as they part.
    """
    thumb = fingers[0].tube
    along = np.array([0.40, 0.88, 0.02])
    rows = (  # along, half width, height, depth [mm]
        (-6.0, 8.0, 10.0, 10.0),
        (0.0, 8.0, 10.0, 10.0),
        (22.0, 11.0, 9.5, 10.0),
        (44.0, 15.5, 6.0, 7.0),
        (48.0, 15.5, 5.0, 6.0),
    )
    y, half, back, palm = _MM * np.array(rows).T
    wedge = Tube(
        origin=thumb.origin + np.array([-2.0, 2.0, 4.0]) * _MM,
        frame=_frame(along, np.array([-0.15, 0.0, 1.0])),
        at=y,
        half=half,
        back=back,
        palm=palm,
        caps=(6.0 * _MM, 7.0 * _MM),
    )
    return [(wedge, 10.0 * _MM)]
