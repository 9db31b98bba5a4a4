"""Annealing, then exchanges: what we use where the papers use a swarm.

A layout is changed one marker at a time: to the candidate nearest to a random step away
from where it is, or now and then to any. A change for the worse passes with a chance
that falls as the temperature does (Metropolis). Half as many layouts are weighed as by
a swarm of that many particles and iterations, each at the cost of the one marker that
changed. What comes out is settled by `exchanged`, then a few times two of its markers
are put anywhere and settled again; the better layout is kept.

Why: a swarm pulls the m-th marker of one layout to the m-th of another, though markers
have no order, so it does less well with ten, where the smallest distance counts. From
the same starts (tests/bench/RESULTS.md, layouts, figure 9): with 4, 6 and 8 markers
both always end at the best layout known; with 10 this wins more often than it loses,
and its worst end is the nearer one to the best known. It takes less time with these,
not with 14 markers or with all joints.
Exchanges alone get stuck on that distance: no single marker can widen it while two
pairs are equally close.
"""

import numpy as np

from handclean.arrays import Ints
from handclean.hand.template import HAND_LENGTH_M
from handclean.kernels.exchange import Steps
from handclean.kernels.exchange import anneal as anneal_kernel
from handclean.layouts.greedy import built_up, exchanged
from handclean.layouts.objective import candidates_of, energies
from handclean.layouts.particles import point_tree
from handclean.layouts.problem import Problem
from handclean.layouts.search import Found, Log, Watch, random_layouts
from handclean.layouts.settings import LayoutConfig

TEMPERATURE_BLOCKS = 25
"""Blocks of steps; the history has an entry for each (chosen)."""

START_TEMPERATURE, END_TEMPERATURE = 0.03, 1e-4
"""Temperatures at the start and at the end, in units of how much a layout among the
best twentieth of random ones is worse than the best of them (chosen)."""

ANYWHERE_SHARE = 0.25
"""Share of the changes that put a marker anywhere (chosen)."""

STEP_SD_M = 0.02
"""[m] standard deviation of the other changes along each axis, on a hand of template
size (chosen)."""

KICKS, KICKED_MARKERS = 6, 2
"""How often markers of the settled layout are put anywhere, and how many (chosen)."""


def anneal(
    problem: Problem,
    settings: LayoutConfig,
    rng: np.random.Generator,
    start: Ints | None = None,
    watch: Watch | None = None,
) -> Found:
    """Find a layout by annealing and exchanges.

    Parameters
    ----------
    settings : markers, particles, iterations; the weights.
    start : (S, k) layouts, the best of which is begun with; drawn if None; if none
        of them determines the posture, one is built up.
    watch : called now and then.
    """
    if start is None:
        start = random_layouts(problem, settings.markers, settings.particles, rng)
    log = Log(watch)
    weighed = energies(problem, start, settings).total
    if not np.isfinite(weighed).any():
        start = np.vstack([start[1:], built_up(problem, settings)])
        weighed = energies(problem, start, settings).total
    layout = start[weighed.argmin()].copy()
    log.note(len(start), float(weighed.min()))
    finite = np.sort(weighed[np.isfinite(weighed)])
    if len(finite):
        scale = max(float(finite[len(finite) // 20] - finite[0]), 1e-9)
        layout = _annealed(problem, layout, scale, settings, rng, log)
    layout = exchanged(problem, layout, settings, log)
    for _ in range(KICKS):
        layout = _kicked(problem, layout, settings, rng, log)
    return Found(
        layout=layout,
        history=log.history(),
        stopped=f"settled after {KICKS} kicks",
    )


def _annealed(
    problem: Problem,
    layout: Ints,
    scale: float,
    settings: LayoutConfig,
    rng: np.random.Generator,
    log: Log,
) -> Ints:
    """Anneal a layout of finite energy; return the best on the way."""
    rows, tree = point_tree(problem.home)
    now = best = np.argsort(rows)[layout]
    energy = least = log.least
    count = settings.particles * settings.iterations // (2 * TEMPERATURE_BLOCKS)
    reach = STEP_SD_M * problem.length_m / HAND_LENGTH_M
    heats = scale * np.geomspace(
        START_TEMPERATURE, END_TEMPERATURE, count * TEMPERATURE_BLOCKS
    ).reshape(TEMPERATURE_BLOCKS, count)
    candidates = candidates_of(problem, settings, rows)
    for heat in heats:
        away = rng.normal(0.0, reach, (count, 3))
        away[rng.random(count) < ANYWHERE_SHARE] = np.nan
        marker, anywhere, luck = np.ascontiguousarray(1.0 - rng.random((count, 3)).T)
        steps = Steps(heat, marker, anywhere, luck, away)
        found = anneal_kernel(now, energy, tree, candidates, steps)
        now, energy = found.layout, found.energy
        if found.least < least:
            best, least = found.best, found.least
        log.note(count, least)
    return rows[best]


def _kicked(
    problem: Problem,
    layout: Ints,
    settings: LayoutConfig,
    rng: np.random.Generator,
    log: Log,
) -> Ints:
    """Put two markers anywhere and settle; keep the better layout."""
    free = np.setdiff1d(np.arange(len(problem.home)), layout)
    moved = min(KICKED_MARKERS, len(layout), len(free))
    trial = layout.copy()
    which = rng.permutation(len(layout))[:moved]
    trial[which] = rng.choice(free, moved, replace=False)
    before = log.least
    trial = exchanged(problem, trial, settings, log)
    return trial if log.least < before else layout
