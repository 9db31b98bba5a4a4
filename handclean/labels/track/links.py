"""Which point of the next frame is the same: paths of points, knowing no model.

A point is linked to the point of the next frame that is nearest to where it was going,
if neither has another nearly as near. Where the source gives points in columns that
are paths (a tracking system's numbered trajectories), the column is the better witness;
whether it is one is seen from how far points in the same column move.

Links are evidence, not truth: paths cross, and trackers change numbers. The tracker
adds them to the costs of pairs, weighted by how often they have been right in this take
(`learn_link_trust`).
"""

import math

import numpy as np

from handclean.arrays import Floats, Ints, Ints32
from handclean.kernels import jit
from handclean.labels.points import Cloud
from handclean.labels.settings import LabelConfig
from handclean.labels.track.state import (
    FrameSequence,
    FrameState,
    PairCosts,
)

MAX_ACCELERATION_M_S2 = 60.0
"""[m/s^2] no point of a hand is accelerated harder. Chosen."""

MIN_LINK_GATE_M = 1e-3
"""[m] what noise adds to how far a link leads from where a point was going. Chosen."""

CLEAR_DISTANCE_RATIO = 0.4
"""A link is clear if the nearest point is nearer than this share of the distance to
the next one. Chosen."""

COLUMN_GATE_FACTOR = 2.0
"""How much further than a link by nearness one by column may lead. Chosen."""

MAX_POINT_SPEED_M_S, PATH_SHARE = 4.0, 0.98
"""Columns are paths if this share of their steps is slower than this speed. Chosen."""

MAX_LINK_COST = 12.0
"""What a link adds to a cost, or takes off, at most: twice a logarithm. Chosen."""

LINK_COST_OFFSET = 4.0
"""Taken off twice the log odds that links are right, so that links that are right less
often than 88 % count for nothing. Chosen."""

OVERRULING_TRUST = 0.99
"""How often links must be right to overrule a gate. Chosen."""

TRUST_SHARE, MIN_TRUST = 0.01, 1e-3
"""Share of one link in the trust; the trust stays so far from 0 and 1. Chosen."""


@jit
def expected_next(t: int, at: Floats, start: Ints, before: Ints) -> Floats:
    """(P, 3) [m] where the points of a frame would be next if they went on as before.

    Points without a path go on as those with one do on average.
    """
    a, here = start[t], start[t + 1] - start[t]
    going = np.zeros((here, 3))
    mean, count = np.zeros(3), 0
    for i in range(here):
        if before[a + i] >= 0:
            count += 1
            for n in range(3):
                going[i, n] = at[a + i, n] - at[before[a + i], n]
                mean[n] += going[i, n]
    for i in range(here):
        for n in range(3):
            if before[a + i] < 0 and count > 0:
                going[i, n] = mean[n] / count
            going[i, n] += at[a + i, n]
    return going


@jit
def link_nearest(
    at: Floats, start: Ints, most: float, after: Ints, before: Ints
) -> None:
    """Link the points of neighbouring frames that are clearly nearest to each other.

    Parameters
    ----------
    at : (P, 3) [m], start : (T + 1,)
    most : [m] no link leads further from where a point was going.
    after, before : (P,) row of the next, of the last point of the path, or -1. Links
        that are there already are kept; others are added.
    """
    for t in range(start.shape[0] - 2):
        a, b, c = start[t], start[t + 1], start[t + 2]
        here, there = b - a, c - b
        if here == 0 or there == 0:
            continue
        going = expected_next(t, at, start, before)
        nearest = np.full(here, -1)
        first, second = np.full(here, 1e30), np.full(here, 1e30)
        back = np.full(there, -1)
        back_first, back_second = np.full(there, 1e30), np.full(there, 1e30)
        for i in range(here):
            for j in range(there):
                d = 0.0
                for n in range(3):
                    d += (at[b + j, n] - going[i, n]) ** 2
                if d < first[i]:
                    second[i], first[i], nearest[i] = first[i], d, j
                elif d < second[i]:
                    second[i] = d
                if d < back_first[j]:
                    back_second[j], back_first[j], back[j] = back_first[j], d, i
                elif d < back_second[j]:
                    back_second[j] = d
        for i in range(here):
            j = nearest[i]
            if after[a + i] >= 0 or before[b + j] >= 0 or back[j] != i:
                continue
            clear = (
                CLEAR_DISTANCE_RATIO
                * CLEAR_DISTANCE_RATIO
                * min(second[i], back_second[j])
            )
            if first[i] < most * most and first[i] < clear:
                after[a + i] = b + j
                before[b + j] = a + i


