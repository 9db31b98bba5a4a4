"""Closing a hand joint by joint on an object until it touches.

Fingers close one after the other, the thumb last, each along a line from its open to
its closed posture and on beyond it. When a segment touches the object (or, for the
thumb, a finger), the joints that carry that segment stop and those further out go on,
so that fingers wrap around what they meet: the automatic grasp of Miller and Allen,
GraspIt!, IEEE Robotics and Automation Magazine 11 (2004) 110-122.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from handclean.arrays import Bools, Floats, Ints
from handclean.hand.model import (
    Model,
    marker_positions,
    neutral_pose,
)
from handclean.hand.template import FINGERS, bone_frame
from handclean.kernels import solids
from handclean.simulation.grasps import Grasp
from handclean.simulation.people import Person

STEPS = 160
"""Steps of a closing movement; one step moves a fingertip by about a millimetre."""

BEYOND = 1.45
"""How far past its closed posture a finger goes when nothing stops it; 1: not."""

_ROOTS = tuple(f"{finger}_proximal" for finger in FINGERS[1:])

TOUCHES = 0.0005
"""[m] what is this close to the object touches it."""

PRESS = 0.0006
"""[m] how deep a segment sinks into its own pad when it touches."""


@dataclass(frozen=True, kw_only=True)
class Solid:
    """An object: kind and size as in ``handclean.kernels.solids``, and its frame.

    Attributes
    ----------
    size : (4,) [m]
    frame : (3, 4) rotation and origin [m], in the hand's frame.
    """

    kind: int
    size: Floats
    frame: Floats


@dataclass(frozen=True, kw_only=True)
class Closing:
    """A hand closing on an object.

    Attributes
    ----------
    path : (STEPS + 1, D) [rad] all angles while the fingers close; the last row holds.
    solid : the object in the hand's frame.
    touching : names of the bones that touch it in the end.
    near : names of those within 15 mm of it.
    depth : [m] deepest place of any capsule in the object in the end, negative.
    """

    path: Floats
    solid: Solid
    touching: tuple[str, ...]
    near: tuple[str, ...]
    depth: float


def close(person: Person, grasp: Grasp, rng: np.random.Generator) -> Closing | None:
    """Grasp an object of the class's range, or None when it did not come to hold.

    Parameters
    ----------
    person : whose hand; its habits and reach shape the posture.
    """
    closed, opened = _draw_postures(person, grasp, rng)
    size = 1e-3 * np.array([rng.uniform(*span) for span in grasp.size])
    size = size * (person.tree.scale if grasp.seat == "palm" else 1.0)
    if grasp.seat == "palm":
        solid = _against_palm(person, grasp, size, opened, rng)
    else:
        closed = _meet(person, grasp, closed)
        between = _between_pads(person, grasp, size, opened, closed, rng)
        if between is None:
            return None
        solid = between
    return _close_on(person, solid, opened, closed, rng)


def _draw_postures(
    person: Person, grasp: Grasp, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Postures of the class as this person takes them this time."""
    names = person.tree.hinges[: len(grasp.closed)]
    free = len(person.tree.hinges) - len(grasp.closed)
    closed = np.concatenate([grasp.closed, np.zeros(free)])
    opened = np.concatenate([grasp.opened, np.zeros(free)])
    wide = rng.uniform(0.75, 1.25)
    opened += (wide - 1.0) * (opened - closed)
    for angles in (closed, opened):
        angles[:20] += person.habit[:20] + _whim(names, rng)
    low, high = person.reach.T
    return np.clip(closed, low, high), np.clip(opened, low, high)


def _whim(names: tuple[str, ...], rng: np.random.Generator) -> Floats:
    """(D,) [rad] how a posture deviates this time: joint by joint, and as a slant from
    the index to the little finger of all joints of a kind.
    """
    slant = {kind: rng.normal(0.0, 5.0) for kind in ("mcp", "pip", "dip")}
    out = np.zeros(len(names))
    for d, name in enumerate(names):
        finger, kind, motion = name.split("_")
        if motion == "abduction" and finger != "thumb":
            out[d] = rng.normal(0.0, 2.0)
        else:
            out[d] = rng.normal(0.0, 5.5)
            if finger != "thumb":
                out[d] += slant[kind] * (FINGERS.index(finger) - 2.5) / 1.1
    return np.radians(out)


def _pose(person: Person, angles: Floats) -> Floats:
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


def _meet(person: Person, grasp: Grasp, closed: Floats) -> Floats:
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
        thumb, *others = marker_positions(pads, _pose(person, angles)[None])[0]
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


