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
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
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
from handclean.labels.points import Cloud

SAMPLES = 6
"""Frames of a path that are looked at."""

SHORTEST = 3
"""Frames that a path of no marker must last to be given a name."""

MARGIN = 2.0
"""By how much, in `worth`, another name must be better."""

WELL = 6.0
"""A name fits well if the path is worth so much more with it than without."""

JUMP = 4.0
"""What it costs at most that a finger jumped."""

NEAR, TOUCHING = 0.08, 0.035
"""[m] how far a hidden marker may be from a path that could be its; the same where the
path fits another name well, and between markers that may have changed places."""

RIVALS = 3
"""How many hidden markers a path is tried as."""


class Paths(NamedTuple):
    """N paths through P points.

    first, length (N,) row of the first point, how many points; after, before (P,) row
    of the next, the last point, -1 none; frame (P,); name (P,) marker, -1 none;
    changed (T,) frames in which points got another name.
    """

    first: Ints
    length: Ints
    after: Ints
    before: Ints
    frame: Ints
    name: Ints
    changed: Bools


class Glance(NamedTuple):
    """Some points of a path, spread over its life: rows and frames, both (n,)."""

    rows: Ints
    frames: Ints


def paths_of(cloud: Cloud, after: Ints, before: Ints, trace: Trace) -> Paths:
    """Collect the paths, and the names that a trace gives their points."""
    first = np.flatnonzero(before < 0)
    length = np.zeros(len(first), dtype=np.int64)
    _measure(first, after, length)
    name = np.full(len(after), -1)
    frames, markers = np.nonzero(trace.chosen >= 0)
    name[trace.chosen[frames, markers]] = markers
    return Paths(
        first=first,
        length=length,
        after=after,
        before=before,
        frame=cloud.frame.astype(np.int64),
        name=name,
        changed=np.zeros(cloud.frames, dtype=bool),
    )


@jit
def _measure(first: Ints, after: Ints, length: Ints) -> None:
    """Write how many points each path has."""
    for n in range(first.shape[0]):
        row, count = first[n], 0
        while row >= 0:
            row = after[row]
            count += 1
        length[n] = count


@jit
def glance(n: int, paths: Paths) -> Glance:
    """Return some points of path n."""
    length = paths.length[n]
    count = min(SAMPLES, length)
    rows, frames = np.zeros(count, np.int64), np.zeros(count, np.int64)
    row, k = paths.first[n], 0
    for i in range(length):
        while k < count and i == (k * (length - 1)) // max(count - 1, 1):
            rows[k], frames[k] = row, paths.frame[row]
            k += 1
        row = paths.after[row]
    return Glance(rows, frames)


@jit
def own_name(n: int, paths: Paths, markers: int) -> tuple[int, int]:
    """Return the name that most points of a path have, -1 none; and how many do."""
    votes = np.zeros(markers, np.int64)
    row = paths.first[n]
    while row >= 0:
        if paths.name[row] >= 0:
            votes[paths.name[row]] += 1
        row = paths.after[row]
    best = int(np.argmax(votes))
    return (best, votes[best]) if votes[best] > 0 else (-1, 0)


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
    row : the point; name : marker it shall be, -1 none.
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
    seen: Glance,
    name: int,
    other: int,
    bent: bool,
    enough: float,
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
        if name >= 0 and n == 0:
            jumps += jump(t, -1, name, s, kit, trace)
        if name >= 0 and n == size - 1:
            jumps += jump(t, 1, name, s, kit, trace)
        total += found
        count += 1
        if total > size * enough:
            return math.inf, 0.0
    return (total / count, jumps) if count > 0 else (math.inf, 0.0)


@jit
def rivals(
    seen: Glance, own: int, well: bool, way: Way, s: State, kit: Kit, trace: Trace
) -> Ints:
    """Return the hidden markers nearest to a path, the nearest first.

    Parameters
    ----------
    own, well : the path's name, -1 none, and whether it fits well. Then only markers
        on other fingers, as far out and very near, are rivals.
    """
    markers = s.weight.shape[0]
    near = np.full(markers, math.inf)
    for n in range(seen.rows.shape[0]):
        put(trace.pose[seen.frames[n]], kit, s.places)
        for m in range(markers):
            if m == own or trace.chosen[seen.frames[n], m] >= 0:
                near[m] = -1.0
            near[m] = min(near[m], _apart(s.places[m], way.at[seen.rows[n]]))
    if well:
        for m in range(markers):
            if kit.branch[m] == kit.branch[own] or kit.rank[m] != kit.rank[own]:
                near[m] = -1.0
    found = np.zeros(RIVALS, np.int64)
    count = 0
    while count < RIVALS:
        best, at = TOUCHING if well else NEAR, -1
        for m in range(markers):
            if 0.0 <= near[m] < best:
                best, at = near[m], m
        if at < 0:
            break
        found[count] = at
        near[at] = -1.0
        count += 1
    return found[:count]


