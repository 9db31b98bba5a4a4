"""A surface in a posture, and markers that ride on it.

A marker on the skin is a point of a triangle, by its barycentric coordinates c, and a
lift l along the skin's normal there:

    m = sum_k c_k v_k + l n,   n = u / |u|,   u = sum_k c_k N_k / |N_k|

with the triangle's corners v_k and N_k the sum of the normals ``(b - a) x (c - a)`` of
the faces around corner k. All of it moves with the posture, and the derivative follows
through every step; with n of length 1 it is ``dn = (I - n n') du / |u|``.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats, Ints, expect_shape
from handclean.errors import HandcleanError
from handclean.hand.model import links_of, workspace
from handclean.hand.surface import Surface, rest_joints, vertex_normals
from handclean.kernels import chain, normals, skin
from handclean.kernels.chain import Links
from handclean.numerics.triangles import box_tree, closest
from handclean.tree import POSE_HEAD, ROOT_DOFS, JointTree

_MOST_ROUNDS, _SURE_FOOT_M = 60, 1e-10
"""Rounds in which feet are sought, at most; [m] by which a foot that is found may be
off (chosen)."""


@dataclass(frozen=True, kw_only=True)
class OnSkin:
    """M markers on a surface.

    Attributes
    ----------
    face : (M,) the triangle each sits over.
    share : (M, 3) barycentric coordinates in it.
    lift : (M,) [m] how far out of the skin, along its normal.
    """

    face: Ints
    share: Floats
    lift: Floats

    def __post_init__(self) -> None:
        expect_shape("share", self.share, len(self.face), 3)
        expect_shape("lift", self.lift, len(self.face))


def bone_transforms(tree: JointTree, poses: Floats) -> tuple[Floats, Floats]:
    """(T, B, 3, 3) and (T, B, 3) [m]: bone b carries v to ``turn_b v + shift_b``.

    Parameters
    ----------
    poses : (T, 7 + D)
    """
    return _transforms(tree, links_of(tree), poses)


def _transforms(tree: JointTree, links: Links, poses: Floats) -> tuple[Floats, Floats]:
    """`bone_transforms` of a tree whose links are known."""
    expect_shape("poses", poses, "T", POSE_HEAD + len(tree.hinges))
    turn = np.zeros((len(poses), len(tree.bones), 3, 3))
    shift = np.zeros(turn.shape[:3])
    poses = np.ascontiguousarray(poses, dtype=np.float64)
    skin.place_bones(poses, links, rest_joints(tree), turn, shift)
    return turn, shift


def _skin_of(surface: Surface, rows: Ints | None = None) -> skin.Skin:
    """Vertices of a surface, all if no rows are given, as the kernels want them."""
    take = slice(None) if rows is None else rows
    return skin.Skin(
        vertices=np.ascontiguousarray(surface.vertices[take]),
        bones=surface.bones[take],
        weights=surface.weights[take],
    )


def _check(surface: Surface, tree: JointTree) -> None:
    last = int(surface.bones[surface.weights > 0.0].max())
    if last >= len(tree.bones):
        raise HandcleanError(
            f"surface: bone {last} moves a vertex; the tree of "
            f"'{tree.subject or tree.kind}' has bones 0 to {len(tree.bones) - 1}"
        )


def posed(surface: Surface, tree: JointTree, poses: Floats) -> Floats:
    """Compute where the vertices are in each pose, by linear blend skinning.

    Parameters
    ----------
    surface : the skin with its V vertices, in the zero posture.
    tree : its joints.
    poses : (T, 7 + D) place [m], unit quaternion w, x, y, z, hinge angles [rad].

    Returns
    -------
    (T, V, 3) [m] in the laboratory's frame

    Raises
    ------
    HandcleanError
        If the tree lacks a bone that moves a vertex.
    """
    _check(surface, tree)
    turn, shift = bone_transforms(tree, poses)
    out = np.zeros((len(poses), len(surface.vertices), 3))
    skin.place_vertices_of_frames(_skin_of(surface), turn, shift, out)
    return out


def unposed(surface: Surface, tree: JointTree, pose: Floats, places: Floats) -> Floats:
    """(V, 3) [m] the vertices in the zero posture that `posed` carries to ``places``.

    Parameters
    ----------
    surface : its bones and weights count; its vertices do not.
    pose : (7 + D,)
    places : (V, 3) [m] of the vertices in that pose.

    Raises
    ------
    HandcleanError
        If the posture flattens a vertex's mean transform (bones half a turn apart).
    """
    _check(surface, tree)
    expect_shape("places", places, len(surface.vertices), 3)
    expect_shape("pose", pose, POSE_HEAD + len(tree.hinges))
    turn, shift = bone_transforms(tree, pose[None])
    mean = np.zeros((len(places), 3, 4))
    skin.blend(_skin_of(surface), turn[0], shift[0], mean)
    flat = np.linalg.det(mean[:, :, :3]) < 1e-3
    if flat.any():
        raise HandcleanError(
            f"surface: {flat.sum()} vertices cannot be brought back from this posture; "
            "bones that share a vertex should be less than half a turn apart"
        )
    away = places - mean[:, :, 3]
    back = np.linalg.solve(mean[:, :, :3], away[:, :, None])[:, :, 0]
    return np.asarray(back, dtype=np.float64)


def vertex_jacobian(
    surface: Surface, tree: JointTree, pose: Floats, rows: Ints | None = None
) -> Floats:
    """(V', 3, 6 + D) [1, m/rad] derivative of vertices by a step of `model.moved`.

    Parameters
    ----------
    pose : (7 + D,)
    rows : (V',) the vertices wanted, all if None.
    """
    _check(surface, tree)
    expect_shape("pose", pose, POSE_HEAD + len(tree.hinges))
    links = links_of(tree)
    at_home = pose.copy()
    at_home[:3] = 0.0
    turn, shift = _transforms(tree, links, at_home[None])
    link_turn, origin, column = workspace(links)
    chain.place_links(
        at_home, links.parent, links.offset, links.axis, link_turn, origin, column
    )
    mesh = _skin_of(surface, rows)
    out = np.zeros((len(mesh.vertices), 3, ROOT_DOFS + len(tree.hinges)))
    skin.vertex_jacobian(mesh, turn[0], shift[0], links, column, out)
    return out


def around(surface: Surface, on: OnSkin) -> tuple[Surface, OnSkin]:
    """Cut out the part of a surface that moves markers: their faces and neighbours.

    Places and derivatives on the part are those on the whole.
    """
    near = np.zeros(len(surface.vertices), dtype=bool)
    near[surface.faces[on.face]] = True
    kept = np.flatnonzero(near[surface.faces].any(axis=1))
    used, inverse = np.unique(surface.faces[kept], return_inverse=True)
    part = replace(
        surface,
        vertices=surface.vertices[used],
        faces=inverse.reshape(-1, 3).astype(np.int64),
        bones=surface.bones[used],
        weights=surface.weights[used],
        colors=None if surface.colors is None else surface.colors[used],
    )
    return part, replace(on, face=np.searchsorted(kept, on.face))


def lifted(vertices: Floats, faces: Ints, on: OnSkin) -> Floats:
    """Compute where markers are on a mesh.

    Parameters
    ----------
    vertices : (V, 3) [m]; faces : (F, 3) of the mesh.
    on : where the M markers sit on it.

    Returns
    -------
    (M, 3) [m]
    """
    out: Floats = _lifted(vertices[None], faces, on)[0]
    return out


def _lifted(vertices: Floats, faces: Ints, on: OnSkin) -> Floats:
    """(T, M, 3) [m] where markers are on a mesh of (T, V, 3) [m] vertices."""
    out = np.zeros((len(vertices), len(on.face), 3))
    normals.lift_frames(
        np.ascontiguousarray(vertices),
        np.ascontiguousarray(faces),
        on.face,
        np.ascontiguousarray(on.share),
        on.lift,
        np.zeros(vertices.shape[1:]),
        out,
    )
    return out


def skin_places(surface: Surface, tree: JointTree, on: OnSkin, poses: Floats) -> Floats:
    """Compute where markers on the skin are in each pose.

    Parameters
    ----------
    surface : the skin, in the zero posture; tree : its joints.
    on : where the M markers sit on it.
    poses : (T, 7 + D) place [m], unit quaternion w, x, y, z, hinge angles [rad].

    Returns
    -------
    (T, M, 3) [m] in the laboratory's frame

    Raises
    ------
    HandcleanError
        If the tree lacks a bone that moves one of the vertices.
    """
    part, on = around(surface, on)
    return _lifted(posed(part, tree, poses), part.faces, on)


def skin_jacobian(
    surface: Surface, tree: JointTree, on: OnSkin, pose: Floats
) -> Floats:
    """Compute the derivative of places of markers on the skin at one pose.

    Parameters
    ----------
    surface : the skin, in the zero posture; tree : its joints.
    on : where the M markers sit on it.
    pose : (7 + D,) place [m], unit quaternion w, x, y, z, hinge angles [rad].

    Returns
    -------
    (M, 3, 6 + D) [1, m/rad]
        Columns as in `handclean.hand.model.jacobian`.

    Raises
    ------
    HandcleanError
        If the tree lacks a bone that moves one of the vertices.
    """
    part, on = around(surface, on)
    faces, share = np.ascontiguousarray(part.faces), np.ascontiguousarray(on.share)
    vertices = posed(part, tree, pose[None])[0]
    moves = vertex_jacobian(part, tree, pose)
    sums, d_sums = np.zeros(vertices.shape), np.zeros(moves.shape)
    normals.normal_sums(vertices, faces, sums)
    normals.normal_sums_jacobian(vertices, moves, faces, d_sums)
    normals.unit_jacobian(sums, d_sums)
    size = (len(on.face), 3, moves.shape[2])
    out, turns = np.zeros(size), np.zeros(size)
    normals.mean_over_corners(moves, faces, on.face, share, out)
    normals.mean_over_corners(d_sums, faces, on.face, share, turns)
    normal = np.einsum("mk,mkn->mn", share, sums[faces[on.face]])
    normals.unit_jacobian(normal, turns)
    out += on.lift[:, None, None] * turns
    return out


def project(surface: Surface, vertices: Floats, points: Floats) -> OnSkin:
    """Find where on the skin each of (M, 3) [m] points sits.

    First the closest point of the mesh, whose line to the point is the normal of the
    face there, or nearly; then that foot is moved until the point lies on the smooth
    normal, so that `lifted` leads back to it. Where the mesh bends too much for that
    (a point farther off than the bend's radius, on its inner side), the foot with the
    smallest error is kept.

    Parameters
    ----------
    vertices : (V, 3) [m] of the surface, in the posture the points belong to.
    """
    expect_shape("vertices", vertices, len(surface.vertices), 3)
    at_vertices = vertex_normals(vertices, surface.faces)
    tree = box_tree(vertices, surface.faces)
    feet = closest(vertices, surface.faces, points, tree)
    best = OnSkin(face=feet.face, share=feet.share, lift=feet.distance)
    least = np.full(len(points), np.inf)
    for _ in range(_MOST_ROUNDS):
        corner_normals = at_vertices[surface.faces[feet.face]]
        normal = np.einsum("mk,mkn->mn", feet.share, corner_normals)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        lift = ((points - feet.places) * normal).sum(axis=1)
        aside = points - feet.places - lift[:, None] * normal
        error: Floats = np.linalg.norm(aside, axis=1)
        better = error < least
        least = np.minimum(error, least)
        best = OnSkin(
            face=np.where(better, feet.face, best.face),
            share=np.where(better[:, None], feet.share, best.share),
            lift=np.where(better, lift, best.lift),
        )
        if least.max(initial=0.0) < _SURE_FOOT_M:
            break
        feet = closest(vertices, surface.faces, feet.places + 0.6 * aside, tree)
    return best
