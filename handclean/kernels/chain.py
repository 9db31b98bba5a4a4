"""Forward kinematics and marker Jacobian of any joint tree.

A tree comes as *links*: link 0 is the root and link d + 1 is what hinge d turns. In
the zero posture all link frames are parallel to the root's; link i sits at
``offset[i]`` in its parent's frame and turns about ``axis[i]`` there. Parents come
before children. A marker is a place ``at`` in the frame of one link.

Everything is computed relative to the root's origin, in laboratory orientation, which
keeps the digits of small hands in large rooms. Turning hinge d by one radian moves a
carried point p with velocity ``a x (p - o) = a x p + v``, with ``v = o x a``; (a, v)
is the hinge's column for every point at once. The root's columns are the three
translations and the three rotations about the laboratory's axes through its origin:
its rotation is updated as ``exp(omega) R``, so that no orientation is special.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.kernels.rotations import matrix_from_quaternion


class Links(NamedTuple):
    """A joint tree as the kernels want it: the root and one link per hinge."""

    parent: Ints
    """(D + 1,) parent link, -1 for link 0, the root."""
    offset: Floats
    """(D + 1, 3) [m] origin of each link in its parent's frame."""
    axis: Floats
    """(D + 1, 3) unit hinge axes; the root's is zero."""
    carries: Bools
    """(D + 1, D + 1) whether hinge link i lies between link j and the root,
    ``carries[j, i]``; j itself included, the root's column false."""
    bone_link: Ints
    """(B,) the link each bone is part of."""
    bone_at: Floats
    """(B, 3) [m] where each bone's joint is in that link's frame."""


@jit
def place_links(
    pose: Floats,
    parent: Ints,
    offset: Floats,
    axis: Floats,
    turn: Floats,
    origin: Floats,
    column: Floats,
) -> None:
    """Write where every link is and what its hinge does.

    Parameters
    ----------
    pose : (7 + D,) translation [m], quaternion, angles [rad].
    parent : (D + 1,) parent link, -1 for link 0.
    offset : (D + 1, 3) [m]
    axis : (D + 1, 3) unit axes; link 0's is not used.
    turn : (D + 1, 3, 3)
        Rotation of each link, to laboratory orientation; overwritten in full.
    origin : (D + 1, 3) [m]
        Origin of each link relative to the root's; overwritten in full.
    column : (D + 1, 6)
        (a, v) of each hinge; link 0's is left alone, the rest overwritten.
    """
    matrix_from_quaternion(pose[3:7], turn[0])
    origin[0, 0] = 0.0
    origin[0, 1] = 0.0
    origin[0, 2] = 0.0
    for i in range(1, parent.shape[0]):
        up = turn[parent[i]]
        over = origin[parent[i]]
        x, y, z = offset[i, 0], offset[i, 1], offset[i, 2]
        ox = over[0] + up[0, 0] * x + up[0, 1] * y + up[0, 2] * z
        oy = over[1] + up[1, 0] * x + up[1, 1] * y + up[1, 2] * z
        oz = over[2] + up[2, 0] * x + up[2, 1] * y + up[2, 2] * z
        origin[i, 0], origin[i, 1], origin[i, 2] = ox, oy, oz

        x, y, z = axis[i, 0], axis[i, 1], axis[i, 2]
        s, c = math.sin(pose[6 + i]), math.cos(pose[6 + i])
        k = 1.0 - c
        kx, ky, kz = k * x, k * y, k * z
        sx, sy, sz = s * x, s * y, s * z
        for row in range(3):
            u, v, w = up[row, 0], up[row, 1], up[row, 2]
            along = u * x + v * y + w * z
            column[i, row] = along
            turn[i, row, 0] = u * c + along * kx + v * sz - w * sy
            turn[i, row, 1] = v * c + along * ky + w * sx - u * sz
            turn[i, row, 2] = w * c + along * kz + u * sy - v * sx
        ax, ay, az = column[i, 0], column[i, 1], column[i, 2]
        column[i, 3] = oy * az - oz * ay
        column[i, 4] = oz * ax - ox * az
        column[i, 5] = ox * ay - oy * ax


@jit
def place_points(
    turn: Floats, origin: Floats, link: Ints, at: Floats, out: Floats
) -> None:
    """Write where points on links are, relative to the root's origin.

    Parameters
    ----------
    turn, origin : as written by `place_links`.
    link : (M,) the link each point sits on.
    at : (M, 3) [m] places in the links' frames.
    out : (M, 3) [m], overwritten in full.
    """
    for m in range(link.shape[0]):
        i = link[m]
        x, y, z = at[m, 0], at[m, 1], at[m, 2]
        for row in range(3):
            out[m, row] = (
                origin[i, row]
                + turn[i, row, 0] * x
                + turn[i, row, 1] * y
                + turn[i, row, 2] * z
            )


@jit
def place_markers(
    poses: Floats,
    parent: Ints,
    offset: Floats,
    axis: Floats,
    link: Ints,
    at: Floats,
    out: Floats,
) -> None:
    """Write the laboratory places of points for many poses.

    Parameters
    ----------
    poses : (T, 7 + D) translation [m], quaternion, angles [rad].
    parent, offset, axis : (D + 1,), (D + 1, 3) [m], (D + 1, 3) of a tree's `Links`,
        which as one argument cost a tenth of the time.
    link : (M,) the link each point sits on.
    at : (M, 3) [m] places in the links' frames.
    out : (T, M, 3) [m], overwritten in full.
    """
    count = parent.shape[0]
    turn, origin = np.zeros((count, 3, 3)), np.zeros((count, 3))
    column = np.zeros((count, 6))
    for t in range(poses.shape[0]):
        place_links(poses[t], parent, offset, axis, turn, origin, column)
        place_points(turn, origin, link, at, out[t])
        for m in range(link.shape[0]):
            for row in range(3):
                out[t, m, row] += poses[t, row]


@jit
def marker_jacobian(
    points: Floats, column: Floats, link: Ints, carries: Bools, out: Floats
) -> None:
    """Write the derivative of points by the root's motion and all hinge angles.

    Parameters
    ----------
    points : (M, 3) [m] relative to the root's origin.
    column : (D + 1, 6) as written by `place_links`.
    link : (M,) the link each point sits on.
    carries : (D + 1, D + 1) whether hinge link i lies between link j and the root,
        ``carries[j, i]``, j itself included.
    out : (M, 3, 6 + D) [1, m/rad], overwritten in full.
    """
    for m in range(points.shape[0]):
        x, y, z = points[m, 0], points[m, 1], points[m, 2]
        out[m] = 0.0
        for row in range(3):
            out[m, row, row] = 1.0
        out[m, 1, 3], out[m, 2, 3] = -z, y
        out[m, 0, 4], out[m, 2, 4] = z, -x
        out[m, 0, 5], out[m, 1, 5] = -y, x
        for i in range(1, column.shape[0]):
            if carries[link[m], i]:
                ax, ay, az = column[i, 0], column[i, 1], column[i, 2]
                out[m, 0, 5 + i] = ay * z - az * y + column[i, 3]
                out[m, 1, 5 + i] = az * x - ax * z + column[i, 4]
                out[m, 2, 5 + i] = ax * y - ay * x + column[i, 5]
