"""When a fit is suspicious: other poses to start from, fingers exchanged.

Fingers stand beside each other and look alike, so that two of them can change places,
whole or from a joint outwards, and bend until the residual is nearly right. No single
exchange of two points leads back: the fingers must be exchanged as wholes.
"""

import math

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.kernels.align import align
from handclean.kernels.gauss_newton import Observations, misfit
from handclean.labels.track.fit import (
    bend,
    distances,
    narrow,
    resettle,
    target_of,
    worth,
)
from handclean.labels.track.tracker import Kit, State, put
from handclean.numerics.assignment import assign_rows

BETTER = 4.0
"""By how much, in `worth`, an exchange must be better to be believed."""


@jit
def lay(pose: Floats, points: Floats, s: State, kit: Kit, gate: float) -> None:
    """Lay a stiff hand onto points, in place: four rounds of assignment."""
    markers = s.weight.shape[0]
    cost, price = np.zeros((markers, points.shape[0])), np.zeros(markers)
    still = np.zeros(pose.shape[0])
    for turn in range(4):
        reach = gate * (1.0 - 0.2 * turn)
        put(pose, kit, s.places)
        distances(s.places, points, reach, cost)
        price[:] = reach * reach
        assign_rows(cost, price, s.chosen)
        if target_of(points, s.chosen, s.target, s.weight) < 4:
            return
        still[:] = pose
        still[:3] = 0.0
        still[3] = 1.0
        still[4:7] = 0.0
        put(still, kit, s.places)
        align(s.places, s.target, s.weight, pose)


@jit
def exchange(pose: Floats, points: Floats, s: State, kit: Kit, cost: float) -> float:
    """Try to exchange the outer markers of two fingers; keep what is better, in place.

    Parameters
    ----------
    pose, s.chosen : a fit, overwritten by a better one.
    cost : what it is worth.

    Returns
    -------
    What the fit is worth afterwards.
    """
    markers = s.weight.shape[0]
    best, best_pose = s.chosen.copy(), pose.copy()
    base, trial = s.chosen.copy(), pose.copy()
    fingers = kit.branch.max() if markers > 0 else 0
    for _ in range(4):
        found = cost
        for one in range(1, fingers + 1):
            for other in range(one + 1, fingers + 1):
                for depth in range(1, 5):
                    s.chosen[:] = base
                    moved = 0
                    for m in range(markers):
                        if kit.branch[m] != one or kit.rank[m] >= depth:
                            continue
                        for n in range(markers):
                            if kit.branch[n] == other and kit.rank[n] == kit.rank[m]:
                                s.chosen[m], s.chosen[n] = base[n], base[m]
                                if kit.rank[m] == depth - 1:
                                    moved = 1
                    if moved == 0:
                        break
                    trial[:] = pose
                    if target_of(points, s.chosen, s.target, s.weight) < 4:
                        continue
                    resettle(trial, kit.none, s, kit)
                    after = worth(s.weight, kit)
                    if after < found - BETTER:
                        found = after
                        best[:] = s.chosen
                        best_pose[:] = trial
        if found >= cost:
            break
        cost = found
        pose[:] = best_pose
        base[:] = best
    s.chosen[:] = base
    target_of(points, s.chosen, s.target, s.weight)
    return cost


@jit
def rebend(pose: Floats, branch: int, s: State, kit: Kit) -> float:
    """Bend one finger onto its points from other postures; keep the best, in place.

    With few markers a finger can fit in more than one way, and following it can end in
    the wrong one.

    Returns
    -------
    What the fit is worth afterwards.
    """
    best, best_pose, trial = worth(s.weight, kit), pose.copy(), pose.copy()
    for start in range(kit.starts.shape[0]):
        trial[:] = pose
        for d in range(kit.hinge_branch.shape[0]):
            if kit.hinge_branch[d] == branch:
                trial[7 + d] = kit.starts[start, d]
        resettle(trial, kit.none, s, kit)
        found = worth(s.weight, kit)
        if found < best - BETTER:
            best = found
            best_pose[:] = trial
    pose[:] = best_pose
    misfit(pose, Observations(s.target, s.weight), kit.tree, kit.k)
    return best


