"""Mean value coordinates in a closed triangle mesh.

Floater, Kos and Reimers, Mean value coordinates in 3D, Computer Aided Geometric Design
22 (2005) 623-631: with the unit vectors e_i = (v_i - x) / r_i from x to the vertices,
a triangle (i, j, k) gives vertex i the share

    mu_i = (b_jk + b_ij n_ij . n_jk + b_ki n_ki . n_jk) / (2 e_i . n_jk)   (equation 14)

where b_jk is the angle between e_j and e_k and n_jk = e_j x e_k / |e_j x e_k|. The
coordinate of a vertex is the sum of its mu over all triangles, divided by r_i and made
to sum to 1. The shares are those of the integral of the unit normal over the spherical
triangle, so that linear functions come out exactly, whatever the mesh.

A triangle whose plane holds x, without x in it, has an empty spherical triangle and no
share.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from handclean.arrays import Floats, Ints, expect_shape
from handclean.errors import HandcleanError

IN_PLANE_SINE = 1e-9
"""[-] sine of the angle below which a direction counts as in a triangle's plane
(chosen: above rounding)."""


def mean_value_coordinates(points: Floats, vertices: Floats, faces: Ints) -> Floats:
    """(P, V) the mean value coordinates of points in a closed mesh; rows sum to 1.

    Parameters
    ----------
    points : (P, 3) inside the mesh (or anywhere off its surface).
    vertices, faces : (V, 3), (F, 3) closed and oriented, either way.

    Raises
    ------
    HandcleanError
        If a point lies on the surface, where the coordinates are not these.
    """
    expect_shape("points", points, "P", 3)
    expect_shape("vertices", vertices, "V", 3)
    expect_shape("faces", faces, "F", 3)
    return np.array([_of_one(x, vertices, faces) for x in points]).reshape(
        len(points), len(vertices)
    )


def capped(faces: Ints, count: int) -> tuple[Ints, list[Ints]]:
    """Close a part of a mesh by a fan of triangles over every hole.

    Parameters
    ----------
    faces : (F, 3) of the part, oriented.
    count : how many vertices there are.

    Returns
    -------
    Faces with the fans, and the vertices around each hole; hole n's fan meets in vertex
    ``count + n``, which belongs in their middle.
    """
    expect_shape("faces", faces, "F", 3)
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    code, back = ends[:, 0] * count + ends[:, 1], ends[:, 1] * count + ends[:, 0]
    open_ends = ends[~np.isin(code, back)]
    if not len(open_ends):
        return faces, []
    graph = coo_matrix(
        (np.ones(len(open_ends)), (open_ends[:, 0], open_ends[:, 1])),
        shape=(count, count),
    )
    label = connected_components(graph, directed=False)[1][open_ends[:, 0]]
    rims, fans = [], [faces]
    for n, hole in enumerate(np.unique(label)):
        rim = open_ends[label == hole]
        rims.append(np.unique(rim))
        fans.append(
            np.column_stack([rim[:, 1], rim[:, 0], np.full(len(rim), count + n)])
        )
    return np.vstack(fans), rims


def _of_one(point: Floats, vertices: Floats, faces: Ints) -> Floats:
    """(V,) the coordinates of one point."""
    rays = vertices - point
    away = np.linalg.norm(rays, axis=1)
    used = away[np.unique(faces)]
    if used.min() <= IN_PLANE_SINE * used.max():
        raise HandcleanError("mean value coordinates: the point is a vertex")
    unit = rays / np.where(away > 0.0, away, 1.0)[:, None]
    corner = [unit[faces[:, n]] for n in range(3)]
    normals, angles = [], []  # of the side opposite to each corner
    for n in range(3):
        j, k = corner[(n + 1) % 3], corner[(n + 2) % 3]
        across = np.cross(j, k)
        size = np.linalg.norm(across, axis=1)
        angles.append(np.arctan2(size, np.einsum("fk,fk->f", j, k)))
        normals.append(across / np.where(size > 0.0, size, 1.0)[:, None])
    height = [np.einsum("fk,fk->f", corner[n], normals[n]) for n in range(3)]
    flat = np.min(np.abs(height), axis=0) <= IN_PLANE_SINE
    if (flat & (np.sum(angles, axis=0) > 2.0 * np.pi - 1e-6)).any():
        raise HandcleanError("mean value coordinates: the point lies on a triangle")
    total = np.zeros(len(vertices))
    for n in range(3):
        share = angles[n].copy()
        for m in ((n + 1) % 3, (n + 2) % 3):
            share += angles[m] * np.einsum("fk,fk->f", normals[m], normals[n])
        mu = np.where(flat, 0.0, share / (2.0 * np.where(flat, 1.0, height[n])))
        total += np.bincount(faces[:, n], mu, minlength=len(vertices))
    weights = total / np.where(away > 0.0, away, 1.0)
    out: Floats = weights / weights.sum()
    return out
