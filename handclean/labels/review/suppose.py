"""What a path of points would be worth under another name."""

import math

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.labels.review.paths import Glance
from handclean.labels.track.alternatives import rebend
from handclean.labels.track.fit import distance, resettle, worth
from handclean.labels.track.tracker import Kit, State, Trace, Way, put

JUMP = 4.0
"""What it costs at most that a finger jumped."""


@jit
def suppose(
    t: int,
    row: int,
    name: int,
    other: int,
    bent: bool,
    way: Way,
    s: State,
    kit: Kit,
    trace: Trace,
) -> float:
    """Return what the fit of a frame is worth if a point had another name.

    Parameters
    ----------
    row : the point, -1 to leave all as it is; name : marker it shall be, -1 none.
    other : marker that the point which has that name shall be, -1 none may have it.
        With the point's own name the two change places.
    bent : whether to bend these markers' fingers from other postures in any case; else
        only if it does not fit.

    Returns
    -------
    Infinity if a name belongs to another point. The pose is left in ``s.attempt``.
    """
    moved = -1
    if name >= 0 and trace.chosen[t, name] != row:
        moved = trace.chosen[t, name]
    if moved >= 0 and (other < 0 or trace.chosen[t, other] not in (-1, row)):
        return math.inf
    for m in range(s.weight.shape[0]):
        p = trace.chosen[t, m]
        if m == name:
            p = row
        elif m == other and moved >= 0:
            p = moved
        elif p == row:
            p = -1
        s.weight[m] = 0.0
        if p >= 0:
            s.weight[m] = 1.0
            s.target[m] = way.at[p]
    s.attempt[:] = trace.pose[t]
    resettle(s.attempt, kit.none, s, kit)
    found = worth(s.weight, kit)
    if name < 0:
        return found
    far = distance(kit, name) ** 2 > 4.0 * kit.variance[name]
    if bent or far or found > 2.0 * s.weight.shape[0]:
        for m in (name, other):
            if m >= 0 and kit.branch[m] > 0:
                found = rebend(s.attempt, kit.branch[m], s, kit)
    return found


@jit
def jump(t: int, by: int, name: int, pose: Floats, kit: Kit, trace: Trace) -> float:
    """Return how unlikely a finger moved so far while its marker was out of sight.

    Parameters
    ----------
    t : first or last frame of a path, with its pose; by : -1 or 1, the way out of it.
    """
    other = t + by
    while 0 <= other < trace.chosen.shape[0] and trace.chosen[other, name] < 0:
        other += by
    if not 0 <= other < trace.chosen.shape[0]:
        return 0.0
    sd = 0.1 + kit.rules.swing * (abs(other - t) - 1)
    total = 0.0
    for d in range(kit.hinge_branch.shape[0]):
        if kit.hinge_branch[d] == kit.branch[name]:
            away = (pose[7 + d] - trace.pose[other, 7 + d]) / sd
            total += away * away
    return min(total, JUMP)


@jit
def judge_path(
    seen: Glance,
    name: int,
    other: int,
    bent: bool,
    enough: float,
    write: bool,
    way: Way,
    s: State,
    kit: Kit,
    trace: Trace,
) -> tuple[float, float]:
    """Return what a path is worth under a name, on average over some of its frames.

    Beside it stands what its finger's jumps at both ends cost.

    Parameters
    ----------
    name, other, bent : see `suppose`.
    enough : a path that cannot be worth less any more is infinitely bad.
    write : whether to keep the poses, in the trace.
    """
    total, count, jumps = 0.0, 0, 0.0
    size = seen.rows.shape[0]
    for n in range(size):
        t = seen.frames[n]
        if not trace.known[t]:
            continue
        found = suppose(t, seen.rows[n], name, other, bent, way, s, kit, trace)
        if found == math.inf:
            return math.inf, 0.0
        for by in (-1, 1):
            if name >= 0 and n == (0 if by < 0 else size - 1):
                jumps += jump(t, by, name, s.attempt, kit, trace)
        if write:
            keep_pose(t, found, s, kit, trace)
        total += found
        count += 1
        if total > size * enough:
            return math.inf, 0.0
    return (total / count, jumps) if count > 0 else (math.inf, 0.0)


@jit
def keep_pose(t: int, cost: float, s: State, kit: Kit, trace: Trace) -> None:
    """Write the pose that `suppose` found, and how well it fits."""
    square, count = 0.0, 0
    for m in range(s.weight.shape[0]):
        if s.weight[m] > 0.0:
            square += distance(kit, m) ** 2
            count += 1
    trace.pose[t] = s.attempt
    trace.cost[t] = cost
    trace.rms[t] = math.sqrt(square / count)


@jit
def measure(way: Way, kit: Kit, trace: Trace, places: Floats, squares: Floats) -> None:
    """Write where the poses of a trace put the markers, and how far their points are.

    Parameters
    ----------
    places : (T, M, 3) [m]; squares : (T, M) [m^2], NaN where there is no point.
    """
    for t in range(places.shape[0]):
        put(trace.pose[t], kit, places[t])
        for m in range(places.shape[1]):
            p = trace.chosen[t, m]
            squares[t, m] = math.nan
            if p >= 0 and trace.known[t]:
                total = 0.0
                for n in range(3):
                    total += (way.at[p, n] - places[t, m, n]) ** 2
                squares[t, m] = total


def measured(way: Way, kit: Kit, trace: Trace) -> tuple[Floats, Floats]:
    """(T, M, 3) [m] places and (T, M) [m^2] squared distances, see `measure`."""
    frames, markers = trace.chosen.shape
    places, squares = np.zeros((frames, markers, 3)), np.zeros((frames, markers))
    measure(way, kit, trace, places, squares)
    return places, squares


def usual_variance(squares: Floats, kit: Kit) -> Floats:
    """(M,) [m^2] of the markers' distances in this take, no less than calibrated.

    Four in five distances are shorter; a few ghosts do not matter to that.
    """
    rows = np.flatnonzero(np.isfinite(squares).any(axis=1))
    some = squares[rows[:: max(len(rows) // 500, 1)]]
    size = np.isfinite(some).sum(axis=0)
    if len(some) == 0:
        return kit.variance
    order = np.sort(some, axis=0)  # NaN last
    at = np.maximum(np.ceil(0.8 * size).astype(int) - 1, 0)
    found = order[at, np.arange(some.shape[1])]
    return np.where(size > 0, np.fmax(kit.variance, found), kit.variance)
