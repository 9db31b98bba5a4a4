"""The energy of marker layouts.

A layout is k rows of N candidate places. What the energy needs is summed up beforehand:
of candidate v in keyframe f the product J'J of its three rows of the Jacobian, its
lower triangle row by row, at ``grams[v, f]``; of two candidates the smallest squared
distance over all keyframes, at ``gaps``. A layout's matrix is the sum of k products.

    E = w1/F sum_f kappa_f - w2 min_{a != b} gaps[a, b] + w3/k sum_v hidden[v]

(Schroeder 2016, equations 5 to 9; the third term is ours.) The cheap terms come first.
Every kappa is at least 1, and at least the ratio of any two values u'Au of its matrix A
with u of length 1, such as two entries of its diagonal: a layout that cannot come below
a bound any more is left at once.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.conditions import condition


class Weights(NamedTuple):
    """How much each term of the energy counts."""

    condition: float
    """w1, of the mean condition number; without it none is looked at."""
    distance: float
    """w2, of the smallest squared distance."""
    hidden: float
    """w3, of what is not seen."""


class Candidates(NamedTuple):
    """N candidate places in F keyframes, with C columns of the Jacobian."""

    grams: Floats
    """(N, F, C (C + 1) / 2) [m^2] products J'J, lower triangles row by row."""
    gaps: Floats
    """(N, N) smallest squared distance over the keyframes, in hand lengths."""
    hidden: Floats
    """(N,) share of keyframes and directions in which each is not seen."""
    weights: Weights
    """How much each term counts."""
    columns: int
    """C"""


class MatrixRoom(NamedTuple):
    """Work space for one matrix."""

    total: Floats
    """(C (C + 1) / 2,) its lower triangle, row by row."""
    square: Floats
    """(C, C)"""
    diagonal: Floats
    """(C,)"""
    beside: Floats
    """(C,)"""


@jit
def make_room(columns: int) -> MatrixRoom:
    """Return work space for a matrix of ``columns`` rows and columns."""
    return MatrixRoom(
        np.zeros(columns * (columns + 1) // 2),
        np.zeros((columns, columns)),
        np.zeros(columns),
        np.zeros(columns),
    )


@jit
def smallest_gaps(places: Floats, out: Floats) -> None:
    """Write the smallest squared distance of every two points over all frames.

    Parameters
    ----------
    places : (F, N, 3); out : (N, N), overwritten in full.
    """
    for i in range(places.shape[1]):
        out[i, i] = 0.0
        for j in range(i):
            least = math.inf
            for f in range(places.shape[0]):
                square = (places[f, i, 0] - places[f, j, 0]) ** 2
                square += (places[f, i, 1] - places[f, j, 1]) ** 2
                square += (places[f, i, 2] - places[f, j, 2]) ** 2
                least = min(least, square)
            out[i, j] = out[j, i] = least


@jit
def capped_condition(room: MatrixRoom, cap: float) -> float:
    """Return a matrix's condition number, or a smaller number that is ``cap`` or more.

    Parameters
    ----------
    room : its ``total`` is the matrix; the rest is work space.
    cap : below it the condition number is exact.
    """
    total, a, d, e = room.total, room.square, room.diagonal, room.beside
    high, low, at = 0.0, math.inf, 0
    for i in range(d.shape[0]):
        for j in range(i + 1):
            a[i, j] = total[at]
            at += 1
        high, low = max(high, a[i, i]), min(low, a[i, i])
    if not low > 0.0:
        return math.inf
    if high >= cap * low:
        return high / low
    return condition(a, d, e)


@jit
def cheap_energy(layout: Ints, candidates: Candidates) -> float:
    """Return the energy's second and third term; infinite if a candidate comes twice.

    Parameters
    ----------
    layout : (k,) rows of the candidates.
    candidates : what their energy is made of.
    """
    gaps, hidden, weights = candidates.gaps, candidates.hidden, candidates.weights
    k = layout.shape[0]
    least, unseen = math.inf, 0.0
    for i in range(k):
        unseen += hidden[layout[i]]
        for j in range(i):
            if layout[i] == layout[j]:
                return math.inf
            least = min(least, gaps[layout[i], layout[j]])
    energy = weights.hidden * unseen / k
    if k > 1:
        energy -= weights.distance * least
    return float(energy)


@jit
def layout_energy(
    layout: Ints, candidates: Candidates, order: Ints, bound: float, room: MatrixRoom
) -> float:
    """Return a layout's energy, or a smaller number that is ``bound`` or more.

    Parameters
    ----------
    layout : (k,) rows of the candidates.
    candidates : what their energy is made of.
    order : (F,) keyframes, those that decide most first.
    bound : below it the energy is exact.
    room : work space.
    """
    grams, weight = candidates.grams, candidates.weights.condition
    total = room.total
    energy = cheap_energy(layout, candidates)
    if weight == 0.0 or not energy < math.inf:
        return float(energy)
    frames, size = grams.shape[1], total.shape[0]
    share = weight / frames
    energy += weight  # all condition numbers at 1
    for n in range(frames):
        f = order[n]
        if energy >= bound:
            return float(energy)
        for p in range(size):
            total[p] = grams[layout[0], f, p]
        for m in range(1, layout.shape[0]):
            for p in range(size):
                total[p] += grams[layout[m], f, p]
        kappa = capped_condition(room, 1.0 + (bound - energy) / share)
        energy += share * (kappa - 1.0)
    return float(energy)


@jit
def conditions(layouts: Ints, grams: Floats, size: int, out: Floats) -> None:
    """Write the condition numbers of layouts in all keyframes.

    Parameters
    ----------
    layouts : (S, k) rows of the candidates.
    grams : (N, F, C (C + 1) / 2) [m^2] as in `Candidates`.
    size : C
    out : (S, F), overwritten in full.
    """
    room = make_room(size)
    total = room.total
    for s in range(layouts.shape[0]):
        for f in range(grams.shape[1]):
            total[:] = 0.0
            for m in range(layouts.shape[1]):
                for p in range(total.shape[0]):
                    total[p] += grams[layouts[s, m], f, p]
            out[s, f] = capped_condition(room, math.inf)
