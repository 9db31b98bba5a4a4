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

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.conditions import condition


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
def capped_condition(
    total: Floats, cap: float, a: Floats, d: Floats, e: Floats
) -> float:
    """Return a matrix's condition number, or a smaller number that is ``cap`` or more.

    Parameters
    ----------
    total : (C (C + 1) / 2,) lower triangle, row by row.
    a : (C, C); d, e : (C,) work space.
    """
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
def cheap_energy(layout: Ints, gaps: Floats, hidden: Floats, weights: Floats) -> float:
    """Return the energy's second and third term; infinite if a candidate comes twice.

    Parameters
    ----------
    layout : (k,); gaps : (N, N); hidden : (N,); weights : (3,) w1, w2, w3.
    """
    k = layout.shape[0]
    least, unseen = math.inf, 0.0
    for i in range(k):
        unseen += hidden[layout[i]]
        for j in range(i):
            if layout[i] == layout[j]:
                return math.inf
            least = min(least, gaps[layout[i], layout[j]])
    energy = weights[2] * unseen / k
    if k > 1:
        energy -= weights[1] * least
    return float(energy)


@jit
def layout_energy(
    layout: Ints,
    grams: Floats,
    gaps: Floats,
    hidden: Floats,
    weights: Floats,
    order: Ints,
    bound: float,
    kappa: Floats,
    total: Floats,
    a: Floats,
    d: Floats,
    e: Floats,
) -> float:
    """Return a layout's energy, or a smaller number that is ``bound`` or more.

    Parameters
    ----------
    layout : (k,) candidates.
    grams : (N, F, C (C + 1) / 2); gaps : (N, N); hidden : (N,)
    weights : (3,) w1, w2, w3; without w1 no condition number is looked at.
    order : (F,) keyframes, those that decide most first.
    kappa : (F,) condition numbers, overwritten as far as they were needed.
    total : (C (C + 1) / 2,); a : (C, C); d, e : (C,) work space.
    """
    energy = cheap_energy(layout, gaps, hidden, weights)
    if weights[0] == 0.0 or not energy < math.inf:
        return float(energy)
    frames, size = grams.shape[1], total.shape[0]
    share = weights[0] / frames
    energy += weights[0]  # all condition numbers at 1
    for n in range(frames):
        f = order[n]
        if energy >= bound:
            return float(energy)
        for p in range(size):
            total[p] = grams[layout[0], f, p]
        for m in range(1, layout.shape[0]):
            for p in range(size):
                total[p] += grams[layout[m], f, p]
        kappa[f] = capped_condition(total, 1.0 + (bound - energy) / share, a, d, e)
        energy += share * (kappa[f] - 1.0)
    return float(energy)


@jit
def conditions(layouts: Ints, grams: Floats, size: int, out: Floats) -> None:
    """Write the condition numbers of layouts in all keyframes.

    Parameters
    ----------
    layouts : (S, k); grams : (N, F, C (C + 1) / 2); size : C
    out : (S, F), overwritten in full.
    """
    total = np.zeros(grams.shape[2])
    a, d, e = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    for s in range(layouts.shape[0]):
        for f in range(grams.shape[1]):
            total[:] = 0.0
            for m in range(layouts.shape[1]):
                for p in range(total.shape[0]):
                    total[p] += grams[layouts[s, m], f, p]
            out[s, f] = capped_condition(total, math.inf, a, d, e)
