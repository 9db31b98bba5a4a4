"""The point of a triangle mesh that is closest to a point, exactly.

Of one triangle it is found after Ericson, Real-time collision detection (2005), 5.1.5:
by the region of the triangle's plane (corner, edge, inside) that the point lies over.
Of many it is found by going down a tree of boxes, the nearer box first, and leaving out
boxes that are farther away than the best triangle so far.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.boxes import Boxes


class Feet(NamedTuple):
    """The points of a mesh that are closest to P points."""

    face: Ints
    """(P,) the triangle each lies on, in the tree's order."""
    share: Floats
    """(P, 3) barycentric coordinates in it."""
    square: Floats
    """(P,) [m^2] squared distances."""


_MOST_WAITING_NODES = 64
"""Nodes that wait in a search, at most; every level of the tree adds one (chosen)."""


@jit
def closest_on_triangle(p: Floats, triangle: Floats, share: Floats) -> float:
    """Write the barycentric coordinates of a triangle's point that is closest to p.

    Of a triangle without area it is the closest point of one of its sides.

    Parameters
    ----------
    p : (3,) [m]; triangle : (3, 3) [m] its corners a, b, c.
    share : (3,) overwritten in full.

    Returns
    -------
    float : [m^2] squared distance.
    """
    a, b, c = triangle[0], triangle[1], triangle[2]
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for n in range(3):
        ab, ac = b[n] - a[n], c[n] - a[n]
        d1 += ab * (p[n] - a[n])
        d2 += ac * (p[n] - a[n])
        d3 += ab * (p[n] - b[n])
        d4 += ac * (p[n] - b[n])
        d5 += ab * (p[n] - c[n])
        d6 += ac * (p[n] - c[n])
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w = (d1 / (d1 - d3) if d1 > d3 else 0.0), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w = 0.0, (d2 / (d2 - d6) if d2 > d6 else 0.0)
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        along = (d4 - d3) + (d5 - d6)
        w = (d4 - d3) / along if along > 0.0 else 0.0
        v = 1.0 - w
    else:
        total = va + vb + vc
        v, w = vb / total, vc / total
    share[0], share[1], share[2] = 1.0 - v - w, v, w
    square = 0.0
    for n in range(3):
        away = p[n] - (share[0] * a[n] + share[1] * b[n] + share[2] * c[n])
        square += away * away
    return square


@jit
def box_square(p: Floats, box: Floats) -> float:
    """[m^2] Squared distance of a point from a box, 0 inside.

    Parameters
    ----------
    p : (3,) [m]; box : (6,) [m] lower and upper ends.
    """
    square = 0.0
    for n in range(3):
        away = max(box[n] - p[n], max(p[n] - box[3 + n], 0.0))
        square += away * away
    return square


@jit
def closest_on_mesh(points: Floats, tree: Boxes) -> Feet:
    """Return the point of a mesh that is closest to each point.

    Parameters
    ----------
    points : (P, 3) [m]
    tree : the triangles.
    """
    starts, corners, boxes = tree.starts, tree.corners, tree.ends
    count = points.shape[0]
    face, square = np.zeros(count, dtype=np.int64), np.zeros(count)
    shares, share = np.zeros((count, 3)), np.zeros(3)
    stack = np.zeros(_MOST_WAITING_NODES, dtype=np.int64)
    leaves = starts.shape[0] - 1
    for i in range(points.shape[0]):
        p = points[i]
        face[i], square[i] = 0, 0.0
        shares[i, 0], shares[i, 1], shares[i, 2] = 1.0, 0.0, 0.0
        for n in range(3):
            square[i] += (p[n] - corners[0, 0, n]) ** 2
        stack[0], height = 1, 1
        while height > 0:
            height -= 1
            node = stack[height]
            if box_square(p, boxes[node]) >= square[i]:
                continue
            if node < leaves:
                one = box_square(p, boxes[2 * node])
                two = box_square(p, boxes[2 * node + 1])
                nearer = 0 if one <= two else 1
                stack[height] = 2 * node + 1 - nearer
                stack[height + 1] = 2 * node + nearer
                height += 2
                continue
            for f in range(starts[node - leaves], starts[node - leaves + 1]):
                away = closest_on_triangle(p, corners[f], share)
                if away < square[i]:
                    square[i], face[i] = away, f
                    for n in range(3):
                        shares[i, n] = share[n]
    return Feet(face, shares, square)
