"""Where the fit is worse than it should be: look again, follow from there, compare.

Following can go wrong for a while - two fingers change places in a fast movement - and
the cost of every frame says so, long before or after the tracker notices. The worst
frames are looked at on their own, first from the pose they have, with fingers exchanged
and reaching out; then as if nothing were known. From a better fit the hand is followed
both ways, and takes over as far as it stays better in sum.
"""

import math

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.ik.settings import SolveConfig
from handclean.kernels import jit
from handclean.kernels.gauss_newton import Observations, misfit
from handclean.labels.review.suppose import measured
from handclean.labels.search.align import search
from handclean.labels.settings import LabelConfig
from handclean.labels.target import Sought
from handclean.labels.track.alternatives import BETTER, exchange, reach_out, rebend
from handclean.labels.track.fit import MISSING, bend, narrow, resettle, target_of, worth
from handclean.labels.track.frames import follow
from handclean.labels.track.tracker import (
    Kit,
    State,
    Trace,
    Way,
    make_trace,
    new_book,
    new_state,
)

AROUND = 2
"""Frames on either side over which the cost is averaged."""

SUSPECTS, STRANGERS = 30, 6
"""How many bad frames are looked at again, at most; how many as if nothing were
known, one and another for every ``2 * EACH`` frames."""

EXPECTED = 2.0
"""Cost per assigned marker that is not worth a look, whatever the others cost."""

HOPELESS = 8
"""Looks without success in a row after which no more are taken, at most."""

EACH = 1000
"""Frames that add one to the looks without success that are allowed, from two on."""

STRANGE = 2.5
"""Cost per assigned marker at which nothing that is known may be right."""

BESIDE = 0.04
"""[m] a point nearer than this to a marker's place is near the hand."""

STRETCH = 200
"""Frames that are followed before it is asked whether to go on."""


def amend(t: int, way: Way, s: State, kit: Kit, trace: Trace) -> float:
    """Look for a better fit of one frame near the one it has; it is left in ``s``.

    Returns
    -------
    What the fit is worth.
    """
    begin = way.start[t]
    points = way.at[begin : way.start[t + 1]]
    s.chosen[:] = np.where(trace.chosen[t] >= 0, trace.chosen[t] - begin, -1)
    s.pose[:] = trace.pose[t]
    if target_of(points, s.chosen, s.target, s.weight) < 4:
        return math.inf
    misfit(s.pose, Observations(s.target, s.weight), kit.tree, kit.k)
    cost = worth(s.weight, kit)
    s.attempt[:] = s.pose
    chosen = s.chosen.copy()
    found = bend(s.attempt, points, s, kit, kit.none, kit.rules.reach, narrow(kit))
    if found < cost:
        cost = found
        s.pose[:] = s.attempt
    else:
        s.chosen[:] = chosen
    target_of(points, s.chosen, s.target, s.weight)
    resettle(s.pose, kit.none, s, kit)
    for branch in poor_fingers(s, kit):
        cost = rebend(s.pose, branch, s, kit)
    cost = reach_out(s.pose, points, s, kit, 2.0 * kit.rules.reach, cost)
    return float(exchange(s.pose, points, s, kit, cost))


def poor_fingers(s: State, kit: Kit) -> list[int]:
    """Fingers that fit worse than is expected of their markers."""
    square = np.einsum("mn,mn->m", kit.k.error, kit.k.error)
    cost = np.where(s.weight > 0.0, np.fmin(square / kit.variance, MISSING), 0.0)
    mean = [
        cost[kit.branch == branch].sum() / max(s.weight[kit.branch == branch].sum(), 1)
        for branch in range(1, int(kit.branch.max(initial=0)) + 1)
    ]
    return [n + 1 for n, value in enumerate(mean) if value > EXPECTED]


@jit
def count_spare(way: Way, trace: Trace, places: Floats, spare: Floats) -> None:
    """Write how many markers a frame lacks needlessly.

    Parameters
    ----------
    places : (T, M, 3) [m] of the markers.
    spare : (T,) markers without a point, as far as there are points without a marker
        near the hand.
    """
    markers = places.shape[1]
    most = 0
    for t in range(places.shape[0]):
        most = max(most, way.start[t + 1] - way.start[t])
    free = np.zeros(most, np.bool_)
    for t in range(places.shape[0]):
        spare[t] = 0.0
        begin, end = way.start[t], way.start[t + 1]
        free[: end - begin] = True
        count = 0
        for m in range(markers):
            if trace.chosen[t, m] >= 0:
                free[trace.chosen[t, m] - begin] = False
                count += 1
        if not trace.known[t] or count == markers:
            continue
        near = 0
        for p in range(end - begin):
            if not free[p]:
                continue
            for m in range(markers):
                d2 = 0.0
                for n in range(3):
                    d2 += (way.at[begin + p, n] - places[t, m, n]) ** 2
                if d2 < BESIDE * BESIDE:
                    near += 1
                    break
        spare[t] = min(markers - count, near)


def mean_cost(squares: Floats, kit: Kit) -> Floats:
    """(T,) squared standard deviations per assigned marker, NaN where none are."""
    has = np.isfinite(squares)
    cost = np.where(has, np.fmin(squares / kit.variance, MISSING), 0.0).sum(axis=1)
    count = has.sum(axis=1)
    return np.where(count > 0, cost / np.maximum(count, 1), math.nan)


