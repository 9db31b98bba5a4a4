"""Fillers that know no posture: what others do, to be compared with.

Linear and cubic fill, splines, pattern fill (a neighbour's movement, led onto the ends)
and rigid fill (three others of the same bone) are what Vicon Nexus and Qualisys offer.
"""

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.gaps.filler import Refused, Scene
from handclean.gaps.min_acceleration import EndFit, bridge, nearest
from handclean.gaps.runs import Cluster, Gap
from handclean.numerics.procrustes import align

MIN_SPREAD_M = 2e-3
"""[m] donors of a rigid fill should reach this far from their common line (chosen)."""


def linear(scene: Scene, gap: Gap) -> Floats:
    """Fill along a straight line at constant speed."""
    first, last = _ends(scene.positions, gap)
    share = _shares(gap)
    return (1.0 - share) * first + share * last


def cubic(scene: Scene, gap: Gap) -> Floats:
    """Fill with the path of least acceleration of the marker itself."""
    seed = scene.limits.seed
    found = bridge(
        scene.positions[:, gap.column],
        scene.seen[:, gap.column],
        Cluster(gaps=(gap,)),
        EndFit(order=2, frames=seed),
        2 * seed,
    )
    return found[0].path


def spline(scene: Scene, gap: Gap) -> Floats:
    """Fill with the cubic spline through the nearest measured samples."""
    known, seed = scene.seen[:, gap.column], scene.limits.seed
    before = nearest(known, gap.start - 1, -1, 2 * seed, 2 * seed)
    after = nearest(known, gap.stop, 1, 2 * seed, 2 * seed)
    frames = np.concatenate([before[::-1], after])
    from scipy.interpolate import CubicSpline  # 0.2 s, which few takes need

    path = CubicSpline(frames, scene.positions[frames, gap.column])
    return np.asarray(path(np.arange(gap.start, gap.stop)))


def pattern(scene: Scene, gap: Gap) -> Floats:
    """Fill with the movement of the nearest marker, one of the same bone if any.

    Raises
    ------
    Refused
        If no other marker is in sight through all of the gap.
    """
    donors = _donors(scene, gap)
    if len(donors) == 0:
        raise Refused("no other marker is seen throughout")
    ends = [gap.start - 1, gap.stop]
    there = scene.positions[ends]
    away = np.linalg.norm(there - there[:, [gap.column]], axis=2).mean(axis=0)[donors]
    bones = scene.model.bone
    far = bones[donors] != bones[gap.column]
    donor = int(donors[np.lexsort([away, far])[0]])
    offset = there[:, gap.column] - there[:, donor]
    share = _shares(gap)
    path = scene.positions[gap.start : gap.stop, donor]
    return np.asarray(path + (1.0 - share) * offset[0] + share * offset[1])


def rigid(scene: Scene, gap: Gap) -> Floats:
    """Fill with the rigid movement of three or more markers of the same bone.

    Raises
    ------
    Refused
        If fewer than three, or only some on one line, are in sight through all of it.
    """
    bones = scene.model.bone
    donors = _donors(scene, gap)
    donors = donors[bones[donors] == bones[gap.column]]
    if len(donors) < 3:
        raise Refused("fewer than three other markers of its bone are seen throughout")
    ends = [gap.start - 1, gap.stop]
    body = scene.positions[ends[0], donors]
    if np.linalg.svd(body - body.mean(axis=0), compute_uv=False)[1] < MIN_SPREAD_M:
        raise Refused("the other markers of its bone lie on one line")
    paths = []
    for end in ends:
        source, marker = scene.positions[end, donors], scene.positions[end, gap.column]
        moves = [
            align(source, scene.positions[t, donors])
            for t in range(gap.start, gap.stop)
        ]
        paths.append(np.array([move.apply(marker) for move in moves]))
    share = _shares(gap)
    return np.asarray((1.0 - share) * paths[0] + share * paths[1])


def _ends(positions: Floats, gap: Gap) -> tuple[Floats, Floats]:
    column = positions[:, gap.column]
    return column[gap.start - 1], column[gap.stop]


def _shares(gap: Gap) -> Floats:
    """(N, 1) 0 at the last known frame before a gap, 1 at the first after it."""
    return np.asarray(np.arange(1, gap.frames + 1)[:, None] / (gap.frames + 1.0))


def _donors(scene: Scene, gap: Gap) -> Ints:
    through: Bools = scene.seen_through(gap)
    through[gap.column] = False
    return np.flatnonzero(through)
