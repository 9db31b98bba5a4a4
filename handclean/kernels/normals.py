"""Normals of a mesh, points lifted along them, and the derivatives of both.

See `handclean.hand.skinning` for the formulas.
"""

import math

from handclean.arrays import Floats, Ints
from handclean.kernels import jit


@jit
def normal_sums(vertices: Floats, faces: Ints, out: Floats) -> None:
    """Write the sums of the normals ``(b - a) x (c - a)`` of the faces at each vertex.

    Parameters
    ----------
    vertices : (V, 3) [m]; faces : (F, 3)
    out : (V, 3) [m^2], overwritten in full.
    """
    out[:] = 0.0
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ux = vertices[j, 0] - vertices[i, 0]
        uy = vertices[j, 1] - vertices[i, 1]
        uz = vertices[j, 2] - vertices[i, 2]
        vx = vertices[k, 0] - vertices[i, 0]
        vy = vertices[k, 1] - vertices[i, 1]
        vz = vertices[k, 2] - vertices[i, 2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for n in range(3):
            v = faces[f, n]
            out[v, 0] += x
            out[v, 1] += y
            out[v, 2] += z


@jit
def make_unit(vectors: Floats) -> None:
    """Divide (N, 3) vectors by their lengths, in place; zeros stay."""
    for n in range(vectors.shape[0]):
        x, y, z = vectors[n, 0], vectors[n, 1], vectors[n, 2]
        size = math.sqrt(x * x + y * y + z * z)
        if size > 0.0:
            vectors[n, 0], vectors[n, 1], vectors[n, 2] = x / size, y / size, z / size


@jit
def vertex_normals(vertices: Floats, faces: Ints, out: Floats) -> None:
    """Write unit outward normals: the mean of a vertex's faces, by their area.

    Parameters
    ----------
    vertices : (V, 3) [m]; faces : (F, 3)
    out : (V, 3), overwritten in full; zero where a vertex has no area around it.
    """
    normal_sums(vertices, faces, out)
    make_unit(out)


@jit
def lift_frames(
    vertices: Floats,
    faces: Ints,
    face: Ints,
    share: Floats,
    lift: Floats,
    normals: Floats,
    out: Floats,
) -> None:
    """Write where markers on a mesh are in T frames.

    Parameters
    ----------
    vertices : (T, V, 3) [m]; faces : (F, 3)
    face, share, lift : (M,), (M, 3), (M,) [m] as in `hand.skinning.OnSkin`.
    normals : (V, 3) work space.
    out : (T, M, 3) [m], overwritten in full.
    """
    for t in range(vertices.shape[0]):
        vertex_normals(vertices[t], faces, normals)
        for m in range(face.shape[0]):
            i, j, k = faces[face[m], 0], faces[face[m], 1], faces[face[m], 2]
            size = 0.0
            for n in range(3):
                x = share[m, 0] * normals[i, n] + share[m, 1] * normals[j, n]
                x += share[m, 2] * normals[k, n]
                out[t, m, n] = x
                size += x * x
            size = math.sqrt(size)
            for n in range(3):
                foot = share[m, 0] * vertices[t, i, n] + share[m, 1] * vertices[t, j, n]
                foot += share[m, 2] * vertices[t, k, n]
                out[t, m, n] = foot + lift[m] * out[t, m, n] / size


@jit
def normal_sums_jacobian(
    vertices: Floats, moves: Floats, faces: Ints, out: Floats
) -> None:
    """Write the derivative of `normal_sums`.

    Parameters
    ----------
    vertices : (V, 3) [m]; faces : (F, 3)
    moves : (V, 3, 6 + D) derivative of the vertices.
    out : (V, 3, 6 + D), overwritten in full.
    """
    out[:] = 0.0
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ux = vertices[j, 0] - vertices[i, 0]
        uy = vertices[j, 1] - vertices[i, 1]
        uz = vertices[j, 2] - vertices[i, 2]
        vx = vertices[k, 0] - vertices[i, 0]
        vy = vertices[k, 1] - vertices[i, 1]
        vz = vertices[k, 2] - vertices[i, 2]
        for d in range(moves.shape[2]):
            px = moves[j, 0, d] - moves[i, 0, d]
            py = moves[j, 1, d] - moves[i, 1, d]
            pz = moves[j, 2, d] - moves[i, 2, d]
            qx = moves[k, 0, d] - moves[i, 0, d]
            qy = moves[k, 1, d] - moves[i, 1, d]
            qz = moves[k, 2, d] - moves[i, 2, d]
            x = py * vz - pz * vy + uy * qz - uz * qy
            y = pz * vx - px * vz + uz * qx - ux * qz
            z = px * vy - py * vx + ux * qy - uy * qx
            for n in range(3):
                v = faces[f, n]
                out[v, 0, d] += x
                out[v, 1, d] += y
                out[v, 2, d] += z


@jit
def unit_jacobian(vectors: Floats, moves: Floats) -> None:
    """Turn vectors u and du into n = u / |u| and dn = (I - n n') du / |u|, in place.

    Parameters
    ----------
    vectors : (N, 3); zeros stay as they are, with their derivatives.
    moves : (N, 3, 6 + D) their derivatives.
    """
    for i in range(vectors.shape[0]):
        x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
        size = math.sqrt(x * x + y * y + z * z)
        if size == 0.0:
            continue
        x, y, z = x / size, y / size, z / size
        vectors[i, 0], vectors[i, 1], vectors[i, 2] = x, y, z
        for d in range(moves.shape[2]):
            along = x * moves[i, 0, d] + y * moves[i, 1, d] + z * moves[i, 2, d]
            moves[i, 0, d] = (moves[i, 0, d] - x * along) / size
            moves[i, 1, d] = (moves[i, 1, d] - y * along) / size
            moves[i, 2, d] = (moves[i, 2, d] - z * along) / size


@jit
def mean_over_corners(
    values: Floats, faces: Ints, face: Ints, share: Floats, out: Floats
) -> None:
    """Write the values at points of triangles from those at their corners.

    Parameters
    ----------
    values : (V, 3, 6 + D); faces : (F, 3)
    face, share : (M,), (M, 3)
    out : (M, 3, 6 + D), overwritten in full.
    """
    for m in range(face.shape[0]):
        out[m] = 0.0
        for c in range(3):
            v = faces[face[m], c]
            for n in range(3):
                for d in range(values.shape[2]):
                    out[m, n, d] += share[m, c] * values[v, n, d]
