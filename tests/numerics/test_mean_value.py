import numpy as np
import pytest
import trimesh

from handclean.errors import HandcleanError
from handclean.numerics.mean_value import capped, mean_value_coordinates


@pytest.fixture
def dented(rng):
    """A closed mesh that is not convex."""
    mesh = trimesh.creation.icosphere(subdivisions=2)
    at = np.array(mesh.vertices)
    at *= (1.0 + 0.4 * np.sin(3 * at[:, :1])) * [1.0, 1.5, 0.7]
    return at, np.array(mesh.faces)


def inside(rng, count=8):
    return rng.uniform(-0.3, 0.3, (count, 3))


def test_coordinates_sum_to_one_and_give_the_point_back(dented, rng):
    points = inside(rng)
    found = mean_value_coordinates(points, *dented)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(found @ dented[0], points, atol=1e-10)


def test_an_affine_map_of_the_mesh_carries_the_points(dented, rng):
    at, faces = dented
    points = inside(rng)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    found = mean_value_coordinates(points, at, faces) @ (at @ matrix.T + shift)
    np.testing.assert_allclose(found, points @ matrix.T + shift, atol=1e-9)


def test_coordinates_do_not_depend_on_scale_place_or_side(dented, rng):
    at, faces = dented
    points = inside(rng)
    expected = mean_value_coordinates(points, at, faces)
    moved = mean_value_coordinates(50.0 * points + 3.0, 50.0 * at + 3.0, faces)
    np.testing.assert_allclose(moved, expected, atol=1e-10)
    flipped = mean_value_coordinates(points, at, faces[:, ::-1])
    np.testing.assert_allclose(flipped, expected, atol=1e-10)


def test_in_a_convex_mesh_they_are_positive(rng):
    mesh = trimesh.creation.icosphere(subdivisions=2)
    found = mean_value_coordinates(inside(rng), mesh.vertices, mesh.faces)
    assert found.min() > 0.0


def test_the_middle_of_a_ball_is_shared_evenly():
    mesh = trimesh.creation.icosahedron()
    found = mean_value_coordinates(np.zeros((1, 3)), mesh.vertices, mesh.faces)
    np.testing.assert_allclose(found, 1.0 / 12.0, atol=1e-12)


def test_planes_of_triangles_do_not_disturb():
    """The middle of a cube's lower half lies in no triangle, but a corner's planes."""
    box = trimesh.creation.box((2.0, 2.0, 2.0)).subdivide()
    at = np.array(box.vertices)
    at[at[:, 2] > 0.5, 2] = 3.0
    points = np.array([[0.0, 0.0, 0.0], [0.3, 0.3, 0.3], [0.0, 0.5, -0.2]])
    found = mean_value_coordinates(points, at, np.array(box.faces))
    np.testing.assert_allclose(found @ at, points, atol=1e-9)


def test_a_point_in_the_plane_of_a_triangle_gets_its_place():
    mesh = trimesh.creation.box((2.0, 2.0, 2.0))
    at, faces = np.array(mesh.vertices), np.array(mesh.faces)
    points = np.array([[1.0, 0.2, 2.5]])  # outside, in the plane x = 1
    found = mean_value_coordinates(points, at, faces)
    np.testing.assert_allclose(found @ at, points, atol=1e-8)


def test_a_point_on_the_surface_is_refused():
    mesh = trimesh.creation.box((2.0, 2.0, 2.0))
    for point in ([1.0, 0.3, 0.2], [1.0, 1.0, 1.0]):
        with pytest.raises(HandcleanError, match="point"):
            mean_value_coordinates(np.array([point]), mesh.vertices, mesh.faces)


def test_a_part_of_a_mesh_is_closed_at_its_cuts():
    mesh = trimesh.creation.icosphere(subdivisions=3)
    at, faces = np.array(mesh.vertices), np.array(mesh.faces)
    height = at[faces][:, :, 2]
    belt = faces[(np.abs(height) < 0.5).all(axis=1)]
    closed, rims = capped(belt, len(at))
    assert len(rims) == 2
    places = np.vstack([at, *[at[rim].mean(axis=0)[None] for rim in rims]])
    assert trimesh.Trimesh(places, closed, process=False).is_watertight
    assert trimesh.Trimesh(places, closed, process=False).volume > 0.0
    point = np.array([[0.1, -0.2, 0.05]])
    found = mean_value_coordinates(point, places, closed)
    np.testing.assert_allclose(found @ places, point, atol=1e-10)


def test_a_closed_mesh_needs_no_cap():
    mesh = trimesh.creation.icosphere(subdivisions=1)
    faces, rims = capped(np.array(mesh.faces), len(mesh.vertices))
    np.testing.assert_array_equal(faces, mesh.faces)
    assert rims == []
