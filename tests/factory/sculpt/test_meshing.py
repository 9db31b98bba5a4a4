"""From a field to even triangles: closed, one side out, the right shape."""

import numpy as np
import pytest
from meshes import edge_variation, smallest_angles

from handclean.factory.sculpt.remesh import remesh
from handclean.factory.sculpt.tetrahedra import closed_mesh
from handclean.hand.surface import edges_of, is_closed, volume

LOW, HIGH = np.full(3, -1.5), np.full(3, 1.5)


def ball(points):
    return np.linalg.norm(points, axis=1) - 1.0


def ring(points):
    across = np.hypot(points[:, 0], points[:, 1]) - 0.9
    return np.hypot(across, points[:, 2]) - 0.4


def onto_ball(points):
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def as_is(points):
    return points, np.tile(np.eye(3), (len(points), 1, 1))


def euler(vertices, faces):
    return len(vertices) - len(edges_of(faces)) + len(faces)


@pytest.mark.parametrize(
    ("field", "expected", "volume_of"),
    [(ball, 2, 4.0 / 3.0 * np.pi), (ring, 0, 2.0 * np.pi**2 * 0.9 * 0.16)],
    ids=["ball", "ring"],
)
def test_a_field_becomes_a_closed_mesh_of_its_own_shape(field, expected, volume_of):
    vertices, faces = closed_mesh(field, LOW, HIGH, 0.1)
    assert is_closed(faces)
    assert euler(vertices, faces) == expected
    assert volume(vertices, faces) == pytest.approx(volume_of, rel=0.03)


def test_any_field_becomes_a_closed_mesh(rng):
    values = rng.normal(size=(12, 12, 12))
    values[[0, -1]] = values[:, [0, -1]] = values[:, :, [0, -1]] = 1.0
    low, high = np.zeros(3), np.full(3, 11.0)
    vertices, faces = closed_mesh(lambda _: values.reshape(-1), low, high, 1.0)
    assert is_closed(faces)
    assert volume(vertices, faces) > 0.0


@pytest.mark.parametrize("edge", [0.08, 0.3], ids=["finer", "coarser"])
def test_remeshing_makes_even_triangles_of_the_wanted_size(edge):
    vertices, faces = closed_mesh(ball, LOW, HIGH, 0.15)
    vertices, faces = remesh(onto_ball(vertices), faces, edge, onto_ball, as_is)
    assert is_closed(faces)
    assert euler(vertices, faces) == 2
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0)
    lengths = np.linalg.norm(np.diff(vertices[edges_of(faces)], axis=1), axis=2)
    assert lengths.mean() == pytest.approx(edge, rel=0.12)
    assert edge_variation(vertices, faces) < 0.15
    assert smallest_angles(vertices, faces).min() > 25.0


def test_lengths_count_where_they_are_measured():
    shrink = np.array([0.5, 1.0, 1.0])

    def measured(points):
        turn = np.tile(np.diag(1.0 / shrink), (len(points), 1, 1))
        return points * shrink, turn

    vertices, faces = closed_mesh(ball, LOW, HIGH, 0.15)
    vertices, faces = remesh(onto_ball(vertices), faces, 0.1, onto_ball, measured)
    assert edge_variation(vertices * shrink, faces) < 0.15
    assert edge_variation(vertices, faces) > 0.2
