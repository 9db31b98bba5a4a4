"""A hand's skin: a closed triangle mesh in the zero posture, and what moves it.

Linear blend skinning: bone b carries a vertex v of the zero posture to
``turn_b (v - joint_b) + origin_b``, with joint_b where its joint is in the zero posture
(in which all bones' frames are parallel to the root's); the vertex goes to the mean of
what its at most four bones say, by their weights.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bytes, Floats, Ints, expect_shape
from handclean.errors import HandcleanError
from handclean.tree import MIRROR, JointTree

BONES_PER_VERTEX = 4
"""Bones that move one vertex, at most: what glTF holds in one set of weights."""

BACK = np.array([0.0, 0.0, 1.0])
"""The direction out of the back of the hand (the papers' h) in the root's frame."""


@dataclass(frozen=True, kw_only=True)
class Surface:
    """V vertices and F triangles of one hand in its zero posture.

    Attributes
    ----------
    vertices : (V, 3) [m] in the root's frame of the tree it belongs to (left or right).
    faces : (F, 3) vertices of each triangle, counter-clockwise seen from outside.
    bones : (V, 4) bones of the tree that move each vertex; any where the weight is 0.
    weights : (V, 4) their shares, not negative, the largest first, sum 1.
    colors : (V, 3) red, green, blue, or None.
    """

    vertices: Floats
    faces: Ints
    bones: Ints
    weights: Floats
    colors: Bytes | None = None

    def __post_init__(self) -> None:
        count = len(self.vertices)
        expect_shape("vertices", self.vertices, count, 3)
        expect_shape("faces", self.faces, "F", 3)
        expect_shape("bones", self.bones, count, BONES_PER_VERTEX)
        expect_shape("weights", self.weights, count, BONES_PER_VERTEX)
        if self.colors is not None:
            expect_shape("colors", self.colors, count, 3)
        problem = _problem(self)
        if problem:
            raise HandcleanError(problem, where="surface")

    def mirrored(self) -> "Surface":
        """Return the mirror image, for the mirrored tree; faces keep looking out."""
        faces = np.ascontiguousarray(self.faces[:, ::-1])
        return replace(self, vertices=self.vertices * MIRROR, faces=faces)


def _problem(surface: Surface) -> str:
    """Say what makes a surface unusable, or nothing."""
    count = len(surface.vertices)
    if not np.isfinite(surface.vertices).all():
        return "vertices should be finite numbers"
    if not len(surface.faces):
        return "there should be at least one face"
    if surface.faces.min() < 0 or surface.faces.max() >= count:
        return f"faces should name vertices 0 to {count - 1}"
    if surface.bones.min() < 0:
        return "bones should not be negative"
    if not (surface.weights >= 0.0).all():
        return "weights should not be negative"
    if (surface.weights[:, 1:] > surface.weights[:, :-1]).any():
        return "weights of a vertex should be listed largest first"
    if not np.allclose(surface.weights.sum(axis=1), 1.0, atol=1e-6):
        return "weights of a vertex should sum to 1"
    return ""


def rest_joints(tree: JointTree) -> Floats:
    """Compute where the joints are in the zero posture.

    Returns
    -------
    (B, 3) [m] in the root's frame, in the order of the tree's bones
    """
    places = tree.offsets.copy()
    for b in range(1, len(tree.bones)):
        places[b] += places[tree.parents[b]]
    return places


def face_normals(vertices: Floats, faces: Ints) -> Floats:
    """Compute the outward normals of faces, as long as twice a face's area.

    Parameters
    ----------
    vertices : (V, 3) [m]; faces : (F, 3), counter-clockwise seen from outside.

    Returns
    -------
    (F, 3) [m^2]
    """
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    out: Floats = np.cross(b - a, c - a)
    return out


def vertex_normals(vertices: Floats, faces: Ints) -> Floats:
    """Compute the outward normals of vertices: means of their faces', by area.

    Parameters
    ----------
    vertices : (V, 3) [m]; faces : (F, 3), counter-clockwise seen from outside.

    Returns
    -------
    (V, 3) unit vectors; 0 of a vertex without a face
    """
    flat = face_normals(vertices, faces)
    out = np.zeros(vertices.shape)
    for n in range(3):
        for k in range(3):
            out[:, k] += np.bincount(faces[:, n], flat[:, k], minlength=len(vertices))
    size = np.linalg.norm(out, axis=1, keepdims=True)
    unit: Floats = out / np.where(size > 0.0, size, 1.0)
    return unit


def edges_of(faces: Ints) -> Ints:
    """List the edges of a mesh, each once.

    Parameters
    ----------
    faces : (F, 3)

    Returns
    -------
    (E, 2) sorted, the smaller vertex first
    """
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    out: Ints = np.unique(ends, axis=0)
    return out


def is_closed(faces: Ints) -> bool:
    """Whether a mesh is closed, manifold along edges, and oriented.

    Parameters
    ----------
    faces : (F, 3)
    """
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    if len(np.unique(ends, axis=0)) != len(ends):
        return False
    there = {tuple(end) for end in ends.tolist()}
    return all((b, a) in there for a, b in there)


def volume(vertices: Floats, faces: Ints) -> float:
    """Compute the volume that a closed mesh encloses.

    Parameters
    ----------
    vertices : (V, 3) [m]; faces : (F, 3).

    Returns
    -------
    [m^3], negative if the faces look inwards
    """
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    return float(np.einsum("fk,fk->", a, np.cross(b, c)) / 6.0)