@jit
def _apart(a: Floats, b: Floats) -> float:
    """[m] distance of two places."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@jit
def rename(first: int, name: int, paths: Paths, trace: Trace) -> None:
    """Give all points of a path a name, where no other point has it."""
    row, last = first, -1
    while row >= 0:
        t = paths.frame[row]
        old = paths.name[row]
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
            paths.name[row] = name
            paths.changed[t] = True
        last = row
        row = paths.after[row]


@jit
def review_path(
    n: int, paths: Paths, way: Way, s: State, kit: Kit, trace: Trace
) -> bool:
    """Judge one path; rename it if it is worth more as something else.

    Returns
    -------
    Whether it was renamed.
    """
    own, votes = own_name(n, paths, s.weight.shape[0])
    if own < 0 and paths.length[n] < SHORTEST:
        return False
    seen = glance(n, paths)
    nothing = judge_path(seen, -1, -1, False, 1e6, way, s, kit, trace)[0]
    name, best, well = -1, math.inf, False
    if own >= 0:
        cost, jumps = judge_path(seen, own, -1, False, 1e6, way, s, kit, trace)
        if cost == math.inf:  # the name is another's in some of its frames
            return False
        well = cost < nothing - WELL
        if cost < nothing + MARGIN:
            name, best = own, cost + jumps - MARGIN
    others = rivals(seen, own, well, way, s, kit, trace)
    if own >= 0 and others.shape[0] > 0:  # as much trouble for it as for its rivals
        cost, jumps = judge_path(seen, own, -1, True, 1e6, way, s, kit, trace)
        best = min(best, cost + jumps - MARGIN)
    for m in others:
        enough = min(nothing - MARGIN, best)
        cost, jumps = judge_path(seen, m, -1, True, enough, way, s, kit, trace)
        if cost < enough and cost + jumps < best:
            name, best = m, cost + jumps
    if name < 0 and displace(seen, nothing, paths, way, s, kit, trace):
        return True
    if name >= 0 and name == own:
        if change_places(seen, own, paths, way, s, kit, trace):
            return True
        if votes == paths.length[n]:
            return False
    elif name == own:
        return False
    rename(paths.first[n], name, paths, trace)
    return True


@jit
def review(paths: Paths, way: Way, s: State, kit: Kit, trace: Trace) -> int:
    """Judge every path, see `review_path`; return how many were renamed."""
    renamed = 0
    for n in range(paths.first.shape[0]):
        if review_path(n, paths, way, s, kit, trace):
            renamed += 1
    return renamed


@jit
def displace(
    seen: Glance,
    nothing: float,
    paths: Paths,
    way: Way,
    s: State,
    kit: Kit,
    trace: Trace,
) -> bool:
    """Give a path of no marker another path's name, and that path a hidden marker's.

    Where two fingertips are hidden in turns, the first to come back may have been taken
    for the other; it shows when the other comes back, too.

    Parameters
    ----------
    nothing : what the path is worth as no marker.

    Returns
    -------
    Whether that was better, by the margin, and was done.
    """
    markers, t = s.weight.shape[0], seen.frames[0]
    best, name, to = nothing - 2.0 * MARGIN, -1, -1
    put(trace.pose[t], kit, s.places)
    places = s.places.copy()
    for m in range(markers):
        if _apart(places[m], way.at[seen.rows[0]]) > NEAR or kit.branch[m] == 0:
            continue
        held = True
        for frame in seen.frames:
            held = held and trace.chosen[frame, m] >= 0
        if not held:
            continue
        there = way.at[trace.chosen[t, m]]
        for n in range(markers):
            if trace.chosen[t, n] >= 0 or _apart(places[n], there) > NEAR:
                continue
            found = judge_path(seen, m, n, True, best, way, s, kit, trace)[0]
            if found < best:
                best, name, to = found, m, n
    if name < 0:
        return False
    rename(begin(trace.chosen[t, name], paths), to, paths, trace)
    rename(seen.rows[0], name, paths, trace)
    return True


@jit
def begin(row: int, paths: Paths) -> int:
    """Return the first point of the part of a path that has the same name."""
    name = paths.name[row]
    while paths.before[row] >= 0 and paths.name[paths.before[row]] == name:
        row = paths.before[row]
    return row


@jit
def change_places(
    seen: Glance,
    own: int,
    paths: Paths,
    way: Way,
    s: State,
    kit: Kit,
    trace: Trace,
) -> bool:
    """Let a path and one on another finger, as far out, change names if that is better.

    Only the frames in which both are seen can tell.

    Returns
    -------
    Whether that was better, by the margin, and was done.
    """
    best, name, there = 0.5 * MARGIN, -1, -1
    for m in range(own + 1, s.weight.shape[0]):
        if kit.branch[m] == kit.branch[own] or kit.rank[m] != kit.rank[own]:
            continue
        if kit.branch[m] == 0 or kit.branch[own] == 0:
            continue
        gain, count, row = 0.0, 0, -1
        for n in range(seen.rows.shape[0]):
            t, p = seen.frames[n], seen.rows[n]
            row = trace.chosen[t, m]
            if row < 0 or trace.chosen[t, own] != p or not trace.known[t]:
                continue
            if _apart(way.at[row], way.at[p]) > TOUCHING:
                continue
            now = suppose(t, p, own, m, True, way, s, kit, trace)
            gain += now - suppose(t, p, m, own, True, way, s, kit, trace)
            count += 1
            if gain < -4.0 * MARGIN:
                break
            last = row
        if count > 0 and gain / count > best:
            best, name, there = gain / count, m, last
    if name < 0:
        return False
    other = begin(there, paths)
    rename(seen.rows[0], -1, paths, trace)
    rename(other, own, paths, trace)
    rename(seen.rows[0], name, paths, trace)
    return True


@jit
def refit(paths: Paths, way: Way, s: State, kit: Kit, trace: Trace) -> None:
    """Solve the frames whose names changed anew, from the poses they had."""
    for t in range(paths.changed.shape[0]):
        if not paths.changed[t]:
            continue
        paths.changed[t] = False
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
        for m in range(s.weight.shape[0]):
            if s.weight[m] > 0.0:
                square += distance(kit, m) ** 2
        trace.pose[t] = s.attempt
        trace.cost[t] = worth(s.weight, kit)
        trace.rms[t] = math.sqrt(square / count)


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
