"""The first frame: which points are the hand, how it stands, which marker is which.

Maycock 2015 section III-A, for every cluster of points and every start posture:

1. *PCA alignment* (eq. 1): the axes of model and cluster are laid onto each other, with
   every combination of signs. Of the eight, four mirror the hand, which no hand can
   do; four are rotations and are tried. Where they do not fit - arbitrary postures,
   points of other things - rotations spread evenly over all orientations follow.
2. *Scale*, of a template only, from the two oriented bounding boxes.
3. *ICP*, rigid, each step assigning by the Hungarian method with a shrinking gate.
4. *Hungarian and inverse kinematics* in turns until the assignment stands.
5. *Score* (eq. 2): E + alpha D. E is the mean distance of assigned points in units of
   the mean distance between neighbouring markers, D the share of markers without a
   point: both without dimension, so that alpha = 1 means the same for any hand and
   unit.
"""

import math
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.model import marker_positions
from handclean.ik.settings import SolveConfig
from handclean.kernels import jit
from handclean.kernels.align import align
from handclean.kernels.gauss_newton import Observations, misfit
from handclean.kernels.rotations import matrix_from_quaternion
from handclean.labels.clusters import candidates
from handclean.labels.target import Sought, scaled
from handclean.labels.track.alternatives import exchange, reach_out
from handclean.labels.track.fit import bend, distances, narrow, target_of
from handclean.labels.track.tracker import Kit, Rules, State, kit_of, new_state
from handclean.numerics.assignment import assign_rows


@jit
def lay_rigidly(
    shape: Floats,
    points: Floats,
    turns: Floats,
    centre: Floats,
    gate: float,
    rounds: int,
    poses: Floats,
    scores: Floats,
) -> None:
    """Lay a stiff model onto points from many orientations (ICP by assignment).

    Parameters
    ----------
    shape : (M, 3) [m] markers of one posture, root unturned at the origin.
    points : (P, 3) [m]
    turns : (R, 3, 3) rotations to start from; centre : (3,) [m] where to put the mean.
    gate : [m] longest distance at the start; it shrinks to a third.
    poses : (R, 7), scores : (R,) [m^2] mean squared distance, cut at the gate;
        overwritten in full.
    """
    markers, count = shape.shape[0], points.shape[0]
    middle = np.zeros(3)
    for m in range(markers):
        for n in range(3):
            middle[n] += shape[m, n] / markers
    placed, target = np.zeros((markers, 3)), np.zeros((markers, 3))
    weight, price = np.zeros(markers), np.zeros(markers)
    cost, chosen = np.zeros((markers, count)), np.zeros(markers, dtype=np.int64)
    pose, matrix = np.zeros(7), np.zeros((3, 3))
    for r in range(turns.shape[0]):
        pose[:] = 0.0
        pose[3] = 1.0
        matrix[:] = turns[r]
        for n in range(3):
            pose[n] = centre[n]
            for j in range(3):
                pose[n] -= matrix[n, j] * middle[j]
        for step in range(rounds + 1):
            reach = gate * (1.0 - 0.67 * step / rounds)
            for m in range(markers):
                for n in range(3):
                    placed[m, n] = pose[n]
                    for j in range(3):
                        placed[m, n] += matrix[n, j] * shape[m, j]
            price[:] = reach * reach
            distances(placed, points, reach, cost)
            assign_rows(cost, price, chosen)
            total = 0.0
            for m in range(markers):
                total += price[m] if chosen[m] < 0 else cost[m, chosen[m]]
            scores[r] = total / markers
            if step == rounds or target_of(points, chosen, target, weight) < 3:
                break
            align(shape, target, weight, pose)
            matrix_from_quaternion(pose[3:7], matrix)
        poses[r] = pose


@dataclass(frozen=True, kw_only=True)
class Found:
    """A model laid onto the points of one frame.

    Attributes
    ----------
    thing : the model, scaled if it was a template.
    frame : where.
    pose : (7 + D,)
    chosen : (M,) row of each marker's point among the frame's points, -1 none.
    score : equation 2, without dimension; smaller is better.
    rms : [m] of the assigned markers.
    """

    thing: Sought
    frame: int
    pose: Floats
    chosen: Ints
    score: float
    rms: float


def good(one: Found) -> bool:
    """Whether a fit is as close as the model promises, with hardly a marker missing."""
    usual = float(np.sqrt(np.mean(one.thing.sigma**2)))
    return one.rms < 1.25 * usual + 3e-4 and float(np.mean(one.chosen < 0)) <= 0.1


