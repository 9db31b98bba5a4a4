"""Linear blend skinning: many vertices, each carried by at most four bones.

A vertex v of the zero posture goes to ``sum_k w_k (R_k v + s_k)`` over its bones, whose
weights w are listed largest first: a kernel stops at the first weight of 0, so that the
many vertices with one bone cost one transform. All others blend their bones' transforms
first and apply the mean once.

Derivatives are those of `handclean.kernels.chain`: turning hinge i moves a point p of a
bone it carries with velocity ``a x p + v``. A blended vertex p = sum_k w_k p_k moves
with ``a x q + c v``, where q and c are the sums of w_k p_k and w_k over the bones that
the hinge carries.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.chain import Links, place_links


class Skin(NamedTuple):
    """V vertices in the zero posture, and the bones that carry them."""

    vertices: Floats
    """(V, 3) [m]"""
    bones: Ints
    """(V, 4) bones of each vertex, in the order of their weights."""
    weights: Floats
    """(V, 4) largest first, sum 1."""


@jit
def place_bones(
    poses: Floats, links: Links, rest: Floats, out_turn: Floats, out_shift: Floats
) -> None:
    """Write each bone's R and s for many poses.

    Parameters
    ----------
    poses : (T, 7 + D) translation [m], quaternion, angles [rad].
    links : the joint tree.
    rest : (B, 3) [m] where each bone's joint is in the zero posture.
    out_turn : (T, B, 3, 3) R, overwritten in full.
    out_shift : (T, B, 3) [m] s, overwritten in full.
    """
    link, at, count = links.bone_link, links.bone_at, links.parent.shape[0]
    turn, origin = np.zeros((count, 3, 3)), np.zeros((count, 3))
    column = np.zeros((count, 6))
    for t in range(poses.shape[0]):
        place_links(
            poses[t], links.parent, links.offset, links.axis, turn, origin, column
        )
        for b in range(link.shape[0]):
            i = link[b]
            x, y, z = (
                at[b, 0] - rest[b, 0],
                at[b, 1] - rest[b, 1],
                at[b, 2] - rest[b, 2],
            )
            for row in range(3):
                for col in range(3):
                    out_turn[t, b, row, col] = turn[i, row, col]
                out_shift[t, b, row] = (
                    poses[t, row]
                    + origin[i, row]
                    + turn[i, row, 0] * x
                    + turn[i, row, 1] * y
                    + turn[i, row, 2] * z
                )


@jit
def place_vertices(mesh: Skin, turn: Floats, shift: Floats, out: Floats) -> None:
    """Write where the vertices go.

    Parameters
    ----------
    mesh : the vertices in the zero posture, their bones and weights.
    turn : (B, 3, 3) rotation R of each bone.
    shift : (B, 3) [m] s of each bone.
    out : (V, 3) [m], overwritten in full.
    """
    vertices, bones, weights = mesh.vertices, mesh.bones, mesh.weights
    for v in range(vertices.shape[0]):
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        b = bones[v, 0]
        if weights[v, 1] == 0.0:
            for row in range(3):
                out[v, row] = (
                    turn[b, row, 0] * x
                    + turn[b, row, 1] * y
                    + turn[b, row, 2] * z
                    + shift[b, row]
                )
            continue
        w = weights[v, 0]
        for row in range(3):
            out[v, row] = w * (
                turn[b, row, 0] * x
                + turn[b, row, 1] * y
                + turn[b, row, 2] * z
                + shift[b, row]
            )
        for k in range(1, bones.shape[1]):
            w = weights[v, k]
            if w == 0.0:
                break
            b = bones[v, k]
            for row in range(3):
                out[v, row] += w * (
                    turn[b, row, 0] * x
                    + turn[b, row, 1] * y
                    + turn[b, row, 2] * z
                    + shift[b, row]
                )


@jit
def place_vertices_of_frames(
    mesh: Skin, turn: Floats, shift: Floats, out: Floats
) -> None:
    """Write where the vertices go in T frames.

    Parameters
    ----------
    mesh : the vertices in the zero posture, their bones and weights.
    turn : (T, B, 3, 3) rotation R of each bone.
    shift : (T, B, 3) [m] s of each bone.
    out : (T, V, 3) [m], overwritten in full.
    """
    for t in range(turn.shape[0]):
        place_vertices(mesh, turn[t], shift[t], out[t])


@jit
def blend(mesh: Skin, turn: Floats, shift: Floats, out: Floats) -> None:
    """Write the mean transform of each vertex.

    Parameters
    ----------
    mesh : its bones and weights count, its vertices do not.
    turn : (B, 3, 3) rotation R of each bone.
    shift : (B, 3) [m] s of each bone.
    out : (V, 3, 4) the mean of R and, last, of s [m]; overwritten in full.
    """
    bones, weights = mesh.bones, mesh.weights
    for v in range(bones.shape[0]):
        out[v] = 0.0
        for k in range(bones.shape[1]):
            w, b = weights[v, k], bones[v, k]
            if w == 0.0:
                break
            for row in range(3):
                for col in range(3):
                    out[v, row, col] += w * turn[b, row, col]
                out[v, row, 3] += w * shift[b, row]


@jit
def vertex_jacobian(
    mesh: Skin, turn: Floats, shift: Floats, links: Links, column: Floats, out: Floats
) -> None:
    """Write the derivative of the vertices by the root's motion and all hinge angles.

    Parameters
    ----------
    mesh : the vertices in the zero posture, their bones and weights.
    turn : (B, 3, 3) rotation R of each bone.
    shift : (B, 3) [m] s of each bone, of places relative to the root's origin.
    links : the joint tree.
    column : (D + 1, 6) hinge columns, as `chain.place_links` writes them.
    out : (V, 3, 6 + D) [1, m/rad], overwritten in full.
    """
    vertices, bones, weights = mesh.vertices, mesh.bones, mesh.weights
    link, carries = links.bone_link, links.carries
    for v in range(vertices.shape[0]):
        out[v] = 0.0
        for row in range(3):
            out[v, row, row] = 1.0
        for k in range(bones.shape[1]):
            w, b = weights[v, k], bones[v, k]
            if w == 0.0:
                break
            x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
            px = turn[b, 0, 0] * x + turn[b, 0, 1] * y + turn[b, 0, 2] * z
            py = turn[b, 1, 0] * x + turn[b, 1, 1] * y + turn[b, 1, 2] * z
            pz = turn[b, 2, 0] * x + turn[b, 2, 1] * y + turn[b, 2, 2] * z
            x, y = w * (px + shift[b, 0]), w * (py + shift[b, 1])
            z = w * (pz + shift[b, 2])
            out[v, 1, 3] -= z
            out[v, 2, 3] += y
            out[v, 0, 4] += z
            out[v, 2, 4] -= x
            out[v, 0, 5] -= y
            out[v, 1, 5] += x
            for i in range(1, column.shape[0]):
                if carries[link[b], i]:
                    ax, ay, az = column[i, 0], column[i, 1], column[i, 2]
                    out[v, 0, 5 + i] += ay * z - az * y + w * column[i, 3]
                    out[v, 1, 5 + i] += az * x - ax * z + w * column[i, 4]
                    out[v, 2, 5 + i] += ax * y - ay * x + w * column[i, 5]
