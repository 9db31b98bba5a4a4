"""After tracking: every path of points is judged as a whole.

Frame by frame a ghost beside a hidden marker can stay below the threshold, and a marker
that comes back far from where its finger was frozen can stay above it. Over the life of
a path both show: with a ghost the finger never fits as it usually does; with the right
marker it does in every frame. So each path is tried, in a few frames spread over its
life, as what it is called now, as nothing, and as each marker that is hidden meanwhile
and near; the alternative that is worth most, by a margin, stands. To what the fit is
worth (`bend.worth`) comes how far the finger must have jumped, at the path's beginning,
from where it was last seen.
"""

import math

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.kernels.gauss_newton import misfit
from handclean.labels.bend import distance, resettle, worth
from handclean.labels.corrections import rebend
from handclean.labels.kit import (
    ABSENT,
    FOLLOWED,
    RETURNED,
    Kit,
    State,
    Trace,
    Way,
    put,
)

SAMPLES = 6
"""Frames of a path that are looked at."""

SHORTEST = 3
"""Frames that a path of no marker must last to be given a name."""

MARGIN = 2.0
"""By how much, in `worth`, another name must be better."""

JUMP = 4.0
"""What it costs at most that a finger jumped."""

NEAR = 0.08
"""[m] how far a hidden marker may be from a path that could be its."""

RIVALS = 3
"""How many hidden markers a path is tried as."""


def paths(after: Ints, before: Ints) -> tuple[Ints, Ints]:
    """(N,) first row and length of every path."""
    first = np.flatnonzero(before < 0)
    length = np.zeros(len(first), dtype=np.int64)
    measure(first, after, length)
    return first, length


@jit
def measure(first: Ints, after: Ints, length: Ints) -> None:
    """Write how many points each path has."""
    for n in range(first.shape[0]):
        row, count = first[n], 0
        while row >= 0:
            row = after[row]
            count += 1
        length[n] = count


@jit
def names_of(trace: Trace, rows: int) -> Ints:
    """(P,) the marker each point is, -1 none."""
    name = np.full(rows, -1)
    for t in range(trace.chosen.shape[0]):
        for m in range(trace.chosen.shape[1]):
            if trace.chosen[t, m] >= 0:
                name[trace.chosen[t, m]] = m
    return name


@jit
def suppose(
    t: int, row: int, name: int, next: int, way: Way, s: State, kit: Kit, trace: Trace
) -> float:
    """Return what the fit of a frame is worth if a point had another name.

    Parameters
    ----------
    row : the point; name : marker it shall be, -1 none.
    next : marker that the point which has that name shall be, -1 none may have it.

    Returns
    -------
    Infinity if a name belongs to another point. The pose is left in ``s.attempt``.
    """
    moved = -1
    if name >= 0 and trace.chosen[t, name] != row:
        moved = trace.chosen[t, name]
    if moved >= 0 and (next < 0 or trace.chosen[t, next] >= 0):
        return math.inf
    for m in range(s.weight.shape[0]):
        p = trace.chosen[t, m]
        if m == name:
            p = row
        elif m == next and moved >= 0:
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
    if name >= 0 and kit.branch[name] > 0:
        far = distance(kit, name) ** 2 > 4.0 * kit.variance[name]
        if far or found > 2.0 * s.weight.shape[0]:
            found = rebend(s.attempt, kit.branch[name], s, kit)
            if next >= 0 and kit.branch[next] > 0:
                found = rebend(s.attempt, kit.branch[next], s, kit)
    return found


