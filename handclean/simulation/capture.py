"""What cameras make of a scene: measured points, ghosts, raw columns."""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.hand.model import bone_rotations
from handclean.recording import Points
from handclean.simulation import cameras, ghosts, losses
from handclean.simulation.columns import Columns, assign_columns
from handclean.simulation.ghosts import Ghost
from handclean.simulation.people import Person, true_markers
from handclean.simulation.scene import Scene
from handclean.simulation.settings import SimulateConfig


@dataclass(frozen=True, kw_only=True)
class Capture:
    """What the cameras made of a scene, of a left hand.

    Attributes
    ----------
    markers : (T, M, 3) [m] true places.
    points : (T, M, 3) [m] measured places, NaN where missing.
    """

    markers: Floats
    points: Floats
    ghosts: list[Ghost]
    columns: Columns


def capture(
    person: Person,
    scene: Scene,
    rig: cameras.Rig,
    settings: SimulateConfig,
    rng: np.random.Generator,
) -> Capture:
    """Record a scene: what is seen, how well, what else is there, in which columns."""
    markers = true_markers(person, scene.poses)
    rate, noise = settings.rate_hz, settings.noise_m
    by = np.ones((*markers.shape[:2], len(rig.places)), dtype=bool)
    if settings.occlusion:
        by = cameras.seen_by(person, scene, markers, rig)
        by = cameras.blink(by, rate, rng)
        # the calibration posture is taken in full view, as the paper demands
        by[: losses.first_frames(rate)] |= ~_enough(by[: losses.first_frames(rate)])
    seen = losses.dropouts(_enough(by)[:, :, 0], rate, settings.dropouts_per_s, rng)
    seen[: losses.first_frames(rate)] = True
    turns = bone_rotations(person.tree, scene.poses)[:, person.markers.bone]
    found, seen = ghosts.impostors(
        markers, turns, seen, rate, settings.impostors_per_s, noise, rng
    )
    found += ghosts.flashes(markers, rate, settings.ghosts_per_s, noise, rng)
    points = cameras.measured(markers, by & seen[:, :, None], rig, noise, rng)
    kept = np.isfinite(points[:, :, 0])
    tracks = losses.tracks(kept, rate, rng)
    columns = assign_columns(tracks, found, len(markers), markers.shape[1], rng)
    return Capture(markers=markers, points=points, ghosts=found, columns=columns)


def _enough(by: Bools) -> Bools:
    """(T, M, 1) whether enough cameras see each marker."""
    return np.asarray(by.sum(axis=2, keepdims=True) >= cameras.LEAST_CAMERAS)


def ghost_points(taken: Capture) -> Points:
    """All ghosts as points sorted by frame."""
    lives = [len(ghost.points) for ghost in taken.ghosts]
    starts = [
        ghost.start + np.arange(n) for ghost, n in zip(taken.ghosts, lives, strict=True)
    ]
    frame = np.concatenate([*starts, np.zeros(0)]).astype(np.int32)
    source = np.repeat(taken.columns.ghost, lives).astype(np.int32)
    places = np.concatenate([*(g.points for g in taken.ghosts), np.zeros((0, 3))])
    order = np.lexsort((source, frame))
    return Points(frame=frame[order], source=source[order], positions=places[order])
