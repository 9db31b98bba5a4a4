"""A surface in a posture: there, back again, and its derivatives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from handclean.errors import HandcleanError
from handclean.hand import skinning
from handclean.hand.model import (
    Model,
    bone_rotations,
    jacobian,
    joint_positions,
    marker_positions,
    moved,
    neutral_pose,
)
from handclean.hand.surface import Surface, rest_joints, vertex_normals
from handclean.hand.template import template
from handclean.tree import JointTree

seeds = st.integers(0, 10**6)


def random_tree(rng, bones=5):
    """A tree of any shape, some bones with no hinge and some with two."""
    parents = [-1] + [int(rng.integers(0, b)) for b in range(1, bones)]
    hinge_bone = np.sort(rng.integers(1, bones, bones))
    axes = rng.normal(size=(bones, 3))
    names = tuple(f"b{n}" for n in range(bones))
    return JointTree(
        kind="hand",
        side="",
        bones=names,
        joints=names,
        parents=np.array(parents),
        offsets=np.vstack([np.zeros(3), rng.normal(0.0, 0.05, (bones - 1, 3))]),
        hinges=tuple(f"h{n}" for n in range(bones)),
        hinge_bone=hinge_bone,
        axes=axes / np.linalg.norm(axes, axis=1, keepdims=True),
        limits=np.tile([-2.0, 2.0], (bones, 1)),
    )


def random_pose(tree, rng, bend=0.8):
    pose = neutral_pose(tree)
    pose[:3] = rng.normal(0.0, 1.0, 3)
    pose[3:7] = np.roll(Rotation.random(random_state=rng).as_quat(), 1)
    pose[7:] = rng.uniform(-bend, bend, len(tree.hinges))
    return pose


def ball(tree, rng, rows=7, columns=10, radius=0.06):
    """A closed egg whose vertices have one to four bones of the tree."""
    up = np.pi * np.arange(1, rows) / rows
    turn = 2.0 * np.pi * np.arange(columns) / columns
    ring = np.stack(
        [
            np.outer(np.sin(up), np.cos(turn)),
            1.4 * np.outer(np.sin(up), np.sin(turn)),
            np.outer(np.cos(up), np.ones(columns)),
        ],
        axis=2,
    )
    vertices = radius * np.vstack([ring.reshape(-1, 3), [[0.0, 0, 1], [0, 0, -1]]])
    top, last = len(vertices) - 2, (rows - 2) * columns
    faces = []
    for c in range(columns):
        d = (c + 1) % columns
        faces += [(top, c, d), (top + 1, last + d, last + c)]
        for r in range(rows - 2):
            a, b = r * columns + c, r * columns + d
            faces += [(a, a + columns, b), (b, a + columns, b + columns)]
    count, size = len(vertices), len(tree.bones)
    shares = np.zeros((count, max(size, 4)))
    middles = rng.normal(0.0, radius, (size, 3))
    away = np.linalg.norm(vertices[:, None] - middles, axis=2)
    shares[:, :size] = np.exp(-((away / radius) ** 2))
    order = np.argsort(-shares, axis=1)[:, :4]
    weights = np.take_along_axis(shares, order, axis=1)
    weights[np.arange(4) >= rng.integers(1, 5, count)[:, None]] = 0.0
    weights /= weights.sum(axis=1, keepdims=True)
    return Surface(
        vertices=vertices,
        faces=np.array(faces),
        bones=order.astype(np.int64),
        weights=weights,
    )


def scene(seed, bend=0.8):
    rng = np.random.default_rng(seed)
    tree = random_tree(rng)
    return rng, tree, ball(tree, rng), random_pose(tree, rng, bend)


def some_markers(surface, rng, count=6):
    return skinning.OnSkin(
        face=rng.integers(0, len(surface.faces), count),
        share=rng.dirichlet(np.ones(3), count),
        lift=rng.uniform(-0.002, 0.012, count),
    )


@given(seed=seeds)
def test_vertices_go_to_the_mean_of_what_their_bones_say(seed):
    rng, tree, surface, pose = scene(seed)
    poses = np.stack([pose, random_pose(tree, rng)])
    turns, joints = bone_rotations(tree, poses), joint_positions(tree, poses)
    local = surface.vertices[:, None] - rest_joints(tree)[surface.bones]
    for t, got in enumerate(skinning.posed(surface, tree, poses)):
        said = np.einsum("vkij,vkj->vki", turns[t][surface.bones], local)
        said += joints[t][surface.bones]
        want = np.einsum("vk,vki->vi", surface.weights, said)
        np.testing.assert_allclose(got, want, atol=1e-12)


def test_the_zero_posture_is_the_surface_itself(rng):
    tree = template("right", forearm=True)
    surface = ball(tree, rng)
    posed = skinning.posed(surface, tree, neutral_pose(tree)[None])[0]
    np.testing.assert_allclose(posed, surface.vertices, atol=1e-15)


@given(seed=seeds)
def test_unposed_is_the_inverse_of_posed(seed):
    _, tree, surface, pose = scene(seed, bend=0.5)
    places = skinning.posed(surface, tree, pose[None])[0]
    back = skinning.unposed(surface, tree, pose, places)
    np.testing.assert_allclose(back, surface.vertices, atol=1e-11)


def test_a_vertex_between_bones_half_a_turn_apart_cannot_be_brought_back(rng):
    tree = random_tree(rng, bones=2)
    surface = ball(tree, rng)
    surface.weights[:] = [0.5, 0.5, 0.0, 0.0]
    surface.bones[:] = [0, 1, 0, 0]
    pose = neutral_pose(tree)
    pose[7] = np.pi
    with pytest.raises(HandcleanError, match="half a turn"):
        skinning.unposed(surface, tree, pose, surface.vertices)


def test_a_surface_of_another_tree_is_refused(rng):
    big, small = random_tree(rng, bones=9), random_tree(rng, bones=3)
    surface = ball(big, rng)
    with pytest.raises(HandcleanError, match="bones 0 to 2"):
        skinning.posed(surface, small, neutral_pose(small)[None])


def slopes(places, pose, width, h=1e-6):
    """Central differences of places (pose to (N, 3)) by the steps of `moved`."""
    steps = h * np.eye(width)
    return np.stack(
        [(places(moved(pose, s)) - places(moved(pose, -s))) / (2 * h) for s in steps],
        axis=2,
    )


@given(seed=seeds)
def test_the_vertex_jacobian_is_the_derivative_of_posed(seed):
    rng, tree, surface, pose = scene(seed)
    rows = rng.choice(len(surface.vertices), 7, replace=False)
    got = skinning.vertex_jacobian(surface, tree, pose, rows)
    want = slopes(
        lambda p: skinning.posed(surface, tree, p[None])[0, rows], pose, tree.dofs
    )
    np.testing.assert_allclose(got, want, atol=2e-8)
    whole = skinning.vertex_jacobian(surface, tree, pose)
    np.testing.assert_array_equal(whole[rows], got)


@given(seed=seeds)
def test_a_vertex_with_one_bone_moves_like_a_marker_on_it(seed):
    _, tree, surface, pose = scene(seed)
    surface.weights[:] = [1.0, 0.0, 0.0, 0.0]
    bone = surface.bones[:, 0]
    model = Model(
        tree=tree,
        labels=tuple(map(str, range(len(bone)))),
        bone=bone,
        at=surface.vertices - rest_joints(tree)[bone],
    )
    np.testing.assert_allclose(
        skinning.posed(surface, tree, pose[None]),
        marker_positions(model, pose[None]),
        atol=1e-12,
    )
    np.testing.assert_allclose(
        skinning.vertex_jacobian(surface, tree, pose),
        jacobian(model, pose),
        atol=1e-12,
    )


@given(seed=seeds)
def test_the_jacobian_of_markers_on_the_skin_is_their_derivative(seed):
    rng, tree, surface, pose = scene(seed)
    on = some_markers(surface, rng)
    got = skinning.skin_jacobian(surface, tree, on, pose)
    want = slopes(
        lambda p: skinning.skin_places(surface, tree, on, p[None])[0], pose, tree.dofs
    )
    np.testing.assert_allclose(got, want, atol=5e-8)


@given(seed=seeds)
def test_markers_on_a_part_of_the_skin_are_where_they_are_on_the_whole(seed):
    rng, tree, surface, pose = scene(seed)
    on = some_markers(surface, rng, 2)
    part, there = skinning.around(surface, on)
    assert len(part.faces) < len(surface.faces)
    whole = skinning.posed(surface, tree, pose[None])[0]
    want = skinning.lifted(whole, surface.faces, on)
    got = skinning.skin_places(part, tree, there, pose[None])[0]
    np.testing.assert_allclose(got, want, atol=1e-12)


def test_markers_stand_off_the_skin_by_their_lift_along_its_normal(rng):
    tree = random_tree(rng)
    surface = ball(tree, rng)
    on = some_markers(surface, rng)
    pose = random_pose(tree, rng)
    places = skinning.skin_places(surface, tree, on, pose[None])[0]
    vertices = skinning.posed(surface, tree, pose[None])[0]
    rows = surface.faces[on.face]
    foot = np.einsum("mk,mkn->mn", on.share, vertices[rows])
    normals = vertex_normals(vertices, surface.faces)[rows]
    along = np.einsum("mk,mkn->mn", on.share, normals)
    np.testing.assert_allclose(
        np.linalg.norm(places - foot, axis=1), np.abs(on.lift), atol=1e-12
    )
    np.testing.assert_allclose(np.cross(places - foot, along), 0.0, atol=1e-12)


@settings(max_examples=15)
@given(seed=seeds)
def test_a_projected_point_is_lifted_back_to_where_it_was(seed):
    rng, tree, surface, pose = scene(seed, bend=0.0)
    vertices = skinning.posed(surface, tree, pose[None])[0]
    on = some_markers(surface, rng, 20)
    points = skinning.lifted(vertices, surface.faces, on)
    again = skinning.project(surface, vertices, points)
    np.testing.assert_allclose(
        skinning.lifted(vertices, surface.faces, again), points, atol=1e-8
    )
    np.testing.assert_allclose(again.lift, on.lift, atol=1e-8)
