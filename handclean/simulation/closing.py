"""Closing a hand joint by joint on an object until it touches.

Fingers close one after the other, the thumb last, each along a line from its open to
its closed posture and on beyond it. When a segment touches the object (or, for the
thumb, a finger), the joints that carry that segment stop and those further out go on,
so that fingers wrap around what they meet: the automatic grasp of Miller and Allen,
GraspIt!, IEEE Robotics and Automation Magazine 11 (2004) 110-122.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.hand.template import FINGERS
from handclean.kernels import solids
from handclean.simulation.grasps import Grasp
from handclean.simulation.people import Person
from handclean.simulation.seating import (
    PAD_DEPTH_M,
    Solid,
    against_palm,
    between_pads,
    gaps_to,
    meet,
    pose_of,
)

CLOSING_STEPS = 160
"""Steps of a closing movement; one step moves a fingertip by about a millimetre
(chosen)."""

OVERCLOSING_FACTOR = 1.45
"""How far past its closed posture a finger goes when nothing stops it; 1: not
(chosen)."""

CONTACT_M = 0.0005
"""[m] what is this close to the object touches it (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Closing:
    """A hand closing on an object.

    Attributes
    ----------
    path : (CLOSING_STEPS + 1, D) [rad] all angles while the fingers close; the last
        row holds.
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
        solid = against_palm(person, grasp, size, opened, rng)
    else:
        closed = meet(person, grasp, closed)
        between = between_pads(person, grasp, size, opened, closed, rng)
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
    path = np.tile(opened, (CLOSING_STEPS + 1, 1))
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
    pose = pose_of(person, path[-1])
    everything = np.flatnonzero(person.flesh.bone != person.tree.bone("forearm"))
    gaps = gaps_to(person, pose, solid, everything)
    touching, near = (
        tuple(sorted({person.tree.bones[b] for b in person.flesh.bone[everything[k]]}))
        for k in (gaps < CONTACT_M, gaps < 0.015)
    )
    if len(touching) < 2 or gaps.min() < -2.0 * PAD_DEPTH_M:
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
    """One finger while it closes, or None if it starts inside.

    Returns
    -------
    (CLOSING_STEPS + 1, 4) [rad]
    """
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
    step = (closed[hinges] - start) * (OVERCLOSING_FACTOR / CLOSING_STEPS)
    moving = np.ones(len(hinges), dtype=bool)
    track = [start]
    for _ in range(CLOSING_STEPS):
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
            if gaps_to(person, pose_of(person, here), solid, own).min() > 5e-4:
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
        touched = np.flatnonzero(clear < -PAD_DEPTH_M)
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
    pose = pose_of(person, angles)
    gaps = gaps_to(person, pose, solid, own)
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
