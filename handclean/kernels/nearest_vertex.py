"""The nearest of many points, exactly, by a k-d tree without pointers.

Points are listed so that every range of them falls into two halves along an axis: none
of the first half lies above the cut, none of the second below. A range of few points is
searched through.
"""

from handclean.arrays import Floats, Ints
from handclean.kernels import jit

FEW = 8
"""A range of at most so many points is not split."""


@jit
def nearest_point(
    x: float,
    y: float,
    z: float,
    start: int,
    points: Floats,
    axis: Ints,
    cut: Floats,
    stack: Ints,
    beyond: Floats,
) -> int:
    """Return the nearest point's row in the tree's order; of equals any.

    Parameters
    ----------
    start : a row that is probably near.
    points : (N, 3) in the tree's order; axis, cut : (N,) at
        the middle of a range: along what and where it falls into halves.
    stack : (64, 2); beyond : (64,) work space.
    """
    best = start
    least = (points[start, 0] - x) ** 2
    least += (points[start, 1] - y) ** 2 + (points[start, 2] - z) ** 2
    stack[0, 0], stack[0, 1], beyond[0], height = 0, points.shape[0], 0.0, 1
    while height > 0:
        height -= 1
        first, last = stack[height, 0], stack[height, 1]
        if beyond[height] >= least:
            continue
        while last - first > FEW:
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