def _between_pads(
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
    poses = np.array([_pose(person, opened + s * (closed - opened)) for s in share])
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


def _against_palm(
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
    pose = _pose(person, opened)
    rests_on = [b == "hand" or b in _ROOTS for b in person.tree.bones]
    palm = np.flatnonzero(np.array(rests_on)[person.flesh.bone])
    for _ in range(200):
        gap = _gaps(
            person, pose, Solid(kind=grasp.kind, size=size, frame=frame), palm
        ).min()
        if gap < 1e-4 or frame[2, 3] > -0.005:
            break
        frame[2, 3] += gap
    frame[2, 3] += PRESS
    return Solid(kind=grasp.kind, size=size, frame=frame)


def _gaps(person: Person, pose: Floats, solid: Solid, which: Ints) -> Floats:
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


def _close_on(
    person: Person,
    solid: Solid,
    opened: Floats,
    closed: Floats,
    rng: np.random.Generator,
) -> Closing | None:
    """Close every finger, the thumb last; None if fewer than two things touch.

    Joints of a finger share its pace only roughly.
    """
    pace = rng.lognormal(0.0, 0.2, len(opened))
    path = np.tile(opened, (STEPS + 1, 1))
    angles = opened.copy()
    for finger in (*FINGERS[1:], FINGERS[0]):
        hinges = np.array(
            [d for d, name in enumerate(person.tree.hinges) if name.startswith(finger)]
        )
        towards = angles + pace * (closed - angles)
        track = _close_finger(person, solid, angles, towards, finger, hinges)
        if track is None:
            return None
        path[:, hinges] = track
        angles[hinges] = track[-1]
    pose = _pose(person, path[-1])
    everything = np.flatnonzero(person.flesh.bone != person.tree.bone("forearm"))
    gaps = _gaps(person, pose, solid, everything)
    touching, near = (
        tuple(sorted({person.tree.bones[b] for b in person.flesh.bone[everything[k]]}))
        for k in (gaps < TOUCHES, gaps < 0.015)
    )
    if len(touching) < 2 or gaps.min() < -2.0 * PRESS:
        return None
    return Closing(
        path=path,
        solid=solid,
        touching=touching,
        near=near,
        depth=float(gaps.min()),
    )


def _close_finger(
    person: Person,
    solid: Solid,
    angles: Floats,
    closed: Floats,
    finger: str,
    hinges: Ints,
) -> Floats | None:
    """(STEPS + 1, 4) [rad] one finger while it closes; None if it starts inside."""
    tree, flesh = person.tree, person.flesh
    own = np.array(
        [k for k, b in enumerate(flesh.bone) if tree.bones[b].startswith(finger)]
    )
    blocks = np.array(
        [
            k
            for k, b in enumerate(flesh.bone)
            if finger == "thumb" and tree.bones[b].startswith(FINGERS[1:])
        ],
        dtype=np.int64,
    )
    low, high = person.reach[hinges].T
    start = _cleared(person, solid, angles, hinges, own)
    if start is None:
        return None
    here = angles.copy()
    here[hinges] = start
    step = (closed[hinges] - start) * (BEYOND / STEPS)
    moving = np.ones(len(hinges), dtype=bool)
    track = [start]
    for _ in range(STEPS):
        if moving.any():
            _advance(person, solid, here, hinges, step, moving, own, blocks)
            here[hinges] = np.clip(here[hinges], low, high)
        track.append(here[hinges].copy())
    return np.array(track)


def _cleared(
    person: Person, solid: Solid, angles: Floats, hinges: Ints, own: Ints
) -> Floats | None:
    """Open a finger until it is out of the object; None if it cannot be."""
    low, high = person.reach[hinges].T
    for aside in (0.0, -1.0, 1.0):
        here = angles.copy()
        for _ in range(60):
            if _gaps(person, _pose(person, here), solid, own).min() > 5e-4:
                return here[hinges].copy()
            step = np.radians([aside, -1.5, -1.0, -0.7])
            here[hinges] = np.clip(here[hinges] + step, low, high)
    return None


def _advance(
    person: Person,
    solid: Solid,
    here: Floats,
    hinges: Ints,
    step: Floats,
    moving: Bools,
    own: Ints,
    blocks: Ints,
) -> None:
    """Move a finger's free joints by one step and stop those that have touched."""
    before = here[hinges].copy()
    while moving.any():
        here[hinges] = before + np.where(moving, step, 0.0)
        clear = _clearance(person, solid, here, own, blocks)
        touched = np.flatnonzero(clear < -PRESS)
        # a segment only counts if a joint that carries it still moves
        stopped = [k for k in touched if moving[: k + 2].any()]
        if not stopped:
            return
        moving[: stopped[0] + 2] = False
    here[hinges] = before


def _clearance(
    person: Person, solid: Solid, angles: Floats, own: Ints, blocks: Ints
) -> Floats:
    """(3,) [m] how far a finger's segments are from the object and from ``blocks``."""
    pose = _pose(person, angles)
    gaps = _gaps(person, pose, solid, own)
    if len(blocks):
        starts, stops = person.flesh.capsules(pose[None])
        radius = person.flesh.radius
        for n, k in enumerate(own[1:], start=1):
            for other in blocks:
                far = solids.segments_distance(
                    starts[0, k], stops[0, k], starts[0, other], stops[0, other]
                )
                gaps[n] = min(gaps[n], far - radius[k] - radius[other])
    return gaps
