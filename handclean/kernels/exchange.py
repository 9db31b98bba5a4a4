"""Changing one marker of a layout, or adding one: greedily, and by annealing.

Layouts and energies are those of `handclean.kernels.layouts`.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.layouts import (
    Candidates,
    capped_condition,
    cheap_energy,
    make_room,
)
from handclean.kernels.nearest_vertex import PointTree, make_waiting, nearest_point


class Others(NamedTuple):
    """A layout without one of its markers, and what it determines."""

    layout: Ints
    """(k - 1,) rows of the candidates."""
    matrices: Floats
    """(F, C (C + 1) / 2) [m^2] its matrices, lower triangles row by row."""
    weak: Floats
    """(F, C) their eigenvectors of the smallest eigenvalue."""
    strong: Floats
    """(F, C) their eigenvectors of the largest eigenvalue."""
    smallest: Floats
    """(F,) [m^2] the smallest eigenvalue, not below 0."""
    largest: Floats
    """(F,) [m^2] the largest eigenvalue."""


class Steps(NamedTuple):
    """What is drawn for I steps of annealing."""

    heat: Floats
    """(I,) temperature."""
    marker: Floats
    """(I,) between 0 and 1: which marker moves."""
    anywhere: Floats
    """(I,) between 0 and 1: to which candidate, if to any."""
    luck: Floats
    """(I,) u above 0 and up to 1, see `anneal`."""
    away: Floats
    """(I, 3) [m] how far it moves; NaN if to any candidate."""


class Annealed(NamedTuple):
    """How annealing ended."""

    layout: Ints
    """(k,) where it ended."""
    energy: float
    """There."""
    best: Ints
    """(k,) the best layout on the way."""
    least: float
    """Its energy."""


@jit
def best_exchange(
    others: Others, rows: Floats, candidates: Candidates, order: Ints, bound: float
) -> tuple[int, float]:
    """Return the candidate that goes best with others, and the energy with it.

    Parameters
    ----------
    others : the other markers of the layout.
    rows : (F, N, 3, C) [m/rad] the candidates' Jacobians.
    candidates : what energies are made of.
    order : (F,) keyframes, those that decide most first.
    bound : only a candidate with less energy is looked for; -1 and ``bound`` if none.
    """
    grams, gaps, hidden = candidates.grams, candidates.gaps, candidates.hidden
    weights, layout = candidates.weights, others.layout
    frames, few, size = grams.shape[1], layout.shape[0], candidates.columns
    room = make_room(size)
    total = room.total
    least, unseen, share = math.inf, 0.0, weights.condition / frames
    for i in range(few):
        unseen += hidden[layout[i]]
        for j in range(i):
            least = min(least, gaps[layout[i], layout[j]])
    found, energy_found = -1, bound
    for v in range(grams.shape[0]):
        near, twice = least, False
        for i in range(few):
            near = min(near, gaps[v, layout[i]])
            twice = twice or v == layout[i]
        if twice:
            continue
        energy = weights.hidden * (unseen + hidden[v]) / (few + 1)
        if few > 0:
            energy -= weights.distance * near
        if weights.condition == 0.0:
            if energy < energy_found:
                found, energy_found = v, energy
            continue
        energy += weights.condition
        at_least = energy
        for n in range(frames):
            if at_least >= energy_found:
                break
            low, high = others.smallest[order[n]], others.largest[order[n]]
            for row in range(3):
                along, across = 0.0, 0.0
                for c in range(size):
                    value = rows[order[n], v, row, c]
                    along += value * others.strong[order[n], c]
                    across += value * others.weak[order[n], c]
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
                total[p] = others.matrices[f, p] + grams[v, f, p]
            cap = 1.0 + (energy_found - energy) / share
            energy += share * (capped_condition(room, cap) - 1.0)
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
    base : (F, C (C + 1) / 2) the matrices without it; grams : as in `Candidates`.
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
    start: Ints, energy: float, tree: PointTree, candidates: Candidates, steps: Steps
) -> Annealed:
    """Anneal a layout.

    In each step one marker goes to another candidate: to the nearest one a random step
    away, or to any. The layout is taken if its energy is below the last one's plus
    ``-heat log(u)`` (Metropolis); this bound is drawn first, so that a layout which
    cannot pass is left as soon as that is sure. The keyframe that decided is looked at
    first in the next step.

    Parameters
    ----------
    start : (k,) rows of the candidates to begin with.
    energy : of it, finite.
    tree : the candidates.
    candidates : what energies are made of.
    steps : what was drawn.
    """
    grams, points, away = candidates.grams, tree.points, steps.away
    weight, frames = candidates.weights.condition, grams.shape[1]
    sums, waiting = np.zeros(grams.shape[1:]), make_waiting()
    room = make_room(candidates.columns)
    total, layout, best = room.total, start.copy(), start.copy()
    order, share = np.arange(frames), weight / frames
    for m in layout:
        sums += grams[m]
    least = energy
    for i in range(steps.heat.shape[0]):
        m = int(steps.marker[i] * layout.shape[0])
        before = layout[m]
        after = int(steps.anywhere[i] * points.shape[0])
        if not math.isnan(away[i, 0]):
            after = nearest_point(
                points[before, 0] + away[i, 0],
                points[before, 1] + away[i, 1],
                points[before, 2] + away[i, 2],
                before,
                tree,
                waiting,
            )
        layout[m] = after
        bound = energy - steps.heat[i] * math.log(steps.luck[i])
        new = cheap_energy(layout, candidates)
        if after == before or not new < math.inf:
            layout[m] = before
            continue
        new += weight
        for n in range(frames if weight != 0.0 else 0):
            if new >= bound:
                break
            f = order[n]
            for p in range(total.shape[0]):
                total[p] = sums[f, p] - grams[before, f, p] + grams[after, f, p]
            cap = 1.0 + (bound - new) / share
            new += share * (capped_condition(room, cap) - 1.0)
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
    return Annealed(layout, energy, best, least)
