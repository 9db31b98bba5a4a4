"""Where an object sits in a hand that is about to close on it."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from handclean.arrays import Floats, Ints
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.hand.template import FINGERS, bone_frame
from handclean.kernels import solids
from handclean.simulation.grasps import Grasp
from handclean.simulation.people import Person

PAD_DEPTH_M = 0.0006
"""[m] how deep a segment sinks into its own pad when it touches (chosen)."""

_ROOTS = tuple(f"{finger}_proximal" for finger in FINGERS[1:])


@dataclass(frozen=True, kw_only=True)
class Solid:
    """An object: kind and size as in ``handclean.kernels.solids``, and its frame.

    Attributes
    ----------
    size : (4,) [m]
    frame : (3, 4) rotation and origin [m], in the hand's frame; kept row by row, as
        kernels are compiled for.
    """

    kind: int
    size: Floats
    frame: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "frame", np.ascontiguousarray(self.frame))


def pose_of(person: Person, angles: Floats) -> Floats:
    """(7 + D,) pose of a hand at the origin with these angles [rad]."""
    pose = neutral_pose(person.tree)
    pose[7:] = angles
    return pose


def _pads(person: Person, bones: list[str]) -> Model:
    """Points on the skin: the pads of distal segments, the side of the middle one."""
    at: list[Floats] = []
    index = np.array([person.tree.bone(bone) for bone in bones], dtype=np.int64)
    for bone in bones:
        frame = bone_frame(bone)
        radius = person.flesh.radius[person.flesh.bone == person.tree.bone(bone)][0]
        if bone.endswith("middle"):
            length = float(np.linalg.norm(person.tree.offsets[index[len(at)] + 1]))
            at.append(frame @ [radius, 0.6 * length, 0.0])
        else:
            length = person.tips[bone.split("_")[0]]
            at.append(frame @ [0.0, 0.55 * length, -radius])
    return Model(tree=person.tree, labels=tuple(bones), bone=index, at=np.array(at))


def _meeting(grasp: Grasp) -> list[str]:
    if grasp.meets == ("side",):
        return ["thumb_distal", "index_middle"]
    return ["thumb_distal", *(f"{finger}_distal" for finger in grasp.meets)]


def meet(person: Person, grasp: Grasp, closed: Floats) -> Floats:
    """Change a posture a little so that the thumb's pad meets the fingers'.

    Several fingers keep side by side along the hand's x, the thumb opposing their mean.
    """
    bones = _meeting(grasp)
    pads = _pads(person, bones)
    fingers = {bone.split("_")[0] for bone in bones}
    free = [d for d in range(20) if person.tree.hinges[d].split("_")[0] in fingers]
    count = len(bones) - 1
    beside = 0.017 * person.tree.scale * (0.5 * (count - 1) - np.arange(count))
    low, high = person.reach[free].T
    start = np.clip(closed[free], low + 1e-6, high - 1e-6)

    def residual(x: Floats) -> Floats:
        angles = closed.copy()
        angles[free] = x
        thumb, *others = marker_positions(pads, pose_of(person, angles)[None])[0]
        gaps = np.array(others) - thumb - beside[:, None] * [1.0, 0.0, 0.0]
        return np.concatenate([gaps.ravel() / 0.002, (x - start) / np.radians(12.0)])

    found = least_squares(residual, start, bounds=(low, high), max_nfev=25)
    angles: Floats = closed.copy()
    angles[free] = found.x
    return angles


def _frame(third: Floats, first: Floats) -> Floats:
    """(3, 3) right-handed frame with z along ``third`` and x as near ``first``."""
    z = third / np.linalg.norm(third)
    x = first - z * (z @ first)
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _tilted(axis: tuple[float, float, float], rng: np.random.Generator) -> Floats:
    out: Floats = np.array(axis) / np.linalg.norm(axis) + rng.normal(0.0, 0.08, 3)
    return out


def between_pads(
    person: Person,
    grasp: Grasp,
    size: Floats,
    opened: Floats,
    closed: Floats,
    rng: np.random.Generator,
) -> Solid | None:
    """Put the object where thumb and fingers, closing, are as far apart as it is wide.

    None if they never are.
    """
    pads = _pads(person, _meeting(grasp))
    share = np.linspace(0.0, 1.0, 101)
    poses = np.array([pose_of(person, opened + s * (closed - opened)) for s in share])
    places = marker_positions(pads, poses)
    thumb, others = places[:, 0], places[:, 1:].mean(axis=1)
    aperture = np.linalg.norm(others - thumb, axis=1)
    wide = 2.0 * (size[0] + (size[3] if grasp.kind != solids.ELLIPSOID else 0.0))
    larger = np.flatnonzero(aperture > wide)
    if len(larger) == 0 or larger[-1] < 15 or larger[-1] == len(share) - 1:
        return None
    k = larger[-1]
    towards = (others[k] - thumb[k]) / aperture[k]
    turn = _frame(_tilted(grasp.across, rng), towards)
    if grasp.kind == solids.BOX and size[1] > 0.0:  # its thin side faces the thumb
        turn = _frame(towards, _tilted(grasp.across, rng))[:, [2, 0, 1]]
    centre = 0.5 * (others[k] + thumb[k]) + rng.normal(0.0, 0.0012, 3)
    return Solid(kind=grasp.kind, size=size, frame=np.column_stack([turn, centre]))


def against_palm(
    person: Person,
    grasp: Grasp,
    size: Floats,
    opened: Floats,
    rng: np.random.Generator,
) -> Solid:
    """Move the object up against palm and roots of the fingers until it touches."""
    turn = _frame(_tilted(grasp.across, rng), np.array([0.0, 1.0, 0.3]))
    x, y = 1e-3 * np.array(grasp.at) * person.tree.scale + rng.normal(0.0, 0.003, 2)
    frame = np.column_stack([turn, [x, y, -0.25]])
    pose = pose_of(person, opened)
    rests_on = [b == "hand" or b in _ROOTS for b in person.tree.bones]
    palm = np.flatnonzero(np.array(rests_on)[person.flesh.bone])
    for _ in range(200):
        gap = gaps_to(
            person, pose, Solid(kind=grasp.kind, size=size, frame=frame), palm
        ).min()
        if gap < 1e-4 or frame[2, 3] > -0.005:
            break
        frame[2, 3] += gap
    frame[2, 3] += PAD_DEPTH_M
    return Solid(kind=grasp.kind, size=size, frame=frame)


def gaps_to(person: Person, pose: Floats, solid: Solid, which: Ints) -> Floats:
    """(len(which),) [m] how far capsules are from the object, negative inside."""
    starts, stops = person.flesh.capsules(pose[None])
    out = np.zeros(len(which))
    p, q = np.zeros(3), np.zeros(3)
    for n, k in enumerate(which):
        solids.into_frame(starts[0, k], solid.frame, p)
        solids.into_frame(stops[0, k], solid.frame, q)
        far = solids.segment_solid_distance(p, q, solid.kind, solid.size)
        out[n] = far - person.flesh.radius[k]
    return out
