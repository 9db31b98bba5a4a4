"""A skinned hand's skin in the zero posture, fingers straight and parallel.

The bones' full rotations are undone: for each vertex the mean of its bones' transforms,
by its weights, is inverted. Joints that are merged into one bone stood still in the
bind pose, so their weights add up. At most four bones are kept, the heaviest. Vertices
of one place, which programs repeat along seams of a texture, become one.
"""

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError
from handclean.hand.surface import (
    BONES_PER_VERTEX,
    Surface,
    is_closed,
    rest_joints,
    volume,
)
from handclean.io.gltf.read import Glb
from handclean.io.gltf.skin import SkinnedMesh
from handclean.tree import JointTree


def rest_skin(
    glb: Glb,
    mesh: SkinnedMesh,
    vertices: Floats,
    weights: Floats,
    tree: JointTree,
    turns: Floats,
    at: Floats,
) -> Surface:
    """Return the skin in the zero posture."""
    _, first, place = np.unique(
        vertices, axis=0, return_index=True, return_inverse=True
    )
    faces: Ints = place.ravel()[mesh.faces]
    flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    bones, shares = _heaviest(weights[first])
    shift = at - np.einsum("bij,bj->bi", turns, rest_joints(tree))
    mean = np.einsum("vk,vkij->vij", shares, turns[bones])
    away = vertices[first] - np.einsum("vk,vki->vi", shares, shift[bones])
    if np.linalg.det(mean).min() < 1e-3:
        raise glb.fail("its bind pose folds the skin", "save it with an open hand")
    rest = np.linalg.solve(mean, away[:, :, None])[:, :, 0]
    faces = np.ascontiguousarray(faces[~flat])
    if is_closed(faces) and volume(rest, faces) < 0.0:
        raise glb.fail("its faces look inwards", "turn them round in its editor")
    try:
        return Surface(
            vertices=rest,
            faces=faces,
            bones=bones,
            weights=shares,
            colors=None if mesh.colors is None else mesh.colors[first],
        )
    except HandcleanError as error:
        raise glb.fail(error.wrong) from None


def _heaviest(weights: Floats) -> tuple[Ints, Floats]:
    """(V, 4) the bones with the largest of (V, B) shares, and these, summing to 1."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :BONES_PER_VERTEX]
    shares = np.take_along_axis(weights, order, axis=1)
    shares /= shares.sum(axis=1, keepdims=True)
    return np.where(shares > 0.0, order, 0).astype(np.int64), shares
