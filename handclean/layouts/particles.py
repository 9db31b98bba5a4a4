"""The surface-constrained particle swarm of Schroeder 2016, section 5.2.

A particle is k markers on candidates, as places in the zero posture. An iteration moves
every particle (equation 10, constriction w), puts each of its markers on the nearest
candidate (equation 11), takes what it moved by as its velocity, and weighs it. In every
third iteration one marker of half of the particles goes to any candidate before they
are weighed. r1 and r2 are drawn once for each particle; particles begin at rest, on
layouts drawn at random. If none of these determines the posture, as happens with all
joint angles, one of them is built up greedily: without it the swarm is pulled nowhere.
"""

import math

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import swarm as kernels
from handclean.kernels.nearest_vertex import UNSPLIT_POINTS, PointTree
from handclean.layouts.greedy import built_up
from handclean.layouts.objective import candidates_of, energies
from handclean.layouts.problem import Problem
from handclean.layouts.search import Found, Log, Watch, random_layouts
from handclean.layouts.settings import LayoutConfig

PULL_TO_OWN_BEST, PULL_TO_BEST_OF_ALL = 2.8, 1.3
"""c1 and c2: what Carlisle and Dozier (2001) recommend."""

_PSI = PULL_TO_OWN_BEST + PULL_TO_BEST_OF_ALL
CONSTRICTION = 2.0 / abs(2.0 - _PSI - math.sqrt(_PSI**2 - 4.0 * _PSI))
"""w of Clerc and Kennedy (2002): 0.73."""

PERTURBING_ITERATIONS = 3
"""Iterations from one random change to the next (section 5.2)."""


def point_tree(points: Floats) -> tuple[Ints, PointTree]:
    """Sort (N, 3) points into a tree; return (N,) their rows in its order, and it."""
    order = np.arange(len(points))
    axis, cut = np.zeros(len(points), dtype=np.int64), np.zeros(len(points))
    ranges = [(0, len(points))]
    while ranges:
        first, last = ranges.pop()
        if last - first <= UNSPLIT_POINTS:
            continue
        part = order[first:last]
        which = int(np.ptp(points[part], axis=0).argmax())
        order[first:last] = part[np.argsort(points[part, which], kind="stable")]
        middle = (first + last) // 2
        axis[middle], cut[middle] = which, points[order[middle], which]
        ranges += [(first, middle), (middle, last)]
    return order, PointTree(np.ascontiguousarray(points[order]), axis, cut)


def swarm(
    problem: Problem,
    settings: LayoutConfig,
    rng: np.random.Generator,
    start: Ints | None = None,
    watch: Watch | None = None,
) -> Found:
    """Find a layout by a particle swarm.

    Parameters
    ----------
    settings : markers, particles, iterations, patience; the weights.
    start : (S, k) layouts to begin with; drawn if None.
    watch : called after each iteration.
    """
    if start is None:
        start = random_layouts(problem, settings.markers, settings.particles, rng)
    rows, tree = point_tree(problem.home)
    rank = np.argsort(rows)
    if np.isinf(energies(problem, start, settings).total).all():
        start = np.vstack([start[1:], built_up(problem, settings)])
    now = np.ascontiguousarray(rank[start])
    best, least = now.copy(), np.full(len(now), np.inf)
    particles = kernels.Swarm(now, np.zeros((*now.shape, 3)), best, least)
    pull = kernels.Pull(CONSTRICTION, PULL_TO_OWN_BEST, PULL_TO_BEST_OF_ALL)
    candidates = candidates_of(problem, settings, rows)
    log, stopped, since = Log(watch), "iterations", 0
    kernels.swarm_judge(particles, candidates, np.arange(len(problem.places)))
    leader = int(least.argmin())
    log.note(len(now), float(least[leader]))
    for turn in range(1, settings.iterations + 1):
        order = _worst_first(problem, rows[best[leader]], settings)
        draws = rng.random((len(now), 2))
        kernels.swarm_move(tree, particles, best[leader].copy(), draws, pull)
        if turn % PERTURBING_ITERATIONS == 0:
            _perturb(now, len(tree.points), rng)
        before = least[leader]
        kernels.swarm_judge(particles, candidates, order)
        leader = int(least.argmin())
        log.note(len(now), float(least[leader]))
        since = 0 if least[leader] < before else since + 1
        if since >= settings.patience:
            stopped = f"no better layout in {since} iterations"
            break
    return Found(layout=rows[best[leader]], history=log.history(), stopped=stopped)


def _worst_first(problem: Problem, layout: Ints, settings: LayoutConfig) -> Ints:
    """(F,) keyframes, those first in which a layout has its largest kappa."""
    kappa = energies(problem, layout[None], settings).kappa[0]
    return np.argsort(-kappa, kind="stable")


def _perturb(now: Ints, count: int, rng: np.random.Generator) -> None:
    """Put one marker of half of the particles on any candidate."""
    half = rng.permutation(len(now))[: len(now) // 2]
    which = rng.integers(0, now.shape[1], len(half))
    now[half, which] = rng.integers(0, count, len(half))
