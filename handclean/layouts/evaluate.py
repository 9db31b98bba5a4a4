"""How well a layout tells the posture: motion, its markers, and what is solved of them.

Schroeder 2016, figure 11 and table 1: a hand moves as it is known to, its markers are
seen with some noise, inverse kinematics solves them, and every vertex of the skin is
somewhere else than it was. With the papers' anchor, a marker on the forearm, it is
known where the wrist is, but not how the hand is turned: one more marker in the wrist's
joint, without noise, that weighs as much as `WRIST_MARKER_WEIGHT` others.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError
from handclean.hand.model import Model, marker_positions
from handclean.hand.skinning import posed
from handclean.hand.surface import Surface
from handclean.ik.prior import PosturePrior
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import solve_markers
from handclean.layouts.evaluate_settings import EvaluateConfig
from handclean.tree import POSE_HEAD

WRIST_MARKER_WEIGHT = 1e3
"""Weight of the marker that tells where the wrist is, against 1 of the others (chosen:
it is taken as known)."""

_WRIST = "(wrist)"
_FRAMES_AT_ONCE = 200
"""Frames whose skin is compared at once (chosen; memory)."""


@dataclass(frozen=True, kw_only=True)
class Errors:
    """How far the skin is from where it was, over V vertices and all frames compared.

    Attributes
    ----------
    mean_m, max_m : [m] over all vertices.
    fingers_mean_m, fingers_max_m : [m] over those that fingers move.
    frame_m : (N,) [m] mean over the vertices in each frame compared.
    angles_rad : [rad] mean absolute difference of the joint angles.
    frames : how many were solved.
    frame_s : [s] processor time of one.
    """

    mean_m: float
    max_m: float
    fingers_mean_m: float
    fingers_max_m: float
    frame_m: Floats
    angles_rad: float
    frames: int
    frame_s: float


def anchored(model: Model) -> Model:
    """Return the markers with one more, the last, in the wrist's joint."""
    return replace(
        model,
        labels=(*model.labels, _WRIST),
        bone=np.append(model.bone, 0),
        at=np.vstack([model.at, np.zeros(3)]),
    )


def evaluate(
    model: Model,
    surface: Surface,
    takes: Sequence[Floats],
    settings: EvaluateConfig,
    rng: np.random.Generator,
    *,
    prior: PosturePrior | None = None,
    anchor: bool = True,
    solve: SolveConfig | None = None,
) -> Errors:
    """Solve what a layout would show of a motion, and compare the skin.

    Parameters
    ----------
    model : the hand with the layout's markers.
    surface : its skin.
    takes : (T, 7 + D) poses each, all finite.
    prior : posture subspace; standard inverse kinematics without.
    anchor : the wrist's place is known.

    Raises
    ------
    HandcleanError
        If there is no frame.
    """
    total = sum(map(len, takes))
    if not total:
        raise HandcleanError("motion: has no frame in which all angles are known")
    seen = anchored(model) if anchor else model
    weights = np.ones(len(seen.labels))
    weights[len(model.labels) :] = WRIST_MARKER_WEIGHT
    apart, turned, spent, first = [], [], 0.0, 0
    rows = np.linspace(0, total - 1, min(settings.frames, total)).round()
    for poses in takes:
        places = marker_positions(seen, poses)
        noise = rng.normal(0.0, settings.noise_m, (len(poses), len(model.labels), 3))
        places[:, : len(model.labels)] += noise
        begin = time.process_time()
        solved = solve_markers(
            seen, places, weights=weights, prior=prior, settings=solve
        ).poses
        spent += time.process_time() - begin
        some = rows[(rows >= first) & (rows < first + len(poses))].astype(int) - first
        first += len(poses)
        apart.append(skin_apart(model, surface, poses[some], solved[some]))
        turned.append(np.abs(solved - poses)[:, POSE_HEAD:].mean(axis=1))
    distances = np.concatenate(apart)
    fingers = distances[:, on_fingers(model, surface)]
    return Errors(
        mean_m=float(distances.mean()),
        max_m=float(distances.max()),
        fingers_mean_m=float(fingers.mean()),
        fingers_max_m=float(fingers.max()),
        frame_m=distances.mean(axis=1),
        angles_rad=float(np.concatenate(turned).mean()),
        frames=total,
        frame_s=spent / total,
    )


def on_fingers(model: Model, surface: Surface) -> Ints:
    """(V',) vertices that a finger moves more than the hand does."""
    mostly = surface.bones[:, 0]
    names = np.array([name in ("hand", "forearm") for name in model.tree.bones])
    return np.flatnonzero(~names[mostly])


def skin_apart(model: Model, surface: Surface, one: Floats, other: Floats) -> Floats:
    """(T, V) [m] distances of vertices in (T, 7 + D) poses from those in others."""
    out = np.zeros((len(one), len(surface.vertices)))
    for start in range(0, len(one), _FRAMES_AT_ONCE):
        some = slice(start, start + _FRAMES_AT_ONCE)
        pair = [posed(surface, model.tree, poses[some]) for poses in (one, other)]
        out[some] = np.linalg.norm(pair[1] - pair[0], axis=2)
    return out
