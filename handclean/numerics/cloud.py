"""Point clouds: normals, spacing, lonely points, clusters, thinning."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from handclean.arrays import Bools, Floats, Ints, expect_shape

POINTS_PER_BLOCK = 20_000
"""Points whose neighbourhoods are held at a time (chosen; memory)."""


def neighbours(points: Floats, count: int) -> tuple[Floats, Ints]:
    """Distances to, and rows of, the ``count`` nearest other points; (P, count) both.

    With fewer other points, the nearest are repeated.
    """
    count = max(1, min(count, len(points) - 1))
    away, rows = cKDTree(points).query(points, k=count + 1)
    return away[:, 1:], rows[:, 1:].astype(np.int64)


def plane_normals(points: Floats, count: int = 12) -> Floats:
    """Compute normals of the planes through each point's nearest ones.

    Parameters
    ----------
    points : (P, 3) in any unit; count : neighbours that a plane goes through.

    Returns
    -------
    (P, 3) unit vectors; their sign means nothing, see `turned_along`

    Raises
    ------
    ShapeError
        If the points are not (P, 3).

    References
    ----------
    Hoppe et al., Surface reconstruction from unorganized points, 1992.
    """
    expect_shape("points", points, "P", 3)
    _, rows = neighbours(points, count)
    out = np.zeros(points.shape)
    for start in range(0, len(points), POINTS_PER_BLOCK):
        part = slice(start, start + POINTS_PER_BLOCK)
        around = np.concatenate([points[rows[part]], points[part, None]], axis=1)
        around -= around.mean(axis=1, keepdims=True)
        spread = np.einsum("pni,pnj->pij", around, around)
        out[part] = np.linalg.eigh(spread)[1][:, :, 0]
    return out


def turned_along(normals: Floats, directions: Floats) -> Floats:
    """Turn normals round where they point against a direction.

    Parameters
    ----------
    normals, directions : (P, 3)

    Returns
    -------
    (P, 3)
    """
    against = np.einsum("pk,pk->p", normals, directions) < 0.0
    return np.where(against[:, None], -normals, normals)


def crowded(points: Floats, count: int, sigmas: float) -> Bools:
    """Find points whose neighbours are about as near as those of the others.

    The mean distance to ``count`` neighbours may exceed the cloud's median by so many
    of its (robust) standard deviations: the statistical outlier removal of Rusu,
    Semantic 3D object maps (2009), section 3.3.

    Parameters
    ----------
    points : (P, 3) in any unit; sigmas : how many standard deviations.

    Returns
    -------
    (P,)
    """
    away = neighbours(points, count)[0].mean(axis=1)
    middle = float(np.median(away))
    spread = 1.4826 * float(np.median(np.abs(away - middle)))
    return np.asarray(away <= middle + sigmas * max(spread, 0.1 * middle))


def clusters(points: Floats, gap: float) -> Ints:
    """Part points into clusters.

    Points belong together when a chain of cubes of side ``gap``, each touching the
    next, leads from one to the other; so gaps up to ``gap`` are always bridged.

    Parameters
    ----------
    points : (P, 3); gap : in the same unit.

    Returns
    -------
    (P,) number of each point's cluster, 0 being the biggest
    """
    cells, inside = np.unique(
        np.floor((points - points.min(axis=0)) / gap).astype(np.int64),
        axis=0,
        return_inverse=True,
    )
    pairs = cKDTree(cells).query_pairs(1.0, p=np.inf, output_type="ndarray")
    graph = coo_matrix(
        (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(cells),) * 2
    )
    _, label = connected_components(graph, directed=False)
    label = label[inside.ravel()]
    order = np.argsort(-np.bincount(label), kind="stable")
    rank = np.zeros(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    out: Ints = rank[label]
    return out


def thinned(points: Floats, count: int) -> Ints:
    """Choose some of the points, spread evenly over the list.

    Parameters
    ----------
    points : (P, 3); count : how many, at most.

    Returns
    -------
    their rows, rising
    """
    if len(points) <= count:
        return np.arange(len(points))
    return np.linspace(0, len(points) - 1, count).round().astype(np.int64)