@jit
def reach_out(
    pose: Floats, points: Floats, s: State, kit: Kit, gate: float, cost: float
) -> float:
    """Give markers without a point, finger by finger, points further off, in place.

    A finger far from where the start posture had it is left without points when the
    gate closes. Once the rest of the hand stands, it is tried alone.

    Parameters
    ----------
    pose, s.chosen : a fit, overwritten by a better one.
    gate : [m] how far to look.
    cost : what the fit is worth.

    Returns
    -------
    What the fit is worth afterwards.
    """
    markers = s.weight.shape[0]
    base, base_pose = s.chosen.copy(), pose.copy()
    free = np.zeros(points.shape[0], np.bool_)
    pairs, price = np.zeros((markers, points.shape[0])), np.zeros(markers)
    picked = base.copy()
    for branch in range(kit.branch.max() + 1):
        for whole in range(2):  # those without a point; then all of the finger
            loose = 0
            free[:] = True
            for m in range(markers):
                mine = kit.branch[m] == branch
                loose += 1 if mine and base[m] < 0 else 0
                if base[m] >= 0 and not (mine and whole == 1):
                    free[base[m]] = False
            if loose == 0:
                break
            pose[:] = base_pose
            last = base.copy()
            for _ in range(6):
                put(pose, kit, s.places)
                distances(s.places, points, gate, pairs)
                for m in range(markers):
                    out = kit.branch[m] != branch or (whole == 0 and base[m] >= 0)
                    price[m] = -1.0 if out else gate * gate
                    for p in range(points.shape[0]):
                        if out or not free[p]:
                            pairs[m, p] = math.inf
                assign_rows(pairs, price, picked)
                same = True
                for m in range(markers):
                    s.chosen[m] = picked[m] if price[m] > 0.0 else base[m]
                    same = same and s.chosen[m] == last[m]
                    last[m] = s.chosen[m]
                if same or target_of(points, s.chosen, s.target, s.weight) < 4:
                    break
                resettle(pose, kit.none, s, kit)
            misfit(pose, Observations(s.target, s.weight), kit.tree, kit.k)
            after = worth(s.weight, kit)
            if after < cost - BETTER:
                cost = after
                base[:] = s.chosen
                base_pose[:] = pose
    pose[:] = base_pose
    s.chosen[:] = base
    target_of(points, s.chosen, s.target, s.weight)
    return cost


@jit
def recover(points: Floats, s: State, kit: Kit, gate: float, cost: float) -> float:
    """Find the hand again from where it was; keeps the best in ``s.pose``.

    Starts are the last pose, the same moved by as much as the middle of all points
    near it, and the predicted pose; each laid stiffly, then bent.

    Parameters
    ----------
    s : ``pose`` and ``chosen`` are the fit so far; overwritten by a better one.
    gate : [m] how far to look.
    cost : what the fit so far is worth.

    Returns
    -------
    What the fit is worth afterwards.
    """
    markers = s.weight.shape[0]
    best_pose, best = s.pose.copy(), s.chosen.copy()
    least = narrow(kit)
    for start in range(4):
        s.attempt[:] = s.last
        if start == 1 or start == 3:
            for n in range(s.attempt.shape[0]):
                s.attempt[n] += s.velocity[n]
            norm = 0.0
            for n in range(3, 7):
                norm += s.attempt[n] ** 2
            for n in range(3, 7):
                s.attempt[n] /= math.sqrt(norm)
        if start >= 2:
            _centre(s.attempt, points, s, kit, 0.15)
        lay(s.attempt, points, s, kit, gate)
        found = bend(s.attempt, points, s, kit, kit.none, 0.7 * gate, least)
        if found < cost - 1.0:
            cost = found
            best_pose[:] = s.attempt
            best[:] = s.chosen
    s.pose[:] = best_pose
    s.chosen[:] = best
    target_of(points, s.chosen, s.target, s.weight)
    if cost > 2.0 * markers:
        cost = reach_out(s.pose, points, s, kit, gate, cost)
        cost = exchange(s.pose, points, s, kit, cost)
    return cost


@jit
def _centre(pose: Floats, points: Floats, s: State, kit: Kit, radius: float) -> None:
    """Move a pose so that the middle of its markers is that of the points about it."""
    put(pose, kit, s.places)
    middle = np.zeros(3)
    markers = s.places.shape[0]
    for m in range(markers):
        for n in range(3):
            middle[n] += s.places[m, n] / markers
    for _ in range(3):
        total, count = np.zeros(3), 0
        for p in range(points.shape[0]):
            d2 = 0.0
            for n in range(3):
                d2 += (points[p, n] - middle[n]) ** 2
            if d2 < radius * radius:
                count += 1
                for n in range(3):
                    total[n] += points[p, n] - middle[n]
        if count < 4:
            return
        for n in range(3):
            middle[n] += total[n] / count
            pose[n] += total[n] / count