def principal_axes(points: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean (3,), right-handed axes (3, 3) as columns, and extents (3,) along them."""
    middle = points.mean(axis=0)
    axes = np.linalg.eigh((points - middle).T @ (points - middle))[1][:, ::-1].copy()
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    along = (points - middle) @ axes
    return middle, axes, np.ptp(along, axis=0)


def sign_combinations(source: Floats, target: Floats) -> Floats:
    """(4, 3, 3) rotations that lay right-handed axes onto others (eq. 1)."""
    signs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    return np.array([(target * sign) @ source.T for sign in signs])


def spread_rotations(count: int) -> Floats:
    """(count, 3, 3) rotations spread evenly over all orientations.

    The super-Fibonacci spiral of Alexa, Super-Fibonacci Spirals: Fast, Low-Discrepancy
    Sampling of SO(3), CVPR 2022.
    """
    phi, psi = math.sqrt(2.0), 1.533751168755204288118041
    s = np.arange(count) + 0.5
    t, d = s / count, 2.0 * math.pi * s
    r, big = np.sqrt(t), np.sqrt(1.0 - t)
    q = np.stack(
        [
            r * np.sin(d / phi),
            r * np.cos(d / phi),
            big * np.sin(d / psi),
            big * np.cos(d / psi),
        ],
        axis=1,
    )
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.ascontiguousarray(np.moveaxis(np.array(rows), 2, 0))


GATES = (0.06, 0.035)
"""[m] how far a marker may be from its point when laid stiffly, and when bent."""

REACH = 0.1
"""[m] how far a finger may be from its points when the rest of the hand stands."""

PLAIN = 2.0
"""Cost per marker below which a bent alignment may be all there is to find."""

FINALISTS = 5
"""How many of the bent alignments are worth a closer look."""


def search(
    points: Floats,
    thing: Sought,
    frame: int,
    *,
    rules: Rules,
    alpha: float,
    solving: SolveConfig,
    postures: int,
    rotations: int,
    keep: int,
) -> list[Found]:
    """Lay a model onto the points of one frame in every way worth trying.

    Parameters
    ----------
    points : (P, 3) [m]
    frame : its number, for the record.
    alpha : weight of markers without a point.
    postures : how many of the model's start postures to try.
    rotations : how many orientations to try besides those of the axes.
    keep : how many of the stiff alignments are bent onto the points.

    Returns
    -------
    The ways found, no two with the same assignment, the best first; or only one, as
    soon as it is good.
    """
    starts = _stiff(points, thing, postures, rotations)
    starts.sort(key=lambda start: start[0])
    bent: dict[bytes, _Bent] = {}
    ways: dict[bytes, Found] = {}
    for _, pose, sized in starts[:keep]:
        kit = kit_of(sized, rules, solving)
        state = new_state(len(thing.sigma), len(thing.mean))
        least = narrow(kit)
        cost = bend(pose, points, state, kit, kit.basis, max(GATES[1], least), least)
        if cost < PLAIN * len(thing.sigma):
            way = _finished(points, _Bent(cost, pose, state, kit, sized), frame, alpha)
            if good(way):
                return [way]
            ways.setdefault(way.chosen.tobytes(), way)
            continue
        same = bent.get(state.chosen.tobytes())
        if np.isfinite(cost) and (same is None or cost < same.cost):
            bent[state.chosen.tobytes()] = _Bent(cost, pose, state, kit, sized)
    best = sorted(bent.values(), key=lambda one: one.cost)[:FINALISTS]
    for one in best:
        way = _finished(points, one, frame, alpha)
        ways.setdefault(way.chosen.tobytes(), way)
    return sorted(ways.values(), key=lambda way: way.score)


@dataclass(frozen=True)
class _Bent:
    """A model bent onto points, and what that is worth."""

    cost: float
    pose: Floats
    state: State
    kit: Kit
    thing: Sought


def _finished(points: Floats, one: _Bent, frame: int, alpha: float) -> Found:
    """Reach out for points left over, exchange fingers, and score (eq. 2)."""
    kit, state, pose = one.kit, one.state, one.pose
    target_of(points, state.chosen, state.target, state.weight)
    cost = reach_out(pose, points, state, kit, REACH, one.cost)
    exchange(pose, points, state, kit, cost)
    misfit(pose, Observations(state.target, state.weight), kit.tree, kit.k)
    has = state.chosen >= 0
    away = np.linalg.norm(kit.k.error[has], axis=1)
    score = away.mean() / one.thing.spacing + alpha * (1.0 - has.mean())
    return Found(
        thing=one.thing,
        frame=frame,
        pose=pose,
        chosen=state.chosen.copy(),
        score=float(score),
        rms=float(np.sqrt(np.mean(away**2))),
    )


def _stiff(
    points: Floats, thing: Sought, postures: int, rotations: int
) -> list[tuple[float, Floats, Sought]]:
    """Return (score, pose, model) of every posture at its best orientations."""
    angles = thing.starts[:postures]
    markers = len(thing.model.labels)
    spread = spread_rotations(rotations)
    out: list[tuple[float, Floats, Sought]] = []
    for rows in candidates(points, 1.1 * thing.step, max(4, markers // 2)):
        centre, axes, extent = principal_axes(points[rows])
        sized = thing
        if not thing.fixed_size:
            flat = _shapes(thing, thing.starts[1:2])[0]
            ratio = extent[:2] / principal_axes(flat)[2][:2]
            sized = scaled(thing, float(np.clip(np.median(ratio), 0.7, 1.4)))
        for posture, shape in zip(angles, _shapes(sized, angles), strict=True):
            turns = sign_combinations(principal_axes(shape)[1], axes)
            turns = np.ascontiguousarray(np.concatenate([turns, spread]))
            poses, scores = np.zeros((len(turns), 7)), np.zeros(len(turns))
            lay_rigidly(shape, points, turns, centre, GATES[0], 5, poses, scores)
            for r in np.argsort(scores, kind="stable")[:4]:
                pose = np.concatenate([poses[r], posture])
                out.append((float(scores[r]), pose, sized))
    return out


def _shapes(thing: Sought, angles: Floats) -> Floats:
    """(S, M, 3) [m] markers of each posture, the root unturned at the origin."""
    poses = np.zeros((len(angles), 7 + angles.shape[1]))
    poses[:, 3] = 1.0
    poses[:, 7:] = angles
    return marker_positions(thing.model, poses)
