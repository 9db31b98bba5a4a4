"""How uncertain postures are, and what that means for missing markers; compiled.

With marker noise sigma_m per axis and independent priors of all degrees of freedom, a
small step s about a pose is Gaussian with the precision ::

    A = sum_m J_m^T J_m / sigma_m^2 + diag(precision)

so its degrees of freedom have the variances diag(A^-1), and a marker that is not seen
is off by trace(J_m A^-1 J_m^T), a squared distance.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape
from handclean.hand.model import Model
from handclean.ik.solve import chain_of
from handclean.kernels import jit
from handclean.kernels.chain import marker_jacobian, place_links, place_points
from handclean.kernels.gauss_newton import Chain, Workspace, make_workspace
from handclean.kernels.linalg import invert
from handclean.tree import ROOT_DOFS


class LinearisedPoses(NamedTuple):
    """Poses (N, 7 + D) and what is known of small steps about them.

    weight (N, M) [1/m^2]: 1 / sigma^2, 0 where a marker is not seen; precision
    (N, 6 + D) [1/m^2, 1/rad^2] of the prior; asked (N, M) markers whose distance is
    wanted.
    """

    poses: Floats
    weight: Floats
    precision: Floats
    asked: Bools


class Spread(NamedTuple):
    """Variances (N, 6 + D) of steps; squared distances (N, M) [m^2], 0 if not asked."""

    variance: Floats
    distance: Floats


@jit
def add_markers(
    columns: Floats, weight: Floats, link: Ints, carries: Bools, matrix: Floats
) -> None:
    """Add the information of the markers of a frame to a matrix' lower triangle.

    Parameters
    ----------
    columns : (M, 3, 6 + D) Jacobian; weight : (M,) [1/m^2]; link : (M,)
    carries : (D + 1, D + 1) see `kernels.chain.marker_jacobian`.
    matrix : (6 + D, 6 + D)
    """
    size = matrix.shape[0]
    for m in range(weight.shape[0]):
        if weight[m] <= 0.0:
            continue
        for i in range(size):
            if i >= 6 and not carries[link[m], i - 5]:
                continue
            for j in range(i + 1):
                total = 0.0
                for n in range(3):
                    total += columns[m, n, i] * columns[m, n, j]
                matrix[i, j] += weight[m] * total


@jit
def spread_frames(
    about: LinearisedPoses, tree: Chain, carries: Bools, k: Workspace, out: Spread
) -> None:
    """Write what the module says for many poses.

    Parameters
    ----------
    carries : (D + 1, D + 1) see `kernels.chain.marker_jacobian`.
    out : overwritten in full.
    """
    size, markers = about.precision.shape[1], about.weight.shape[1]
    columns = np.zeros((markers, 3, size))
    matrix, inverse = np.zeros((size, size)), np.zeros((size, size))
    for t in range(about.poses.shape[0]):
        place_links(
            about.poses[t],
            tree.parent,
            tree.offset,
            tree.axis,
            k.turn,
            k.origin,
            k.column,
        )
        place_points(k.turn, k.origin, tree.link, tree.at, k.point)
        marker_jacobian(k.point, k.column, tree.link, carries, columns)
        matrix[:] = 0.0
        for i in range(size):
            matrix[i, i] = about.precision[t, i]
        add_markers(columns, about.weight[t], tree.link, carries, matrix)
        invert(matrix, inverse)
        for i in range(size):
            out.variance[t, i] = inverse[i, i]
        for m in range(markers):
            total = 0.0
            if about.asked[t, m]:
                for n in range(3):
                    for i in range(size):
                        for j in range(size):
                            total += columns[m, n, i] * inverse[i, j] * columns[m, n, j]
            out.distance[t, m] = total


def spread(
    model: Model, poses: Floats, weight: Floats, precision: Floats, asked: Bools
) -> tuple[Floats, Floats]:
    """(N, 6 + D) variances of steps about poses, (N, M) [m^2] of markers asked for.

    Parameters
    ----------
    poses : (N, 7 + D); weight : (N, M) [1/m^2]; precision : (N, 6 + D);
    asked : (N, M)
    """
    frames, markers = len(poses), len(model.labels)
    size = ROOT_DOFS + len(model.tree.hinges)
    expect_shape("weight", weight, frames, markers)
    expect_shape("precision", precision, frames, size)
    expect_shape("asked", asked, frames, markers)
    out = Spread(np.zeros((frames, size)), np.zeros((frames, markers)))
    about = LinearisedPoses(np.ascontiguousarray(poses), weight, precision, asked)
    work = make_workspace(size - ROOT_DOFS, markers)
    spread_frames(about, chain_of(model), model.links.carries, work, out)
    return out.variance, out.distance
