"""A tree of boxes around triangles, for searches that look at few of them.

The tree is complete and binary: node 1 is the root, 2 n and 2 n + 1 are the children
of n, and the L leaves, L a power of two, are the nodes L to 2 L - 1. Leaf l holds the
triangles ``starts[l]`` to ``starts[l + 1]``, in the tree's own order of triangles. Its
shape depends on the numbers alone; when the vertices move, the boxes are refitted.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit

BOX_MARGIN_M = 1e-9
"""[m] boxes are this much too large on every side, more than rounding errors
(chosen)."""


class Boxes(NamedTuple):
    """A tree of boxes for the vertices as they are."""

    starts: Ints
    """(L + 1,) first triangle of each leaf, and F."""
    corners: Floats
    """(F, 3, 3) [m] the triangles' corners, in the tree's order."""
    ends: Floats
    """(2 L, 6) [m] lower and upper ends of each node's box; row 0 is not used."""


@jit
def make_boxes(faces: Ints, starts: Ints) -> Boxes:
    """Return a tree for `refit`.

    Parameters
    ----------
    faces : (F, 3) in the tree's order.
    starts : (L + 1,) first triangle of each leaf, and F.
    """
    corners = np.zeros((faces.shape[0], 3, 3))
    return Boxes(starts, corners, np.zeros((2 * (starts.shape[0] - 1), 6)))


@jit
def refit(vertices: Floats, faces: Ints, tree: Boxes) -> None:
    """Write the triangles and the boxes around them.

    Parameters
    ----------
    vertices : (V, 3) [m]
    faces : (F, 3) in the tree's order.
    tree : its corners and ends are overwritten.
    """
    starts, corners, boxes = tree.starts, tree.corners, tree.ends
    leaves = starts.shape[0] - 1
    for leaf in range(leaves):
        box = boxes[leaves + leaf]
        for n in range(3):
            box[n], box[3 + n] = 1e300, -1e300
        for f in range(starts[leaf], starts[leaf + 1]):
            for k in range(3):
                v = faces[f, k]
                for n in range(3):
                    x = vertices[v, n]
                    corners[f, k, n] = x
                    box[n] = min(box[n], x - BOX_MARGIN_M)
                    box[3 + n] = max(box[3 + n], x + BOX_MARGIN_M)
    for node in range(leaves - 1, 0, -1):
        for n in range(3):
            boxes[node, n] = min(boxes[2 * node, n], boxes[2 * node + 1, n])
            boxes[node, 3 + n] = max(boxes[2 * node, 3 + n], boxes[2 * node + 1, 3 + n])
