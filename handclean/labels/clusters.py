"""Euclidean clusters of points: whatever is linked by steps no longer than a radius.

This is the partition of Rusu (2009) that Maycock 2015 section III-A and Schroeder 2017
take from the Point Cloud Library. One radius suits one scene; several, from tight to
everything, suit any, since each cluster is tried anyway.
"""

import numpy as np

from handclean.arrays import Floats, Ints

RADIUS_FACTORS = (1.0, 1.4, 2.0, 4.0)
"""Radii at which clusters are looked for, per the smallest. Chosen: from one hand alone
to a hand that holds something."""


def cluster(points: Floats, radius_m: float) -> Ints:
    """(P,) number of the cluster of each point, from 0, in the order of first points.

    Parameters
    ----------
    points : (P, 3) [m]
    radius_m : [m] longest step between neighbours in one cluster.
    """
    number = np.full(len(points), -1)
    near = np.linalg.norm(points[:, None] - points[None], axis=2) <= radius_m
    found = 0
    for first in range(len(points)):
        if number[first] >= 0:
            continue
        front = [first]
        number[first] = found
        while front:
            here = front.pop()
            fresh = np.flatnonzero(near[here] & (number < 0))
            number[fresh] = found
            front.extend(fresh.tolist())
        found += 1
    return number


def longest_step(points: Floats) -> float:
    """[m] the smallest radius at which all points are one cluster (Prim's tree)."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    reach = distance[0].copy()
    inside = np.zeros(len(points), dtype=bool)
    inside[0] = True
    longest = 0.0
    for _ in range(len(points) - 1):
        reach[inside] = np.inf
        nearest = int(np.argmin(reach))
        longest = max(longest, float(reach[nearest]))
        inside[nearest] = True
        reach = np.minimum(reach, distance[nearest])
    return longest


def cluster_candidates(points: Floats, radius_m: float, least: int) -> list[Ints]:
    """Rows of every cluster of at least ``least`` points, at several radii.

    All points together come last, whether they are linked or not. No cluster is given
    twice.

    Parameters
    ----------
    points : (P, 3) [m]
    radius_m : [m] the smallest radius; `RADIUS_FACTORS` times it are tried, too.
    """
    groups: list[Ints] = []
    for factor in RADIUS_FACTORS:
        number = cluster(points, factor * radius_m)
        groups += [
            np.flatnonzero(number == n) for n in range(number.max(initial=-1) + 1)
        ]
    groups.append(np.arange(len(points)))
    kept: dict[bytes, Ints] = {}
    for rows in groups:
        if len(rows) >= least:
            kept.setdefault(rows.tobytes(), rows)
    return list(kept.values())
