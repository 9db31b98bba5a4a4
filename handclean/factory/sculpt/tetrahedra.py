"""Marching tetrahedra: a closed manifold where a field on a grid changes its sign.

Every cube of the grid is cut into six tetrahedra round its diagonal, the same way
everywhere, so that neighbours share faces; the field being linear in a tetrahedron, it
is crossed by one or two triangles, which cannot be ambiguous (Doi and Koide, An
efficient method of triangulating equi-valued surfaces by using tetrahedral cells, IEICE
Transactions E74 (1991) 214-224). Their shapes are poor and wait for `remesh`.
"""

from collections.abc import Callable
from itertools import permutations

import numpy as np

from handclean.arrays import Floats, Ints

Field = Callable[[Floats], Floats]

_LEAST_EDGE_SHARE = 0.05
"""[-] share of an edge that a vertex keeps from its ends, so that none coincide
(chosen)."""


def closed_mesh(
    field: Field, low: Floats, high: Floats, cell: float
) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) [m] and faces (F, 3), looking to where the field rises.

    Parameters
    ----------
    field : (N,) of (N, 3) [m] places; positive all over the box's sides.
    low, high : (3,) [m] corners of the box.
    cell : [m] width of the grid's cubes.
    """
    counts = np.ceil((high - low) / cell).astype(np.int64) + 1
    lines = [low[k] + cell * np.arange(counts[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    values = field(grid)
    corners = _tetrahedra(values.reshape(counts))
    ends = _crossed_edges(corners, values[corners] < 0.0)
    flat = ends.reshape(-1, 2)
    edges, number = np.unique(flat, axis=0, return_inverse=True)
    share = values[edges[:, 0]] / (values[edges[:, 0]] - values[edges[:, 1]])
    share = np.clip(share, _LEAST_EDGE_SHARE, 1.0 - _LEAST_EDGE_SHARE)[:, None]
    vertices = (1.0 - share) * grid[edges[:, 0]] + share * grid[edges[:, 1]]
    faces = number.reshape(-1, 3)
    inner = np.where(values[ends[:, :, 0]] < 0.0, ends[:, :, 0], ends[:, :, 1])
    outer = ends.sum(axis=2) - inner
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    out = (grid[outer] - grid[inner]).sum(axis=1)
    turned = (np.cross(b - a, c - a) * out).sum(axis=1) < 0.0
    faces[turned] = faces[turned, ::-1]
    return vertices, faces


def _tetrahedra(values: Floats) -> Ints:
    """(N, 4) grid points of the tetrahedra of all cubes that the surface crosses."""
    step = np.array([values.shape[1] * values.shape[2], values.shape[2], 1])
    inside = values < 0.0
    seen = [
        inside[i : i - 1 or None, j : j - 1 or None, k : k - 1 or None]
        for i in (0, 1)
        for j in (0, 1)
        for k in (0, 1)
    ]
    crossed = np.any(seen, axis=0) & ~np.all(seen, axis=0)
    first = np.argwhere(crossed) @ step
    paths = [np.cumsum([0, *(step[k] for k in way)]) for way in permutations(range(3))]
    return np.vstack([first[:, None] + path for path in paths])


def _crossed_edges(corners: Ints, inside: np.ndarray) -> Ints:
    """(F, 3, 2) the edges on which the triangles have their vertices, smaller first."""
    out = []
    for code in range(1, 15):
        rows = corners[(inside @ (1 << np.arange(4))) == code]
        low = [n for n in range(4) if code >> n & 1]
        high = [n for n in range(4) if not code >> n & 1]
        if len(low) == 2:
            (a, b), (c, d) = low, high
            triangles = [[(a, c), (a, d), (b, d)], [(a, c), (b, d), (b, c)]]
        else:
            triangles = [[(a, b) for a in low for b in high]]
        out += [rows[:, np.array(triangle)] for triangle in triangles]
    return np.sort(np.vstack(out), axis=2)
