"""A swarm of marker layouts: how it moves, and how it is judged (Schroeder 2016, 5.2).

Layouts and energies are those of `handclean.kernels.layouts`.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.layouts import Candidates, layout_energy, make_room
from handclean.kernels.nearest_vertex import PointTree, make_waiting, nearest_point


class Swarm(NamedTuple):
    """S particles, each a layout of k markers; all of it changes as they move."""

    now: Ints
    """(S, k) candidates on which the markers are."""
    velocity: Floats
    """(S, k, 3) [m] by what each marker moved last."""
    best: Ints
    """(S, k) where each particle had its least energy."""
    energy: Floats
    """(S,) that least energy."""


class Pull(NamedTuple):
    """Constants of equation 10."""

    constriction: float
    """w, by which every movement is multiplied."""
    own: float
    """c1, to where the particle was best."""
    common: float
    """c2, to where any particle was best."""


@jit
def swarm_move(
    tree: PointTree, swarm: Swarm, leader: Ints, draws: Floats, pull: Pull
) -> None:
    """Move all particles, each of their markers to the nearest candidate.

    Schroeder 2016, equations 10 and 11, and the new velocities.

    Parameters
    ----------
    tree : the candidates.
    swarm : its places and velocities are overwritten.
    leader : (k,) where any particle was best.
    draws : (S, 2) random numbers r1, r2 between 0 and 1.
    pull : constants.
    """
    points, now, velocity, best = tree.points, swarm.now, swarm.velocity, swarm.best
    waiting = make_waiting()
    to = np.zeros(3)
    for s in range(now.shape[0]):
        own, common = pull.own * draws[s, 0], pull.common * draws[s, 1]
        for m in range(now.shape[1]):
            here, mine, ours = now[s, m], best[s, m], leader[m]
            for n in range(3):
                at = points[here, n]
                step = velocity[s, m, n] + own * (points[mine, n] - at)
                to[n] = at + pull.constriction * (
                    step + common * (points[ours, n] - at)
                )
            there = nearest_point(to[0], to[1], to[2], here, tree, waiting)
            now[s, m] = there
            for n in range(3):
                velocity[s, m, n] = points[there, n] - points[here, n]


@jit
def swarm_judge(swarm: Swarm, candidates: Candidates, order: Ints) -> None:
    """Weigh all particles, and keep where each was best.

    Parameters
    ----------
    swarm : best place and energy are overwritten where a particle now is better.
    candidates : what energies are made of.
    order : (F,) keyframes, those that decide most first.
    """
    room = make_room(candidates.columns)
    for s in range(swarm.now.shape[0]):
        energy = layout_energy(swarm.now[s], candidates, order, swarm.energy[s], room)
        if energy < swarm.energy[s]:
            swarm.energy[s] = energy
            swarm.best[s] = swarm.now[s]
