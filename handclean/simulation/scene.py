"""What happens before the cameras: a hand that moves, an object it may move.

Scenes are made for left hands; a right hand's is the mirror image (x negated). The
laboratory's x points to the thumb's side of a hand lying palm down, y away from the
person and z up from the table, whose surface is z = 0.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Floats
from handclean.hand.model import neutral_pose
from handclean.kernels import solids
from handclean.recording import Event
from handclean.simulation.people import Person
from handclean.simulation.timing import sway

_PERSON = (  # name, size, place [m]: what stands behind the table and hides it
    ("torso", (0.20, 0.13, 0.32), (-0.10, -0.66, 0.10)),
    ("head", (0.085, 0.11, 0.13), (-0.08, -0.50, 0.53)),
)

_ELBOW_M = np.array([-0.05, -0.55, 0.16])
"""[m] where forearms come from, seen from the place where the hand rests (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """A solid in the laboratory.

    Attributes
    ----------
    kind, size : as in ``handclean.kernels.solids``.
    frames : (T, 3, 4) rotation and origin [m]; (1, 3, 4) if it stands still.
    """

    name: str
    kind: int
    size: Floats
    frames: Floats


@dataclass(frozen=True, kw_only=True)
class Scene:
    """T frames of a hand, and perhaps of an object.

    Attributes
    ----------
    title : what is done, for the take's name.
    times : (T,) [s]
    poses : (T, 7 + D) of the left hand with forearm.
    bodies : what else is there, the object to be grasped first if there is one.
    events : what happens when.
    """

    title: str
    times: Floats
    poses: Floats
    bodies: tuple[Body, ...] = ()
    events: tuple[Event, ...] = ()


def orientation(yaw: float, pitch: float, roll: float) -> Rotation:
    """Orientation of a left hand from degrees: none is palm down, fingers forward.

    Parameters
    ----------
    yaw : fingers turned away from the thumb's side.
    pitch : fingers lowered.
    roll : thumb raised.
    """
    turn: Rotation = Rotation.from_euler("ZXY", [yaw, -pitch, -roll], degrees=True)
    return turn


def quaternions(turns: Rotation) -> Floats:
    """(T, 4) w, x, y, z, without jumps of sign."""
    q = np.roll(turns.as_quat().reshape(-1, 4), 1, axis=1)
    flips = np.where((q[1:] * q[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    q[1:] *= np.cumprod(flips)[:, None]
    return np.asarray(q, dtype=np.float64)


def assemble(
    person: Person,
    times: Floats,
    places: Floats,
    turns: Rotation,
    angles: Floats,
    rng: np.random.Generator,
    calm: Floats | None = None,
) -> Floats:
    """(T, 7 + D) pose rows with sway and tremor, joints kept within their limits.

    Parameters
    ----------
    places : (T, 3) [m] of the wrist; turns : T orientations of the hand.
    angles : (T, D) [rad]; those of the wrist are found here, from the forearm.
    calm : (T,) how much the hand shakes, 1 in the air and less on the table.
    """
    still = np.ones(len(times)) if calm is None else calm
    places = places + still[:, None] * sway(times, 0.0012, 8e-5, 3, rng)
    shake = still[:, None] * sway(times, np.radians(0.5), np.radians(0.06), 3, rng)
    turns = turns * Rotation.from_rotvec(shake)
    count = len(person.tree.hinges)
    restless = np.radians(0.35) * (0.4 + 0.6 * still[:, None])
    angles = angles + restless * sway(times, 1.0, 0.12, count, rng)
    angles[:, -2:] = _wrist(places, turns, angles[:, -2:])
    low, high = person.tree.limits.T
    angles = np.clip(angles, low, high)
    return np.concatenate([places, quaternions(turns), angles], axis=1)


def _wrist(places: Floats, turns: Rotation, shake: Floats) -> Floats:
    """(T, 2) [rad] flexion and deviation of a wrist whose forearm comes from the elbow.

    In the hand's frame the forearm, turned by flexion a about x and deviation b about
    z, points to (sin b, -cos b cos a, -cos b sin a).
    """
    back = turns.inv().apply(_ELBOW_M - places)
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    flexion = np.arctan2(-back[:, 2], -back[:, 1])
    deviation = np.arcsin(np.clip(back[:, 0], -1.0, 1.0))
    limit = np.radians([[70.0, 25.0]])
    wanted = np.column_stack([flexion, deviation])
    return limit * np.tanh(wanted / limit) + shake


def sitter(rng: np.random.Generator) -> tuple[Body, ...]:
    """Torso and head of the person whose hand it is, who leans as people do."""
    lean = rng.normal(0.0, 0.03, 3)
    return tuple(
        Body(
            name=name,
            kind=solids.ELLIPSOID,
            size=np.array([*size, 0.0]),
            frames=np.column_stack([np.eye(3), np.array(place) + lean])[None],
        )
        for name, size, place in _PERSON
    )


def deepest(person: Person, poses: Floats, body: Body) -> Floats:
    """(T,) [m] how far the hand is from a body, negative where it reaches into it."""
    start, stop = (np.ascontiguousarray(x) for x in person.flesh.capsules(poses))
    frames = np.ascontiguousarray(
        np.broadcast_to(body.frames, (len(poses), 3, 4)), dtype=np.float64
    )
    out = np.zeros(start.shape[:2])
    solids.capsule_gaps(
        start, stop, person.flesh.radius, frames, body.kind, body.size, out
    )
    kept = person.flesh.bone != person.tree.bone("forearm")
    gaps: Floats = out[:, kept].min(axis=1)
    return gaps


def lowest(person: Person, pose: Floats) -> float:
    """[m] height of the lowest point of a hand, forearm not counted."""
    starts, stops = person.flesh.capsules(pose[None])
    kept = person.flesh.bone != person.tree.bone("forearm")
    heights = np.minimum(starts[0, :, 2], stops[0, :, 2]) - person.flesh.radius
    return float(heights[kept].min())


def posed(place: Floats, turn: Rotation, angles: Floats, person: Person) -> Floats:
    """(7 + D,) one pose row."""
    pose = neutral_pose(person.tree)
    pose[:3] = place
    pose[3:7] = quaternions(turn)[0]
    pose[7:] = angles
    return pose


def chained(first: Rotation, targets: list[Rotation], shares: list[Floats]) -> Rotation:
    """T orientations that go from the first through the targets, one share for each."""
    turns, here = first, first
    for target, share in zip(targets, shares, strict=True):
        step = (here.inv() * target).as_rotvec()
        turns = turns * Rotation.from_rotvec(share[:, None] * step)
        here = target
    return turns
