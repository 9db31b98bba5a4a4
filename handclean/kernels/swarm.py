"""A swarm of marker layouts: how it moves, and how it is judged (Schroeder 2016, 5.2).

Layouts and energies are those of `handclean.kernels.layouts`.
"""

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.layouts import layout_energy
from handclean.kernels.nearest_vertex import nearest_point


@jit
def swarm_move(
    points: Floats,
    axis: Ints,
    cut: Floats,
    now: Ints,
    best: Ints,
    leader: Ints,
    velocity: Floats,
    draws: Floats,
    pull: Floats,
) -> None:
    """Move all particles, each of their markers to the nearest candidate.

    Schroeder 2016, equations 10 and 11, and the new velocities.

    Parameters
    ----------
    points : (N, 3) [m] candidates; axis, cut : (N,); as in `nearest_point`.
    now : (S, k) where the particles are; overwritten.
    best : (S, k) where each was best; leader : (k,) where any was.
    velocity : (S, k, 3) [m] overwritten.
    draws : (S, 2) random numbers r1, r2 between 0 and 1.
    pull : (3,) w, c1, c2.
    """
    stack, beyond = np.zeros((64, 2), dtype=np.int64), np.zeros(64)
    to = np.zeros(3)
    for s in range(now.shape[0]):
        own, common = pull[1] * draws[s, 0], pull[2] * draws[s, 1]
        for m in range(now.shape[1]):
            here, mine, ours = now[s, m], best[s, m], leader[m]
            for n in range(3):
                at = points[here, n]
                step = velocity[s, m, n] + own * (points[mine, n] - at)
                to[n] = at + pull[0] * (step + common * (points[ours, n] - at))
            there = nearest_point(
                to[0], to[1], to[2], here, points, axis, cut, stack, beyond
            )
            now[s, m] = there
            for n in range(3):
                velocity[s, m, n] = points[there, n] - points[here, n]


@jit
def swarm_judge(
    now: Ints,
    best: Ints,
    energies: Floats,
    grams: Floats,
    gaps: Floats,
    hidden: Floats,
    weights: Floats,
    order: Ints,
    size: int,
) -> None:
    """Weigh all particles, and keep where each was best.

    Parameters
    ----------
    now : (S, k); best : (S, k) overwritten where now is better.
    energies : (S,) of the best, overwritten where now is better.
    size : C, the columns of the Jacobian; the rest as in `layout_energy`.
    """
    kappa, total = np.zeros(grams.shape[1]), np.zeros(grams.shape[2])
    a, d, e = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    for s in range(now.shape[0]):
        energy = layout_energy(
            now[s],
            grams,
            gaps,
            hidden,
            weights,
            order,
            energies[s],
            kappa,
            total,
            a,
            d,
            e,
        )
        if energy < energies[s]:
            energies[s] = energy
            best[s] = now[s]
