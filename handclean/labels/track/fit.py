"""Assigning and bending in turns, and what a fit is worth."""

import math

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.ik.frames import PoseProblem, solve_frame
from handclean.kernels import jit
from handclean.kernels.gauss_newton import (
    Observations,
    Openness,
    StepControl,
    Subspace,
    find_open_hinges,
    misfit,
)
from handclean.labels.track.tracker import Kit, State, put
from handclean.numerics.assignment import assign_rows

TURNS, LAYERS = 20, 4
"""Turns of `bend` at most, and how many of them begin in the posture subspace."""

MISSING = 12.0
"""What a marker without a point costs in `worth`; as much as one at 3.5 times its RMS
distance."""


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
        weight[m] = 0.0
        if chosen[m] >= 0:
            target[m] = points[chosen[m]]
            weight[m] = 1.0
            count += 1
    return count


@jit
def resettle(pose: Floats, basis: Floats, s: State, kit: Kit) -> None:
    """Solve for ``pose``, in place, from the targets and weights of the state.

    Parameters
    ----------
    basis : ``kit.basis`` to begin in the posture subspace, or ``kit.none``.
    """
    same, seen = True, Observations(s.target, s.weight)
    for m in range(s.weight.shape[0]):
        same = same and (s.weight[m] > 0.0) == (s.there[m] > 0.0)
        s.there[m] = s.weight[m]
    damping, enough_m, prior_m = kit.numbers
    if not same or s.tally[0] == 2:
        s.tally[0] = find_open_hinges(
            pose, seen, kit.tree, damping, kit.rules.lever, kit.k, s.is_open
        ).level
    problem = PoseProblem(
        kit.tree,
        Subspace(kit.mean, basis, prior_m),
        StepControl(damping, enough_m, 20),
        kit.rules.lever,
    )
    open_now = Openness(max(s.tally[0], 1), s.is_open)
    solve_frame(pose, seen, open_now, problem, kit.k)
    misfit(pose, seen, kit.tree, kit.k)


@jit
def distance(kit: Kit, m: int) -> float:
    """[m] distance of marker m from its point, as `misfit` left it."""
    e = kit.k.error[m]
    return math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])


@jit
def worth(weight: Floats, kit: Kit) -> float:
    """Cost of a fit as `misfit` left it, in squared standard deviations.

    Distances count up to the price of a missing marker.
    """
    total = 0.0
    for m in range(weight.shape[0]):
        if weight[m] > 0.0:
            e = kit.k.error[m]
            d2 = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
            total += min(d2 / kit.variance[m], MISSING)
        else:
            total += MISSING
    return total


@jit
def narrow(kit: Kit) -> float:
    """[m] gate that no marker in its place leaves."""
    return max(8e-3, 3.0 * math.sqrt(kit.variance.max()))


@jit
def bend(
    pose: Floats,
    points: Floats,
    s: State,
    kit: Kit,
    basis: Floats,
    gate: float,
    least: float,
) -> float:
    """Assign and bend in turns until the assignment stands.

    Parameters
    ----------
    pose : (7 + D,) start, overwritten.
    points : (P, 3) [m]
    s : its chosen, target and weight are overwritten.
    basis : ``kit.basis`` to begin in the posture subspace, or ``kit.none``.
    gate, least : [m] at the start and at the end.

    Returns
    -------
    What the fit is worth, see `worth`; infinity without enough points.
    """
    markers = s.weight.shape[0]
    cost, price = np.zeros((markers, points.shape[0])), np.zeros(markers)
    before = np.full(markers, -2)
    for turn in range(TURNS):
        put(pose, kit, s.places)
        distances(s.places, points, gate, cost)
        price[:] = gate * gate
        assign_rows(cost, price, s.chosen)
        found = target_of(points, s.chosen, s.target, s.weight)
        if found < 4:
            return math.inf
        same = True
        for m in range(markers):
            same = same and s.chosen[m] == before[m]
            before[m] = s.chosen[m]
        if same and gate <= least:
            break
        gate = max(0.75 * gate, least)
        resettle(pose, basis if turn < LAYERS else kit.none, s, kit)
    misfit(pose, Observations(s.target, s.weight), kit.tree, kit.k)
    return worth(s.weight, kit)
