"""Virtual cameras: which markers they see, and how well they measure them.

Cameras stand around the table on two rings. A camera sees a marker when nothing stands
on the line between them: not the hand's skin, no capsule of the forearm, no object, no
other marker nearer to the camera. The system reconstructs a marker that two cameras
see.

Every camera is calibrated a little wrong, so that its contribution to a point is off by
a constant of its own; a point is the mean over the cameras that see it, plus noise that
shrinks with their number. Points therefore jump a little when a camera loses them.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.hand.skinning import posed
from handclean.kernels import solids
from handclean.numerics.triangles import box_tree, hidden_behind
from handclean.simulation.people import Person
from handclean.simulation.scene import Scene

LEAST_CAMERAS = 2
"""Cameras that must see a marker: two lines of sight fix a point."""

MERGING_DISTANCE_M = 0.0035
"""[m] markers of 6 mm are one blob in an image when their lines come this close
(chosen)."""

EDGE_SHADE_M = 0.0012
"""[m] a marker this close behind an edge is seen in part, and rejected (chosen)."""

_OWN_SKIN_M = 0.003
"""[m] skin this close to a marker's centre does not hide it: bending may push it in
(chosen)."""

_FRAMES_AT_ONCE = 100
"""Frames skinned at a time (chosen; memory)."""

_NOISE_CAMERAS = 6.0
"""Cameras that see a point on whose number ``noise_m`` is defined (chosen)."""

_BLINKS_PER_S, _MEAN_BLINK_S = 2.5, 0.04
"""How often a camera fails to see a marker that it could, and for how long (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Rig:
    """C cameras.

    Attributes
    ----------
    places : (C, 3) [m]
    errors : (C, 3) what each adds to a point, in units of the noise.
    """

    places: Floats
    errors: Floats


def make_rig(count: int, rng: np.random.Generator) -> Rig:
    """Put cameras around the table, two thirds of them high, one third low.

    Parameters
    ----------
    count : at least two.
    """
    turn = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, count)) / count
    low = np.arange(count) % 3 == 1
    height = np.where(low, 0.55, 1.45) + rng.normal(0.0, 0.08, count)
    away = np.where(low, 1.5, 1.25) + rng.normal(0.0, 0.08, count)
    places = np.column_stack([away * np.cos(turn), away * np.sin(turn) + 0.2, height])
    return Rig(places=places, errors=rng.normal(0.0, 0.8, (count, 3)))


def seen_by(person: Person, scene: Scene, markers: Floats, rig: Rig) -> Bools:
    """(T, M, C) which cameras see which of (T, M, 3) markers."""
    out = _past_solids(person, scene, markers, rig)
    out &= ~_behind_skin(person, scene.poses, markers, rig)
    solids.hide_behind_markers(markers, rig.places, MERGING_DISTANCE_M, out)
    return out


def _past_solids(person: Person, scene: Scene, markers: Floats, rig: Rig) -> Bools:
    """(T, M, C) which markers cameras would see if there were no hand."""
    frames, count = markers.shape[:2]
    forearm = person.flesh.bone == person.tree.bone("forearm")
    start, stop = (ends[:, forearm] for ends in person.flesh.capsules(scene.poses))
    things = scene.bodies
    kinds: Ints = np.array([body.kind for body in things], dtype=np.int64)
    sizes = np.array([body.size for body in things]).reshape(-1, 4)
    placed = np.zeros((frames, len(things), 3, 4))
    for n, body in enumerate(things):
        placed[:, n] = body.frames
    out = np.zeros((frames, count, len(rig.places)), dtype=bool)
    capsules = solids.Capsules(
        start=np.ascontiguousarray(start),
        stop=np.ascontiguousarray(stop),
        radius=person.flesh.radius[forearm] + EDGE_SHADE_M,
    )
    objects = solids.Solids(
        frames=placed,
        kinds=kinds,
        sizes=sizes,
        reach=np.linalg.norm(sizes[:, :3], axis=1) + sizes[:, 3],
    )
    solids.sightlines(markers, rig.places, capsules, objects, out)
    return out


def _behind_skin(person: Person, poses: Floats, markers: Floats, rig: Rig) -> Bools:
    """(T, M, C) which markers the hand's skin hides from which cameras."""
    surface = person.surface
    tree = box_tree(surface.vertices, surface.faces)
    blocks = []
    for first in range(0, len(poses), _FRAMES_AT_ONCE):
        part = slice(first, first + _FRAMES_AT_ONCE)
        skin = posed(surface, person.tree, poses[part])
        hidden = hidden_behind(
            skin,
            tree,
            markers[part],
            rig.places,
            skip_m=_OWN_SKIN_M,
            swell_m=EDGE_SHADE_M,
        )
        blocks.append(hidden)
    return np.concatenate(blocks)


def blink(seen: Bools, rate_hz: float, rng: np.random.Generator) -> Bools:
    """(T, M, C) sightings, less those that single cameras lose for a moment.

    Each camera rejects each marker's image 2.5 times a second, for some 40 ms. It
    matters where few cameras see a marker, whose track then falls to pieces.
    """
    frames, markers, count = seen.shape
    left = seen.copy()
    times = rng.poisson(_BLINKS_PER_S * frames / rate_hz * markers * count)
    lasts = np.ceil(rate_hz * rng.exponential(_MEAN_BLINK_S, times)).astype(int)
    where = rng.integers(0, [[frames], [markers], [count]], (3, times))
    for (t, m, c), length in zip(where.T, lasts, strict=True):
        left[t : t + length, m, c] = False
    return left


def measured(
    markers: Floats, seen: Bools, rig: Rig, noise_m: float, rng: np.random.Generator
) -> Floats:
    """(T, M, 3) [m] what the cameras make of true places, NaN where too few see them.

    Parameters
    ----------
    markers : (T, M, 3) [m]
    seen : (T, M, C)
    noise_m : [m] standard deviation per axis of a point that six cameras see.
    """
    count = seen.sum(axis=2)
    some = np.maximum(count, 1)[:, :, None]
    bias = seen.astype(np.float64) @ rig.errors / some
    own = rng.lognormal(0.0, 0.25, (1, markers.shape[1], 1))
    white = own * rng.normal(size=markers.shape) * np.sqrt(_NOISE_CAMERAS / some)
    points: Floats = markers + noise_m * (0.9 * white + bias)
    points[count < LEAST_CAMERAS] = np.nan
    return points
