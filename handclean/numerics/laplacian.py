"""The Laplacian of a triangle mesh, and systems with its square.

At vertex v with the area A_v and the neighbours j,

    (Delta x)_v = 1 / A_v  sum_j w_vj (x_v - x_j),
    w_vj = (cot a_vj + cot b_vj) / 2,

a and b being the angles opposite to the edge (Pinkall and Polthier 1993), and A_v a
third of the area of the triangles around v. It is 1/length: twice the mean curvature
along the outward normal. Of a linear function on a flat mesh it is 0 inside.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix, diags
from scipy.sparse.linalg import SuperLU, splu

from handclean.arrays import Floats, Ints, expect_shape

LEAF_UNKNOWNS = 64
"""Unknowns from which on a part of a mesh is not dissected further (chosen for speed
alone)."""

LEAST_SINE = 1e-6
"""[-] angles of triangles are not taken to be sharper: cotangents stay finite
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Laplacian:
    """The Laplacian of a mesh in one shape.

    Attributes
    ----------
    matrix : (V, V) sparse [1/length^2], Delta.
    areas : (V,) [length^2] of the vertices.
    heads, tails : (H,) the ends of all half edges.
    weights : (H,) w of each.
    """

    matrix: csr_matrix
    areas: Floats
    heads: Ints
    tails: Ints
    weights: Floats


def laplacian(vertices: Floats, faces: Ints) -> Laplacian:
    """Return the Laplacian of a mesh, see the module.

    Parameters
    ----------
    vertices : (V, 3) in any unit of length; faces : (F, 3).

    Raises
    ------
    ShapeError
        If the arrays are not (V, 3) and (F, 3).

    References
    ----------
    Pinkall and Polthier (1993).
    """
    expect_shape("vertices", vertices, "V", 3)
    expect_shape("faces", faces, "F", 3)
    count = len(vertices)
    heads, tails, halves = [], [], []
    areas = np.zeros(count)
    for n in range(3):
        here, a, b = (faces[:, (n + k) % 3] for k in range(3))
        to_a, to_b = vertices[a] - vertices[here], vertices[b] - vertices[here]
        twice = np.linalg.norm(np.cross(to_a, to_b), axis=1)
        size = np.linalg.norm(to_a, axis=1) * np.linalg.norm(to_b, axis=1)
        dot = np.einsum("fk,fk->f", to_a, to_b)
        cotangent = 0.5 * dot / np.maximum(twice, LEAST_SINE * size + 1e-300)
        areas += np.bincount(here, twice / 6.0, minlength=count)
        heads += [a, b]
        tails += [b, a]
        halves += [cotangent, cotangent]
    links = coo_matrix(
        (np.concatenate(halves), (np.concatenate(heads), np.concatenate(tails))),
        shape=(count, count),
    ).tocsr()
    plain = diags(np.asarray(links.sum(axis=1)).ravel()) - links
    areas = np.maximum(areas, 1e-300)
    pairs = links.tocoo()
    return Laplacian(
        matrix=csr_matrix(diags(1.0 / areas) @ plain),
        areas=areas,
        heads=pairs.row.astype(np.int64),
        tails=pairs.col.astype(np.int64),
        weights=pairs.data,
    )


def turns_of_rings(rest: Floats, now: Floats, of: Laplacian) -> Floats:
    """Find the rotation that carries each vertex' ring of edges best.

    R_v minimises sum_j w_vj | (x_v - x_j) - R_v (rest_v - rest_j) |^2, negative weights
    counting as 0.

    Parameters
    ----------
    rest, now : (V, 3) places before and after, in one unit of length.
    of : the mesh's Laplacian, which has the weights.

    Returns
    -------
    (V, 3, 3) rotations

    Raises
    ------
    ShapeError
        If the places do not fit the mesh.

    References
    ----------
    Sorkine and Alexa, As-rigid-as-possible surface modeling, 2007, equation 5.
    """
    expect_shape("rest", rest, len(of.areas), 3)
    expect_shape("now", now, len(of.areas), 3)
    weights = np.maximum(of.weights, 0.0)[:, None]
    before = (rest[of.heads] - rest[of.tails]) * weights
    after = now[of.heads] - now[of.tails]
    spread = np.zeros((len(rest), 3, 3))
    for i in range(3):
        for j in range(3):
            spread[:, i, j] = np.bincount(
                of.heads, after[:, i] * before[:, j], minlength=len(rest)
            )
    left, _, right = np.linalg.svd(spread)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    turned: Floats = left @ right
    return turned


class Dissected:
    """Solves symmetric, positive definite systems of a mesh; one order for all.

    Unknowns are eliminated part by part, cut where the mesh is narrow along its widest
    direction (nested dissection, George 1973), which keeps the factors sparse.
    """

    def __init__(self, pattern: csr_matrix, places: Floats) -> None:
        """Order the unknowns; ``places`` (V, 3) say where in space each is."""
        links = csr_matrix((np.ones(pattern.nnz), pattern.indices, pattern.indptr))
        self._order = np.array(_dissect(np.arange(len(places)), links, places))
        self._back = np.argsort(self._order)
        self._factor: SuperLU | None = None

    def factor(self, matrix: csr_matrix) -> None:
        """Factor a matrix (V, V) of the pattern."""
        turned = csc_matrix(matrix[self._order][:, self._order])
        self._factor = splu(
            turned,
            permc_spec="NATURAL",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def solve(self, right: Floats) -> Floats:
        """(V, N) solution for N right-hand sides."""
        assert self._factor is not None, "factor comes first"
        found: Floats = self._factor.solve(right[self._order])[self._back]
        return found


def _dissect(rows: Ints, links: csr_matrix, places: Floats) -> list[int]:
    """Rows in the order of elimination: both sides of a cut, then what links them."""
    if len(rows) <= LEAF_UNKNOWNS:
        return list(rows)
    here = places[rows]
    along = here[:, int(np.argmax(np.ptp(here, axis=0)))]
    low = along <= np.median(along)
    if low.all():
        return list(rows)
    far = np.zeros(len(places))
    far[rows[~low]] = 1.0
    near = rows[low]
    cut = (links[near] @ far) > 0.0
    sides = _dissect(near[~cut], links, places) + _dissect(rows[~low], links, places)
    return sides + list(near[cut])
