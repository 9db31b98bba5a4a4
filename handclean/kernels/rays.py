"""Whether triangles stand between two points.

The triangle test is that of Woop, Benthin and Wald, Watertight ray/triangle
intersection, J. Computer Graphics Techniques 2 (2013) 65-82: coordinates are sheared so
that the segment runs along one of them; whether it passes an edge on one side or the
other is then the sign of a difference of two products, which comes out exactly opposite
in the two triangles that share the edge. Both signs may be zero. Hence no segment slips
through between neighbours.

Boxes are tested by slabs; a segment that runs along a slab is taken to cross it very
slowly, so that it stays in or out for its whole length.
"""

import math

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.kernels.boxes import Boxes, make_boxes, refit
from handclean.kernels.normals import vertex_normals

_INFINITE_SLOPE = 1e300
"""In place of 1 / 0, for rays across an axis (chosen)."""


@jit
def meets(p: Floats, q: Floats, skip: float, tree: Boxes) -> bool:
    """Whether the segment from p to q meets a triangle, its two ends left out.

    Parameters
    ----------
    p, q : (3,) [m]
    skip : [m] how much of the segment does not count, at either end.
    tree : the triangles.
    """
    starts, corners, boxes = tree.starts, tree.corners, tree.ends
    dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    if not size > 2.0 * skip:
        return False
    first = skip / size
    last = 1.0 - first
    over_x = 1.0 / dx if dx != 0.0 else _INFINITE_SLOPE
    over_y = 1.0 / dy if dy != 0.0 else _INFINITE_SLOPE
    over_z = 1.0 / dz if dz != 0.0 else _INFINITE_SLOPE
    kx, ky, kz = 0, 1, 2
    if abs(dx) >= abs(dy) and abs(dx) >= abs(dz):
        kx, ky, kz = 1, 2, 0
    elif abs(dy) >= abs(dz):
        kx, ky, kz = 2, 0, 1
    along = 1.0 / (q[kz] - p[kz])
    shear_x, shear_y = (q[kx] - p[kx]) * along, (q[ky] - p[ky]) * along
    leaves = starts.shape[0] - 1
    node = 1
    while True:
        near, far = first, last
        s, t = (boxes[node, 0] - p[0]) * over_x, (boxes[node, 3] - p[0]) * over_x
        if s > t:
            s, t = t, s
        if s > near:
            near = s
        if t < far:
            far = t
        s, t = (boxes[node, 1] - p[1]) * over_y, (boxes[node, 4] - p[1]) * over_y
        if s > t:
            s, t = t, s
        if s > near:
            near = s
        if t < far:
            far = t
        s, t = (boxes[node, 2] - p[2]) * over_z, (boxes[node, 5] - p[2]) * over_z
        if s > t:
            s, t = t, s
        if s > near:
            near = s
        if t < far:
            far = t
        if not near > far:
            if node < leaves:
                node *= 2
                continue
            leaf = node - leaves
            for f in range(starts[leaf], starts[leaf + 1]):
                az, bz = corners[f, 0, kz] - p[kz], corners[f, 1, kz] - p[kz]
                cz = corners[f, 2, kz] - p[kz]
                ax = corners[f, 0, kx] - p[kx] - shear_x * az
                ay = corners[f, 0, ky] - p[ky] - shear_y * az
                bx = corners[f, 1, kx] - p[kx] - shear_x * bz
                by = corners[f, 1, ky] - p[ky] - shear_y * bz
                cx = corners[f, 2, kx] - p[kx] - shear_x * cz
                cy = corners[f, 2, ky] - p[ky] - shear_y * cz
                u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
                if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
                    continue
                total = u + v + w
                if total == 0.0:
                    continue
                at = (u * az + v * bz + w * cz) * along / total
                if first <= at <= last:
                    return True
        node += 1
        while node % 2 == 0:
            node //= 2
        if node == 1:
            return False


@jit
def hide_behind_mesh(
    markers: Floats,
    cameras: Floats,
    vertices: Floats,
    faces: Ints,
    starts: Ints,
    skip: float,
    swell: float,
    out: Bools,
) -> None:
    """Take out of a camera's sight the markers that stand behind a mesh.

    Parameters
    ----------
    markers : (T, M, 3) [m]
    cameras : (C, 3) [m]
    vertices : (T, V, 3) [m] of the mesh.
    faces, starts : (F, 3), (L + 1,) as in `boxes.make_boxes`.
    skip : [m] as in `meets`.
    swell : [m] how far the vertices are moved along their normals first.
    out : (T, M, C) what is seen so far; what the mesh hides is taken out.
    """
    tree, normals = make_boxes(faces, starts), np.zeros((vertices.shape[1], 3))
    swollen = np.zeros((vertices.shape[1], 3))
    for t in range(markers.shape[0]):
        swollen[:] = vertices[t]
        if swell != 0.0:
            vertex_normals(swollen, faces, normals)
            for v in range(normals.shape[0]):
                for n in range(3):
                    swollen[v, n] += swell * normals[v, n]
        refit(swollen, faces, tree)
        for m in range(markers.shape[1]):
            for c in range(cameras.shape[0]):
                if out[t, m, c]:
                    out[t, m, c] = not meets(markers[t, m], cameras[c], skip, tree)
