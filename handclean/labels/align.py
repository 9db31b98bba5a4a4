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
from handclean.ik.frames import settle
from handclean.ik.settings import SolveConfig
from handclean.kernels import jit
from handclean.kernels.align import align
from handclean.kernels.chain import place_links, place_points
from handclean.kernels.gauss_newton import Chain, Work, make_work, misfit, undecided
from handclean.kernels.rotations import matrix_from_quaternion
from handclean.labels.clusters import candidates
from handclean.labels.models import Sought, scaled
from handclean.numerics.assignment import assign_rows


@jit
def distances(places: Floats, points: Floats, gate: float, cost: Floats) -> None:
    """Write squared distances (M, P), inf beyond the gate."""
    for m in range(places.shape[0]):
        x, y, z = places[m, 0], places[m, 1], places[m, 2]
        for p in range(points.shape[0]):
            a, b, c = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
            d = a * a + b * b + c * c
            cost[m, p] = d if d <= gate * gate else math.inf


@jit
def target_of(points: Floats, chosen: Ints, target: Floats, weight: Floats) -> int:
    """Write each row's point and weight 1, or weight 0; return how many have one."""
    count = 0
    for m in range(chosen.shape[0]):
        if chosen[m] >= 0:
            target[m] = points[chosen[m]]
            weight[m] = 1.0
            count += 1
        else:
            target[m] = 0.0
            weight[m] = 0.0
    return count


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


@jit
def fit(
    pose: Floats,
    points: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    basis: Floats,
    gates: tuple[float, float],
    numbers: tuple[float, float, float],
    lever_m: float,
    rounds: int,
    chosen: Ints,
) -> tuple[float, int, float]:
    """Assign and bend in turns until the assignment stands.

    Parameters
    ----------
    pose : (7 + D,) start, overwritten.
    gates : [m] the gate at the start and at the end.
    numbers : damping, enough_m, prior_m; lever_m : see `undecided`.
    rounds : turns at most.
    chosen : (M,) the point of each marker or -1, overwritten in full.

    Returns
    -------
    [m] mean distance of the assigned; how many they are; [m] their RMS distance.
    """
    markers, count = chosen.shape[0], points.shape[0]
    places, target = np.zeros((markers, 3)), np.zeros((markers, 3))
    weight, price = np.zeros(markers), np.zeros(markers)
    cost = np.zeros((markers, count))
    before = np.full(markers, -2)
    hinges = mean.shape[0]
    is_open = np.zeros(hinges, dtype=np.bool_)
    rest, anchor = np.zeros(hinges), np.zeros(hinges)
    gate, found = gates[0], 0
    for turn in range(rounds):
        place_links(
            pose, tree.parent, tree.offset, tree.axis, k.turn, k.origin, k.column
        )
        place_points(k.turn, k.origin, tree.link, tree.at, places)
        for m in range(markers):
            for n in range(3):
                places[m, n] += pose[n]
        distances(places, points, gate, cost)
        price[:] = gate * gate
        assign_rows(cost, price, chosen)
        found = target_of(points, chosen, target, weight)
        same = True
        for m in range(markers):
            same = same and chosen[m] == before[m]
            before[m] = chosen[m]
        if found < 4 or (same and gate <= gates[1]):
            break
        gate = max(0.75 * gate, gates[1])
        level = undecided(pose, target, weight, tree, k, numbers[0], lever_m, is_open)
        if turn < 4:
            level = max(level, 1)
        settle(
            pose, target, weight, tree, k, mean, basis, is_open, level, rest, anchor,
            numbers, 8,
        )  # fmt: skip
    if found < 3:
        return math.inf, found, math.inf
    square = misfit(pose, target, weight, tree, k)
    total = 0.0
    for m in range(markers):
        if weight[m] > 0.0:
            total += math.sqrt(
                k.error[m, 0] ** 2 + k.error[m, 1] ** 2 + k.error[m, 2] ** 2
            )
    return total / found, found, math.sqrt(square / found)


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


def search(
    points: Floats,
    thing: Sought,
    frame: int,
    *,
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
    The ways found, no two with the same assignment, the best first.
    """
    markers = len(thing.model.labels)
    starts = _stiff(points, thing, postures, rotations)
    starts.sort(key=lambda start: start[0])
    work = make_work(len(thing.mean), markers, thing.basis.shape[1])
    numbers = (solving.damping, solving.enough_m, solving.prior_m)
    found: dict[bytes, Found] = {}
    for _, pose, sized in starts[:keep]:
        chosen = np.full(markers, -1)
        last = max(8e-3, 3.0 * float(sized.sigma.max()))
        distance, count, left = fit(
            pose,
            points,
            sized.chain,
            work,
            sized.mean,
            sized.basis,
            (max(GATES[1], last), last),
            numbers,
            solving.lever_m,
            25,
            chosen,
        )
        if count < 4:
            continue
        score = distance / sized.spacing + alpha * (1.0 - count / markers)
        one = Found(
            thing=sized, frame=frame, pose=pose, chosen=chosen, score=score, rms=left
        )
        same = found.get(chosen.tobytes())
        if same is None or score < same.score:
            found[chosen.tobytes()] = one
    return sorted(found.values(), key=lambda one: one.score)


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
