"""Questions to a triangle mesh: what is closest to a point, what is in the way.

The answers come from a tree of boxes (`handclean.kernels.boxes`), which is built once
for the mesh's faces and refitted when its vertices move.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape
from handclean.kernels import boxes as box_kernels
from handclean.kernels import nearest, rays

_FACES_PER_LEAF = 4
"""Faces of a leaf of the tree, about (chosen for speed alone)."""


@dataclass(frozen=True, kw_only=True)
class BoxTree:
    """How F triangles are told apart by place, for whatever vertices they have.

    Attributes
    ----------
    faces : (F, 3) the triangles in the tree's order.
    which : (F,) their numbers in the mesh.
    starts : (L + 1,) first triangle of each of the L leaves, and F.
    """

    faces: Ints
    which: Ints
    starts: Ints


@dataclass(frozen=True, kw_only=True)
class Feet:
    """Points of a mesh that are closest to P points.

    Attributes
    ----------
    face : (P,) triangle of the mesh each lies on.
    share : (P, 3) barycentric coordinates in it.
    places : (P, 3) [m]
    distance : (P,) [m] from the points.
    """

    face: Ints
    share: Floats
    places: Floats
    distance: Floats


def box_tree(vertices: Floats, faces: Ints) -> BoxTree:
    """Sort triangles into a tree, halving them across their longest extent.

    Parameters
    ----------
    vertices : (V, 3) [m] as they are, or as they mostly are.
    faces : (F, 3), at least one.
    """
    expect_shape("vertices", vertices, "V", 3)
    expect_shape("faces", faces, "F", 3)
    count = len(faces)
    depth = (
        max(int(np.log2(count / _FACES_PER_LEAF)), 0) if count >= _FACES_PER_LEAF else 0
    )
    middles = vertices[faces].mean(axis=1)
    order = np.arange(count)
    for level in range(depth):
        parts = 1 << level
        starts = np.arange(parts) * count // parts
        here = middles[order]
        low = np.minimum.reduceat(here, starts)
        extent = np.maximum.reduceat(here, starts) - low
        axis = extent.argmax(axis=1)
        part = np.repeat(np.arange(parts), np.diff([*starts, count]))
        key = here[np.arange(count), axis[part]] - low[part, axis[part]]
        size = np.maximum(extent.max(axis=1), 1e-300)
        order = order[np.argsort(part + 0.999 * key / size[part], kind="stable")]
    leaves = 1 << depth
    return BoxTree(
        faces=np.ascontiguousarray(faces[order], dtype=np.int64),
        which=order.astype(np.int64),
        starts=(np.arange(leaves + 1) * count // leaves).astype(np.int64),
    )


def closest(
    vertices: Floats, faces: Ints, points: Floats, tree: BoxTree | None = None
) -> Feet:
    """Find the point of a mesh that is closest to each of (P, 3) [m] points.

    Parameters
    ----------
    vertices : (V, 3) [m]; faces : (F, 3)
    tree : of these faces, if it is there already.
    """
    expect_shape("points", points, "P", 3)
    tree = box_tree(vertices, faces) if tree is None else tree
    points = np.ascontiguousarray(points, dtype=np.float64)
    boxes = box_kernels.make_boxes(tree.faces, tree.starts)
    vertices = np.ascontiguousarray(vertices, dtype=np.float64)
    box_kernels.refit(vertices, tree.faces, boxes)
    feet = nearest.closest_on_mesh(points, boxes)
    return Feet(
        face=tree.which[feet.face],
        share=feet.share,
        places=np.einsum("pk,pkn->pn", feet.share, boxes.corners[feet.face]),
        distance=np.sqrt(feet.square),
    )


def hidden_behind(
    vertices: Floats,
    tree: BoxTree,
    markers: Floats,
    cameras: Floats,
    *,
    skip_m: float = 0.0,
    swell_m: float = 0.0,
) -> Bools:
    """(T, M, C) whether a moving mesh stands between markers and cameras.

    Parameters
    ----------
    vertices : (T, V, 3) [m]; tree : of the mesh's faces.
    markers : (T, M, 3) [m]; cameras : (C, 3) [m]
    skip_m : [m] what does not count, at either end of a line of sight.
    swell_m : [m] how much thicker than it is the mesh counts.
    """
    expect_shape("vertices", vertices, "T", "V", 3)
    expect_shape("markers", markers, len(vertices), "M", 3)
    expect_shape("cameras", cameras, "C", 3)
    seen = np.ones((*markers.shape[:2], len(cameras)), dtype=bool)
    rays.hide_behind_mesh(
        np.ascontiguousarray(markers),
        np.ascontiguousarray(cameras),
        np.ascontiguousarray(vertices, dtype=np.float64),
        tree.faces,
        tree.starts,
        skip_m,
        swell_m,
        seen,
    )
    return ~seen
