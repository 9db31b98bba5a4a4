"""The nearest of many points, exactly, by a k-d tree without pointers.

Points are listed so that every range of them falls into two halves along an axis: none
of the first half lies above the cut, none of the second below. A range of few points is
searched through.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit

UNSPLIT_POINTS = 8
"""A range of at most so many points is not split (chosen for speed alone: any number
finds the same distance)."""

MOST_WAITING_RANGES = 64
"""Ranges that wait in a search, at most; every halving adds one, so 2^64 points fit."""


class PointTree(NamedTuple):
    """N points sorted so that every range falls into halves."""

    points: Floats
    """(N, 3) [m] in the tree's order."""
    axis: Ints
    """(N,) at the middle of a range: the axis along which it is halved."""
    cut: Floats
    """(N,) [m] at the middle of a range: where along that axis."""


class Waiting(NamedTuple):
    """Work space of a search: ranges that are still to be looked at."""

    ranges: Ints
    """(64, 2) first and last row."""
    beyond: Floats
    """(64,) [m^2] squared distance of each from the point, or less."""


@jit
def make_waiting() -> Waiting:
    """Return work space for `nearest_point`."""
    return Waiting(
        np.zeros((MOST_WAITING_RANGES, 2), dtype=np.int64),
        np.zeros(MOST_WAITING_RANGES),
    )


@jit
def nearest_point(
    x: float, y: float, z: float, start: int, tree: PointTree, waiting: Waiting
) -> int:
    """Return the nearest point's row in the tree's order; of equals any.

    Parameters
    ----------
    x, y, z : [m] what the point should be near to.
    start : a row that is probably near.
    tree : the points.
    waiting : work space.
    """
    points, axis, cut = tree.points, tree.axis, tree.cut
    stack, beyond = waiting.ranges, waiting.beyond
    best = start
    least = (points[start, 0] - x) ** 2
    least += (points[start, 1] - y) ** 2 + (points[start, 2] - z) ** 2
    stack[0, 0], stack[0, 1], beyond[0], height = 0, points.shape[0], 0.0, 1
    while height > 0:
        height -= 1
        first, last = stack[height, 0], stack[height, 1]
        if beyond[height] >= least:
            continue
        while last - first > UNSPLIT_POINTS:
            middle = (first + last) // 2
            which = axis[middle]
            here = x if which == 0 else (y if which == 1 else z)
            gap = here - cut[middle]
            beyond[height] = gap * gap
            if gap < 0.0:
                stack[height, 0], stack[height, 1] = middle, last
                last = middle
            else:
                stack[height, 0], stack[height, 1] = first, middle
                first = middle
            height += 1
        for n in range(first, last):
            square = (points[n, 0] - x) ** 2
            square += (points[n, 1] - y) ** 2 + (points[n, 2] - z) ** 2
            if square < least:
                best, least = n, square
    return best