def suspicious(fit: Floats, spare: Floats, markers: int) -> Floats:
    """(T,) by how much the cost around each frame is above what is usual, or 0."""
    known = np.isfinite(fit)
    if not known.any():
        return np.zeros(len(fit))
    weight = np.maximum(_around(known), 1.0)
    mean = _around(np.where(known, fit, 0.0)) / weight
    middle = float(np.median(mean[known]))
    spread = 1.48 * float(np.median(np.abs(mean[known] - middle)))
    most = min(middle + 4.0 * spread, EXPECTED) + BETTER / markers
    excess = np.where(mean > most, mean / most - 1.0, 0.0)
    idle = _around(spare) / (2 * AROUND + 1)
    return np.where(known, excess + np.where(idle > 1.5, idle, 0.0), 0.0)


def _around(values: Floats | Bools) -> Floats:
    """(T,) sum over each frame and those around it, however few frames there are."""
    total: Floats = np.convolve(values, np.ones(2 * AROUND + 1))
    return total[AROUND : len(total) - AROUND]


def repair(
    ways: tuple[Way, Way],
    thing: Sought,
    kit: Kit,
    settings: LabelConfig,
    solving: SolveConfig,
    trace: Trace,
) -> list[tuple[int, int]]:
    """Replace stretches of a trace by better ones, in place.

    Parameters
    ----------
    ways : the take followed forwards, and backwards.

    Returns
    -------
    First frame and frame after the last of every stretch replaced.
    """
    done: list[tuple[int, int]] = []
    state = new_state(len(thing.sigma), len(thing.mean))
    places, squares = measured(ways[0], kit, trace)
    fit, spare = mean_cost(squares, kit), np.zeros(len(trace.known))
    count_spare(ways[0], trace, places, spare)
    excess = suspicious(fit, spare, len(thing.sigma))
    usual, strangers = float(np.median(fit[np.isfinite(fit)])), 0
    failed, most = 0, min(2 + len(fit) // EACH, HOPELESS)
    for _ in range(SUSPECTS):
        t = int(np.argmax(excess))
        if excess[t] <= 0.0 or failed >= most:
            break
        cost = amend(t, ways[0], state, kit, trace)
        strange = fit[t] > STRANGE * max(usual, 1.0) or spare[t] > 2.0
        if (
            cost > trace.cost[t] - BETTER
            and strange
            and strangers < min(1 + len(fit) // (2 * EACH), STRANGERS)
        ):
            strangers += 1
            cost = _stranger(t, ways[0], thing, kit, settings, solving, state)
        a, b = t, t + 1
        if cost < trace.cost[t] - BETTER:
            a, b = _take_over(t, ways, thing, kit, state, trace)
            if b > a:
                done.append((a, b))
        failed = 0 if b > a + 1 else failed + 1
        excess[max(min(a, t) - AROUND, 0) : max(b, t) + 1 + AROUND] = 0.0
    return done


def _stranger(
    t: int,
    way: Way,
    thing: Sought,
    kit: Kit,
    settings: LabelConfig,
    solving: SolveConfig,
    state: State,
) -> float:
    """Find the hand in a frame as if nothing were known; return what it is worth."""
    ways = search(
        way.at[way.start[t] : way.start[t + 1]],
        thing,
        t,
        rules=kit.rules,
        alpha=settings.alpha,
        solving=solving,
        postures=len(thing.starts),
        rotations=30,
        keep=30,
    )
    if not ways:
        return math.inf
    state.pose[:], state.chosen[:] = ways[0].pose, ways[0].chosen
    points = way.at[way.start[t] : way.start[t + 1]]
    target_of(points, state.chosen, state.target, state.weight)
    misfit(state.pose, Observations(state.target, state.weight), kit.tree, kit.k)
    return float(worth(state.weight, kit))


def _take_over(
    t: int,
    ways: tuple[Way, Way],
    thing: Sought,
    kit: Kit,
    found: State,
    trace: Trace,
) -> tuple[int, int]:
    """Follow a better fit both ways, as far as it stays better in sum.

    Returns
    -------
    The first frame replaced, and the one after the last.
    """
    frames, markers = trace.chosen.shape
    other = make_trace(frames, markers, len(thing.mean))
    edges = []
    for way, by in zip(ways, (1, -1), strict=True):
        state = new_state(markers, len(thing.mean))
        state.pose[:] = found.pose
        gone = (found.chosen < 0).astype(np.int64)
        book = new_book(thing, kit.rules, gone)
        here, best, gain, edge = t, 0.0, 0.0, t
        end = frames if by > 0 else -1
        while here != end:
            stop = min(here + STRETCH, frames) if by > 0 else max(here - STRETCH, -1)
            reached = int(follow(way, here, stop, by, state, book, kit, other))
            rows = np.arange(here, reached, by)
            gains = gain + np.cumsum(
                _known(trace.cost[rows]) - _known(other.cost[rows])
            )
            if len(rows) and gains.max() > best:
                best, edge = float(gains.max()), int(rows[np.argmax(gains)]) + by
            if len(rows) == 0 or reached != stop or edge != stop:
                break
            gain, here = float(gains[-1]), stop
        edges.append(edge)
    if edges == [t, t]:
        return t, t
    a, b = min(edges[1] + 1, t), max(edges[0], t + 1)
    for name in Trace._fields:
        getattr(trace, name)[a:b] = getattr(other, name)[a:b]
    return a, b


def _known(cost: Floats) -> Floats:
    """Costs, with a high one where there is none."""
    return np.where(np.isfinite(cost), cost, 1e3)
