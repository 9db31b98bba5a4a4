"""Which point of the next frame is the same: paths of points, knowing no model.

A point is linked to the point of the next frame that is nearest to where it was going,
if neither has another nearly as near. Where the source gives points in columns that
are paths (a tracking system's numbered trajectories), the column is the better witness;
whether it is one is seen from how far points in the same column move.

Links are evidence, not truth: paths cross, and trackers change numbers. The tracker
weighs them by how often they have been right in this take.
"""

import numpy as np

from handclean.arrays import Floats, Ints, Ints32
from handclean.kernels import jit
from handclean.labels.points import Cloud
from handclean.labels.settings import LabelConfig

HARDEST = 60.0
"""[m/s^2] no point of a hand is accelerated harder."""

CLEAR = 0.4
"""A link is clear if the next best is further away by this factor."""


@jit
def link_near(at: Floats, start: Ints, most: float, after: Ints, before: Ints) -> None:
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
            clear = CLEAR * CLEAR * min(second[i], back_second[j])
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
    """(P,) row of the next and of the last point of each point's path, -1 none."""
    most = 1e-3 + HARDEST / rate**2
    after, before = np.full(len(cloud.at), -1), np.full(len(cloud.at), -1)
    if settings.columns != "ignore":
        link_columns(cloud.start, cloud.column, after, before)
        if settings.columns == "auto" and not _are_paths(cloud, after, rate):
            after[:], before[:] = -1, -1
        else:
            _cut(cloud, after, before, 2.0 * most)
    link_near(cloud.at, cloud.start, most, after, before)
    return after, before


def _are_paths(cloud: Cloud, after: Ints, rate: float) -> bool:
    """Whether points in one column move like one point, nearly always."""
    rows = np.flatnonzero(after >= 0)
    if len(rows) == 0:
        return False
    steps = np.linalg.norm(cloud.at[after[rows]] - cloud.at[rows], axis=1)
    return bool(np.mean(steps < 4.0 / rate) > 0.98)


def _cut(cloud: Cloud, after: Ints, before: Ints, most: float) -> None:
    """Drop links that lead further from where a point was going, in place."""
    rows = np.flatnonzero((after >= 0) & (before >= 0))
    bends = cloud.at[after[rows]] - 2.0 * cloud.at[rows] + cloud.at[before[rows]]
    far = rows[np.linalg.norm(bends, axis=1) > most]
    before[after[far]] = -1
    after[far] = -1
