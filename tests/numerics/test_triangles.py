"""Closest points and lines of sight against brute force over all triangles."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from handclean.numerics.triangles import box_tree, closest, hidden_behind


def sphere(rows=8, columns=12):
    """A closed mesh near the unit sphere, faces looking out."""
    up = np.pi * np.arange(1, rows) / rows
    turn = 2.0 * np.pi * np.arange(columns) / columns
    ring = np.stack(
        [
            np.outer(np.sin(up), np.cos(turn)),
            np.outer(np.sin(up), np.sin(turn)),
            np.outer(np.cos(up), np.ones(columns)),
        ],
        axis=2,
    )
    vertices = np.vstack([ring.reshape(-1, 3), [[0.0, 0, 1], [0, 0, -1]]])
    top, bottom = len(vertices) - 2, len(vertices) - 1
    faces = []
    for c in range(columns):
        d = (c + 1) % columns
        faces.append((top, c, d))
        last = (rows - 2) * columns
        faces.append((bottom, last + d, last + c))
        for r in range(rows - 2):
            a, b = r * columns + c, r * columns + d
            faces += [(a, a + columns, b), (b, a + columns, b + columns)]
    return vertices, np.array(faces)


def soup(rng, count):
    """Triangles anywhere, of any shape."""
    return rng.uniform(-1, 1, (3 * count, 3)), np.arange(3 * count).reshape(-1, 3)


def nearest_square(triangle, point):
    """Oracle: convex combination of the corners by non-negative least squares."""
    much = 1e4
    system = np.vstack([triangle.T, much * np.ones(3)])
    return nnls(system, np.append(point, much))[1] ** 2


def met(p, q, vertices, faces, skip=0.0):
    """Oracle: Moller and Trumbore (1997), triangle by triangle."""
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    along = q - p
    normal = np.cross(along, c - a)
    size = ((b - a) * normal).sum(axis=1)
    u = ((p - a) * normal).sum(axis=1) / size
    across = np.cross(p - a, b - a)
    v = (along * across).sum(axis=1) / size
    t = ((c - a) * across).sum(axis=1) / size
    first = skip / np.linalg.norm(along)
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return bool((inside & (t >= first) & (t <= 1 - first)).any())


@given(seed=st.integers(0, 10**6), count=st.integers(1, 60))
def test_the_closest_point_is_that_of_all_triangles(seed, count):
    rng = np.random.default_rng(seed)
    vertices, faces = soup(rng, count)
    points = rng.uniform(-1.5, 1.5, (4, 3))
    got = closest(vertices, faces, points)
    corners = vertices[faces]
    for n, point in enumerate(points):
        want = min(nearest_square(corner, point) for corner in corners)
        assert got.distance[n] ** 2 == pytest.approx(want, abs=1e-6)
        foot = got.share[n] @ corners[got.face[n]]
        np.testing.assert_allclose(foot, got.places[n], atol=1e-12)
        away = np.linalg.norm(point - foot)
        assert away == pytest.approx(got.distance[n], abs=1e-12)
    assert got.share.min() >= -1e-12
    np.testing.assert_allclose(got.share.sum(axis=1), 1.0)


def test_points_of_the_mesh_are_their_own_closest_points(rng):
    vertices, faces = sphere()
    face = rng.integers(0, len(faces), 50)
    share = rng.dirichlet(np.ones(3), 50)
    points = np.einsum("pk,pkn->pn", share, vertices[faces[face]])
    found = closest(vertices, faces, np.vstack([points, vertices]))
    assert found.distance.max() < 1e-9


def test_triangles_without_area_do_no_harm(rng):
    vertices, faces = sphere()
    flat = np.array([[0, 0, 0], [0, 1, 1], [5, 9, 5]])
    points = rng.normal(size=(20, 3))
    want = closest(vertices, faces, points).distance
    got = closest(vertices, np.vstack([flat, faces]), points)
    np.testing.assert_allclose(got.distance, want, atol=1e-12)


def test_every_triangle_is_in_the_tree_once(rng):
    for count in (1, 2, 3, 4, 5, 7, 8, 9, 31, 100):
        vertices, faces = soup(rng, count)
        tree = box_tree(vertices, faces)
        assert sorted(tree.which) == list(range(count))
        np.testing.assert_array_equal(faces[tree.which], tree.faces)
        assert tree.starts[0] == 0
        assert tree.starts[-1] == count
        assert (np.diff(tree.starts) >= 1).all()


@given(seed=st.integers(0, 10**6), count=st.integers(1, 40))
def test_lines_of_sight_are_blocked_where_any_triangle_says_so(seed, count):
    rng = np.random.default_rng(seed)
    vertices, faces = soup(rng, count)
    tree = box_tree(rng.uniform(-1, 1, vertices.shape), faces)
    markers, cameras = rng.uniform(-1.5, 1.5, (1, 6, 3)), rng.normal(size=(5, 3))
    skip = float(rng.uniform(0.0, 0.5))
    got = hidden_behind(vertices[None], tree, markers, cameras, skip_m=skip)
    for m, c in np.ndindex(6, 5):
        want = met(markers[0, m], cameras[c], vertices, faces, skip)
        assert got[0, m, c] == want


def test_the_mesh_may_move_away_from_where_its_tree_was_made(rng):
    vertices, faces = sphere()
    tree = box_tree(vertices, faces)
    frames = np.stack([vertices + move for move in ([0, 0, 0], [0, 3.0, 0])])
    markers, camera = np.full((2, 1, 3), [-2.0, 0.1, 0.2]), np.array([[2.0, 0.0, 0.1]])
    hidden = hidden_behind(frames, tree, markers, camera)
    np.testing.assert_array_equal(hidden[:, 0, 0], [True, False])


def test_nothing_is_seen_through_the_edges_and_corners_of_a_closed_mesh(rng):
    vertices, faces = sphere()
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    share = rng.random((len(ends), 1))
    edges = share * vertices[ends[:, 0]] + (1 - share) * vertices[ends[:, 1]]
    through = np.vstack([vertices, edges])
    outside = 3.0 * through + rng.normal(0.0, 0.5, through.shape)
    inside = np.array([[0.0, 0.0, 0.0], [0.1, 0.2, -0.1]])
    for eye in inside:
        far = eye + 3.0 * (through - eye)
        tree = box_tree(vertices, faces)
        assert hidden_behind(vertices[None], tree, far[None], eye[None]).all()
        assert hidden_behind(vertices[None], tree, outside[None], eye[None]).all()


def test_lines_along_the_axes_are_judged_like_others():
    vertices, faces = sphere()
    tree = box_tree(vertices, faces)
    markers = np.vstack([2.0 * np.eye(3), [[2.0, 2.0, 0.0], [1.001, 2.0, 0.0]]])
    cameras = np.vstack([-2.0 * np.eye(3), [[2.0, -2.0, 0.0], [1.001, -2.0, 0.0]]])
    hidden = hidden_behind(vertices[None], tree, markers[None], cameras)[0]
    np.testing.assert_array_equal(np.diag(hidden), [True, True, True, False, False])


def test_a_swollen_mesh_hides_what_is_close_beside_it():
    vertices, faces = sphere(24, 32)
    tree = box_tree(vertices, faces)
    beside = np.array([[[-2.0, 0.0, 1.05]]])
    camera = np.array([[2.0, 0.0, 1.05]])
    hidden = [
        hidden_behind(vertices[None], tree, beside, camera, swell_m=swell)[0, 0, 0]
        for swell in (0.0, 0.04, 0.06)
    ]
    assert hidden == [False, False, True]


def test_the_ends_of_a_line_of_sight_can_be_left_out():
    vertices, faces = sphere(24, 32)
    tree = box_tree(vertices, faces)
    just_below = np.array([[[0.0, 0.0, 0.97]]])
    above = np.array([[0.0, 0.0, 5.0], [0.0, 0.0, -5.0]])
    for skip, want in ((0.0, [True, True]), (0.05, [False, True])):
        got = hidden_behind(vertices[None], tree, just_below, above, skip_m=skip)
        np.testing.assert_array_equal(got[0, 0], want)