@jit
def link_columns(start: Ints, column: Ints32, after: Ints, before: Ints) -> None:
    """Link points of neighbouring frames that are in the same column; in place."""
    for t in range(start.shape[0] - 2):
        for i in range(start[t], start[t + 1]):
            if column[i] < 0:
                continue
            for j in range(start[t + 1], start[t + 2]):
                if column[j] == column[i]:
                    after[i], before[j] = j, i
                    break


def path_links(cloud: Cloud, settings: LabelConfig, rate: float) -> tuple[Ints, Ints]:
    """Link the points of a take to paths.

    Parameters
    ----------
    rate : [Hz] of the take.

    Returns
    -------
    (P,) row of the next, and of the last, point of each point's path, -1 none.
    """
    most = MIN_LINK_GATE_M + MAX_ACCELERATION_M_S2 / rate**2
    after, before = np.full(len(cloud.at), -1), np.full(len(cloud.at), -1)
    if settings.columns != "ignore":
        link_columns(cloud.start, cloud.column, after, before)
        if settings.columns == "auto" and not _columns_are_paths(cloud, after, rate):
            after[:], before[:] = -1, -1
        else:
            _drop_jumps(cloud, after, before, COLUMN_GATE_FACTOR * most)
    link_nearest(cloud.at, cloud.start, most, after, before)
    return after, before


def _columns_are_paths(cloud: Cloud, after: Ints, rate: float) -> bool:
    """Whether points in one column move like one point, nearly always."""
    rows = np.flatnonzero(after >= 0)
    if len(rows) == 0:
        return False
    steps = np.linalg.norm(cloud.at[after[rows]] - cloud.at[rows], axis=1)
    return bool(np.mean(steps < MAX_POINT_SPEED_M_S / rate) > PATH_SHARE)


def _drop_jumps(cloud: Cloud, after: Ints, before: Ints, most: float) -> None:
    """Drop links that lead further from where a point was going, in place."""
    rows = np.flatnonzero((after >= 0) & (before >= 0))
    bends = cloud.at[after[rows]] - 2.0 * cloud.at[rows] + cloud.at[before[rows]]
    far = rows[np.linalg.norm(bends, axis=1) > most]
    before[after[far]] = -1
    after[far] = -1


@jit
def add_link_costs(
    previous: Ints, pairs: PairCosts, state: FrameState, unseen: Ints
) -> None:
    """Change the costs of pairs, in place, by what the links of the points say.

    A marker is likelier to be the next point of its own path than the pose foretells,
    and unlikely to be the next point of another's; by how much grows with how often
    links have been right.

    Parameters
    ----------
    previous : (P,) row in the take of the point before on each point's path, -1 none.
    pairs : cost (M, P) of each pair, overwritten; cost (M,) of no point.
    state : which row each marker had in the frame before, and the trust in links.
    unseen : (M,) frames out of sight.
    """
    trust = state.progress.link_trust
    weight = 2.0 * math.log(trust / (1.0 - trust)) - LINK_COST_OFFSET
    weight = min(weight, MAX_LINK_COST)
    if weight <= 0.0:
        return
    cost, last_row = pairs.pair, state.last_row
    for p in range(previous.shape[0]):
        row = previous[p]
        if row < 0:
            continue
        owner = -1
        for m in range(last_row.shape[0]):
            if last_row[m] == row:
                owner = m
        for m in range(last_row.shape[0]):
            if m == owner:
                if trust > OVERRULING_TRUST:
                    certain = pairs.no_point[m] - 0.5 * MAX_LINK_COST
                    cost[m, p] = min(cost[m, p], certain)
                cost[m, p] -= weight
            elif owner >= 0 or unseen[m] == 0:
                cost[m, p] += weight


@jit
def learn_link_trust(t: int, sequence: FrameSequence, state: FrameState) -> None:
    """Count which links of the markers tracked so far were right, and go on a frame.

    Updates the trust in links, and which row each marker had in this frame.
    """
    begin, trust = sequence.start[t], state.progress.link_trust
    last_row = state.last_row
    for p in range(sequence.start[t + 1] - begin):
        row = sequence.previous[begin + p]
        if row < 0:
            continue
        for m in range(last_row.shape[0]):
            if last_row[m] == row:
                right = 1.0 if state.weight[m] > 0.0 and state.chosen[m] == p else 0.0
                trust += TRUST_SHARE * (right - trust)
    state.progress.link_trust = min(max(trust, MIN_TRUST), 1.0 - MIN_TRUST)
    for m in range(last_row.shape[0]):
        last_row[m] = begin + state.chosen[m] if state.weight[m] > 0.0 else -1
