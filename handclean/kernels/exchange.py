"""Changing one marker of a layout, or adding one: greedily, and by annealing.

Layouts and energies are those of `handclean.kernels.layouts`.
"""

import math

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.layouts import capped_condition, cheap_energy
from handclean.kernels.nearest_vertex import nearest_point


@jit
def best_exchange(
    others: Ints,
    base: Floats,
    weak: Floats,
    strong: Floats,
    ends: Floats,
    rows: Floats,
    grams: Floats,
    gaps: Floats,
    hidden: Floats,
    weights: Floats,
    order: Ints,
    bound: float,
    size: int,
) -> tuple[int, float]:
    """Return the candidate that goes best with others, and the energy with it.

    Parameters
    ----------
    others : (k - 1,) the other markers of the layout.
    base : (F, C (C + 1) / 2) their matrices.
    weak, strong : (F, C) eigenvectors of the others' matrices, of the smallest and the
        largest eigenvalue; ends : (F, 2) those eigenvalues.
    rows : (F, N, 3, C) the candidates' Jacobians.
    bound : only a candidate with less energy is looked for; -1 and ``bound`` if none.
    size : C; the rest as in `layout_energy`.
    """
    frames, few = grams.shape[1], others.shape[0]
    total = np.zeros(grams.shape[2])
    a, d, e = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    least, unseen, share = math.inf, 0.0, weights[0] / frames
    for i in range(few):
        unseen += hidden[others[i]]
        for j in range(i):
            least = min(least, gaps[others[i], others[j]])
    found, energy_found = -1, bound
    for v in range(grams.shape[0]):
        near, twice = least, False
        for i in range(few):
            near = min(near, gaps[v, others[i]])
            twice = twice or v == others[i]
        if twice:
            continue
        energy = weights[2] * (unseen + hidden[v]) / (few + 1)
        if few > 0:
            energy -= weights[1] * near
        if weights[0] == 0.0:
            if energy < energy_found:
                found, energy_found = v, energy
            continue
        energy += weights[0]
        at_least = energy
        for n in range(frames):
            if at_least >= energy_found:
                break
            low, high = ends[order[n], 0], ends[order[n], 1]
            for row in range(3):
                along, across = 0.0, 0.0
                for c in range(size):
                    value = rows[order[n], v, row, c]
                    along += value * strong[order[n], c]
                    across += value * weak[order[n], c]
                high += along * along
                low += across * across
            at_least += share * (high / low - 1.0) if low > 0.0 else math.inf
        if at_least >= energy_found:
            continue
        for n in range(frames):
            if energy >= energy_found:
                break
            f = order[n]
            for p in range(total.shape[0]):
                total[p] = base[f, p] + grams[v, f, p]
            cap = 1.0 + (energy_found - energy) / share
            energy += share * (capped_condition(total, cap, a, d, e) - 1.0)
        if energy < energy_found:
            found, energy_found = v, energy
    return found, energy_found


@jit
def most_determined(base: Floats, grams: Floats, least: float, size: int) -> int:
    """Return the candidate with which markers leave least undetermined.

    It has the largest sum over the keyframes of ``log det(A + least I)``, A being the
    matrix with it: whatever was undetermined before counts for more than the rest.

    Parameters
    ----------
    base : (F, C (C + 1) / 2) the matrices without it; grams : as in `layout_energy`.
    least : [m^2] what a direction of which nothing is known counts as; above 0.
    size : C
    """
    a, best, found = np.zeros((size, size)), -math.inf, 0
    for v in range(grams.shape[0]):
        total = 0.0
        for f in range(grams.shape[1]):
            at = 0
            for i in range(size):
                for j in range(i + 1):  # Cholesky, row by row
                    value = base[f, at] + grams[v, f, at]
                    at += 1
                    for n in range(j):
                        value -= a[i, n] * a[j, n]
                    if i == j:
                        value = max(value + least, 1e-3 * least)
                        total += math.log(value)
                        a[i, i] = math.sqrt(value)
                    else:
                        a[i, j] = value / a[j, j]
        if total > best:
            found, best = v, total
    return found


@jit
def anneal(
    layout: Ints,
    energy: float,
    points: Floats,
    axis: Ints,
    cut: Floats,
    grams: Floats,
    gaps: Floats,
    hidden: Floats,
    weights: Floats,
    heat: Floats,
    draws: Floats,
    steps: Floats,
    size: int,
    best: Ints,
) -> tuple[float, float]:
    """Anneal a layout, and write the best on the way; return their energies.

    In each step one marker goes to another candidate: to the nearest one a random step
    away, or to any. The layout is taken if its energy is below the last one's plus
    ``-heat log(u)`` (Metropolis); this bound is drawn first, so that a layout which
    cannot pass is left as soon as that is sure. The keyframe that decided is looked at
    first in the next step.

    Parameters
    ----------
    layout : (k,) where to begin, overwritten; energy : of it, finite.
    points : (N, 3) [m] candidates; axis, cut : (N,); as in `nearest_point`.
    grams, gaps, hidden, weights : as in `layout_energy`.
    heat : (I,) temperature of each step.
    draws : (I, 3) random numbers between 0 and 1: which marker, which candidate, u.
    steps : (I, 3) [m] random steps; NaN for any candidate.
    size : C
    best : (k,) overwritten.
    """
    frames = grams.shape[1]
    sums, total = np.zeros(grams.shape[1:]), np.zeros(grams.shape[2])
    a, d, e = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    stack, beyond = np.zeros((64, 2), dtype=np.int64), np.zeros(64)
    order, share = np.arange(frames), weights[0] / frames
    for m in layout:
        sums += grams[m]
    least, best[:] = energy, layout
    for i in range(heat.shape[0]):
        m = int(draws[i, 0] * layout.shape[0])
        before = layout[m]
        after = int(draws[i, 1] * points.shape[0])
        if not math.isnan(steps[i, 0]):
            after = nearest_point(
                points[before, 0] + steps[i, 0],
                points[before, 1] + steps[i, 1],
                points[before, 2] + steps[i, 2],
                before,
                points,
                axis,
                cut,
                stack,
                beyond,
            )
        layout[m] = after
        bound = energy - heat[i] * math.log(draws[i, 2])
        new = cheap_energy(layout, gaps, hidden, weights)
        if after == before or not new < math.inf:
            layout[m] = before
            continue
        new += weights[0]
        for n in range(frames if weights[0] != 0.0 else 0):
            if new >= bound:
                break
            f = order[n]
            for p in range(total.shape[0]):
                total[p] = sums[f, p] - grams[before, f, p] + grams[after, f, p]
            cap = 1.0 + (bound - new) / share
            new += share * (capped_condition(total, cap, a, d, e) - 1.0)
            if new >= bound:
                for back in range(n, 0, -1):
                    order[back] = order[back - 1]
                order[0] = f
        if new >= bound:
            layout[m] = before
            continue
        energy = new
        for f in range(frames):
            for p in range(total.shape[0]):
                sums[f, p] += grams[after, f, p] - grams[before, f, p]
        if energy < least:
            least, best[:] = energy, layout
    return energy, least
