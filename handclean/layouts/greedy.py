"""Greedy search: marker after marker, then exchanges (Schroeder 2016, section 6).

First the candidate that lowers the energy most is added, until there are k. While no
candidate determines all unknowns every energy is infinite; then the one is added with
which the markers leave least undetermined (`most_determined`). Afterwards marker after
marker is exchanged for the candidate that goes best with the others, until no exchange
lowers the energy.

An exchange looks at all candidates, but at few condition numbers: a candidate v turns
the others' matrix A into A + J_v'J_v, so along A's weakest and strongest eigenvectors
u, w its condition number is at least (w'Aw + |J_v w|^2) / (u'Au + |J_v u|^2).
"""

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels.exchange import Others, best_exchange, most_determined
from handclean.layouts.objective import candidates_of, energies
from handclean.layouts.problem import Problem
from handclean.layouts.search import Found, Log, Watch
from handclean.layouts.settings import LayoutConfig

_NOTHING_KNOWN_SHARE = 1e-6
"""[-] share of the largest entry; less than this counts as nothing known (chosen)."""


def greedy(
    problem: Problem,
    settings: LayoutConfig,
    rng: np.random.Generator,
    start: Ints | None = None,
    watch: Watch | None = None,
) -> Found:
    """Find a layout greedily.

    Parameters
    ----------
    settings : markers; the weights.
    rng : not needed.
    start : (S, k) layouts, the best of which is begun with; built up if None, or if
        none of them determines the posture.
    watch : called after each marker.
    """
    log = Log(watch)
    if start is None or np.isinf(energies(problem, start, settings).total).all():
        layout = built_up(problem, settings, log)
    else:
        layout = start[energies(problem, start, settings).total.argmin()].copy()
        log.note(len(start), _energy(problem, layout, settings))
    layout = exchanged(problem, layout, settings, log)
    return Found(
        layout=layout, history=log.history(), stopped="no exchange lowers the energy"
    )


def exchanged(problem: Problem, layout: Ints, settings: LayoutConfig, log: Log) -> Ints:
    """Exchange markers one at a time until that does not lower the energy."""
    layout, least = layout.copy(), _energy(problem, layout, settings)
    settled = 0
    while settled < len(layout):
        for m in range(len(layout)):
            found, energy = exchange(problem, np.delete(layout, m), least, settings)
            settled = settled + 1 if found < 0 else 1
            if found >= 0:
                layout[m], least = found, energy
            log.note(len(problem.home), least)
            if settled >= len(layout):
                break
    return layout


def exchange(
    problem: Problem, others: Ints, bound: float, settings: LayoutConfig
) -> tuple[int, float]:
    """Return the candidate that goes best with others, and the energy with it.

    Parameters
    ----------
    others : (k - 1,) candidates.
    bound : only less energy is looked for; -1 and ``bound`` if there is none.
    """
    size = len(problem.columns)
    base: Floats = problem.grams[others].sum(axis=0)
    values, vectors = np.linalg.eigh(unpacked(base, size))
    known = Others(
        layout=np.ascontiguousarray(others, dtype=np.int64),
        matrices=base,
        weak=np.ascontiguousarray(vectors[:, :, 0]),
        strong=np.ascontiguousarray(vectors[:, :, -1]),
        smallest=np.maximum(values[:, 0], 0.0),
        largest=np.maximum(values[:, -1], 0.0),
    )
    worst_first = np.argsort(values[:, 0] / values[:, -1].clip(1e-300), kind="stable")
    candidates = candidates_of(problem, settings)
    return best_exchange(known, problem.jacobian, candidates, worst_first, bound)


def unpacked(low: Floats, size: int) -> Floats:
    """(..., C, C) symmetric matrices from (..., C (C + 1) / 2) lower triangles."""
    out = np.zeros((*low.shape[:-1], size, size))
    rows, columns = np.tril_indices(size)
    out[..., rows, columns] = low
    out[..., columns, rows] = low
    return out


def _energy(problem: Problem, layout: Ints, settings: LayoutConfig) -> float:
    return float(energies(problem, layout[None], settings).total[0])


def built_up(problem: Problem, settings: LayoutConfig, log: Log | None = None) -> Ints:
    """(k,) candidates added one at a time, each the best with those before it."""
    layout = np.zeros(0, dtype=np.int64)
    while len(layout) < settings.markers:
        layout = np.append(layout, _next(problem, layout, settings))
        if log:
            whole = len(layout) == settings.markers
            least = _energy(problem, layout, settings) if whole else np.inf
            log.note(len(problem.home), least)
    return layout


def _next(problem: Problem, layout: Ints, settings: LayoutConfig) -> int:
    """Return the candidate to add to a layout."""
    if len(layout) + 1 >= problem.needed or settings.w1 == 0.0:
        found, _ = exchange(problem, layout, np.inf, settings)
        if found >= 0:
            return found
    base: Floats = problem.grams[layout].sum(axis=0)
    free = np.setdiff1d(np.arange(len(problem.home)), layout)
    grams, size = np.ascontiguousarray(problem.grams[free]), len(problem.columns)
    least = _NOTHING_KNOWN_SHARE * float(problem.grams.max())
    return int(free[most_determined(base, grams, least, size)])