@jit
def jump(t: int, by: int, name: int, s: State, kit: Kit, trace: Trace) -> float:
    """Return how unlikely a finger moved so far while its marker was out of sight.

    Parameters
    ----------
    t : first or last frame of a path, its pose in ``s.attempt``; by : -1 or 1, the way
        out of it.
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
            away = (s.attempt[7 + d] - trace.pose[other, 7 + d]) / sd
            total += away * away
    return min(total, JUMP)


@jit
def judge_path(
    rows: Ints,
    frames: Ints,
    name: int,
    next: int,
    way: Way,
    s: State,
    kit: Kit,
    trace: Trace,
) -> tuple[float, float]:
    """Return what a path is worth under a name, on average over some of its frames.

    Beside it stands what its finger's jumps at both ends cost.

    Parameters
    ----------
    rows, frames : (SAMPLES,) points of the path and their frames, rising.
    name, next : see `suppose`.
    """
    total, count, jumps = 0.0, 0, 0.0
    for n in range(rows.shape[0]):
        if not trace.known[frames[n]]:
            continue
        found = suppose(frames[n], rows[n], name, next, way, s, kit, trace)
        if found == math.inf:
            return math.inf, 0.0
        if name >= 0 and n == 0:
            jumps += jump(frames[n], -1, name, s, kit, trace)
        if name >= 0 and n == rows.shape[0] - 1:
            jumps += jump(frames[n], 1, name, s, kit, trace)
        total += found
        count += 1
    return (total / count, jumps) if count > 0 else (math.inf, 0.0)


@jit
def rivals(
    rows: Ints, frames: Ints, own: int, way: Way, s: State, kit: Kit, trace: Trace,
    out: Ints,
) -> int:  # fmt: skip
    """Write the hidden markers nearest to a path, at most as many as ``out`` holds.

    Returns
    -------
    How many there are.
    """
    markers = s.weight.shape[0]
    near = np.full(markers, math.inf)
    for n in range(rows.shape[0]):
        put(trace.pose[frames[n]], kit, s.places)
        for m in range(markers):
            if m == own or trace.chosen[frames[n], m] >= 0:
                near[m] = -1.0
                continue
            d = 0.0
            for j in range(3):
                d += (s.places[m, j] - way.at[rows[n], j]) ** 2
            near[m] = min(near[m], math.sqrt(d))
    count = 0
    while count < out.shape[0]:
        best, at = NEAR, -1
        for m in range(markers):
            if 0.0 <= near[m] < best:
                best, at = near[m], m
        if at < 0:
            break
        out[count] = at
        near[at] = -1.0
        count += 1
    return count


@jit
def rename(
    first: int,
    name: int,
    way: Way,
    after: Ints,
    frame: Ints,
    names: Ints,
    trace: Trace,
    changed: Bools,
) -> None:
    """Give all points of a path a name, where no other point has it."""
    row, last = first, -1
    while row >= 0:
        t = frame[row]
        old = names[row]
        free = name < 0 or trace.chosen[t, name] < 0
        if old != name and free and trace.known[t]:
            if old >= 0:
                trace.chosen[t, old] = -1
                trace.fate[t, old] = ABSENT
                trace.sure[t, old] = 0.0
            if name >= 0:
                trace.chosen[t, name] = row
                trace.fate[t, name] = FOLLOWED if last >= 0 else RETURNED
                trace.sure[t, name] = 0.9
            names[row] = name
            changed[t] = True
        last = row
        row = after[row]


@jit
def sample(
    first: int, length: int, after: Ints, frame: Ints, rows: Ints, at: Ints
) -> None:
    """Write some rows of a path, spread over its life, and their frames."""
    count = rows.shape[0]
    row, n = first, 0
    for i in range(length):
        while n < count and i == (n * (length - 1)) // max(count - 1, 1):
            rows[n], at[n] = row, frame[row]
            n += 1
        row = after[row]


def usual_variance(way: Way, trace: Trace, kit: Kit) -> Floats:
    """(M,) [m^2] of the markers' distances in this take, no less than calibrated.

    Four in five distances are shorter; a few ghosts do not matter to that.
    """
    rows = np.flatnonzero(trace.known)
    rows = rows[:: max(len(rows) // 500, 1)]
    away = np.full((len(rows), trace.chosen.shape[1]), np.nan)
    places = np.zeros((trace.chosen.shape[1], 3))
    for n, t in enumerate(rows):
        has = trace.chosen[t] >= 0
        put(trace.pose[t], kit, places)
        away[n, has] = np.sum((way.at[trace.chosen[t, has]] - places[has]) ** 2, axis=1)
    variance = kit.variance.copy()
    for m in np.flatnonzero(np.isfinite(away).any(axis=0)):
        seen = away[np.isfinite(away[:, m]), m]
        variance[m] = max(variance[m], float(np.quantile(seen, 0.8)))
    return variance


@jit
def review(
    first: Ints,
    length: Ints,
    after: Ints,
    back: Ints,
    frame: Ints,
    way: Way,
    s: State,
    kit: Kit,
    trace: Trace,
    names: Ints,
    changed: Bools,
) -> int:
    """Judge every path; rename those that are worth more as something else.

    Parameters
    ----------
    first, length : (N,) paths; after, back, frame : (P,) of the points.
    names : (P,) see `names_of`, kept up to date; changed : (T,) set where renamed.

    Returns
    -------
    How many paths were renamed.
    """
    markers = s.weight.shape[0]
    votes, others = np.zeros(markers + 1, np.int64), np.zeros(RIVALS, np.int64)
    renamed = 0
    for n in range(first.shape[0]):
        votes[:] = 0
        row = first[n]
        while row >= 0:
            votes[names[row]] += 1
            row = after[row]
        own = -1
        for m in range(markers):
            if votes[m] > 0 and (own < 0 or votes[m] > votes[own]):
                own = m
        if own < 0 and length[n] < SHORTEST:
            continue
        count = min(SAMPLES, length[n])
        rows, frames = np.zeros(count, np.int64), np.zeros(count, np.int64)
        sample(first[n], length[n], after, frame, rows, frames)
        found = rivals(rows, frames, own, way, s, kit, trace, others)
        if own < 0 and found == 0:
            continue
        nothing = judge_path(rows, frames, -1, -1, way, s, kit, trace)[0]
        name, best = -1, math.inf
        if own >= 0:
            cost, jumps = judge_path(rows, frames, own, -1, way, s, kit, trace)
            if cost == math.inf:  # the name is another's in some of its frames
                name, best = own, nothing - MARGIN
            elif cost < nothing + MARGIN:
                name, best = own, cost + jumps - MARGIN
        for i in range(found):
            cost, jumps = judge_path(rows, frames, others[i], -1, way, s, kit, trace)
            if cost < nothing - MARGIN and cost + jumps < best:
                name, best = others[i], cost + jumps
        if name < 0 and displace(
            rows, frames, nothing, way, after, back, frame, s, kit, trace, names,
            changed,
        ):  # fmt: skip
            renamed += 1
            continue
        mixed = votes[own] < length[n] if own >= 0 else False
        if name != own or mixed:
            rename(first[n], name, way, after, frame, names, trace, changed)
            renamed += 1
    return renamed


@jit
def displace(
    rows: Ints,
    frames: Ints,
    nothing: float,
    way: Way,
    after: Ints,
    back: Ints,
    frame: Ints,
    s: State,
    kit: Kit,
    trace: Trace,
    names: Ints,
    changed: Bools,
) -> bool:
    """Give a path of no marker another path's name, and that path a hidden marker's.

    Where two fingertips are hidden in turns, the first to come back may have been taken
    for the other; it shows when the other comes back, too.

    Parameters
    ----------
    nothing : what the path is worth as no marker.
    back : (P,) row of the point before on the path.

    Returns
    -------
    Whether that was better, by the margin, and was done.
    """
    markers = s.weight.shape[0]
    best, name, to = nothing - 2.0 * MARGIN, -1, -1
    put(trace.pose[frames[0]], kit, s.places)
    places = s.places.copy()
    for m in range(markers):
        if _apart(places[m], way.at[rows[0]]) > NEAR or kit.branch[m] == 0:
            continue
        held = True
        for n in range(rows.shape[0]):
            held = held and trace.chosen[frames[n], m] >= 0
        if not held:
            continue
        for n in range(markers):
            other = way.at[trace.chosen[frames[0], m]]
            if trace.chosen[frames[0], n] >= 0 or _apart(places[n], other) > NEAR:
                continue
            found = judge_path(rows, frames, m, n, way, s, kit, trace)[0]
            if found < best:
                best, name, to = found, m, n
    if name < 0:
        return False
    first = trace.chosen[frames[0], name]
    while back[first] >= 0 and names[back[first]] == name:
        first = back[first]
    rename(first, to, way, after, frame, names, trace, changed)
    first = rows[0]
    rename(first, name, way, after, frame, names, trace, changed)
    return True


@jit
def _apart(a: Floats, b: Floats) -> float:
    """[m] distance of two places."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@jit
def refit(changed: Bools, way: Way, s: State, kit: Kit, trace: Trace) -> None:
    """Solve the frames whose names changed anew, from the poses they had."""
    for t in range(changed.shape[0]):
        if not changed[t]:
            continue
        square, count = 0.0, 0
        for m in range(s.weight.shape[0]):
            p = trace.chosen[t, m]
            s.weight[m] = 0.0
            if p >= 0:
                s.weight[m] = 1.0
                s.target[m] = way.at[p]
                count += 1
        if count < 4:
            continue
        s.attempt[:] = trace.pose[t]
        resettle(s.attempt, kit.none, s, kit)
        misfit(s.attempt, s.target, s.weight, kit.tree, kit.k)
        for m in range(s.weight.shape[0]):
            if s.weight[m] > 0.0:
                square += distance(kit, m) ** 2
        trace.pose[t] = s.attempt
        trace.cost[t] = worth(s.weight, kit)
        trace.rms[t] = math.sqrt(square / count)
