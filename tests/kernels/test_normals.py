"""Normals of a mesh against the plain formula."""

import numpy as np
import pytest

from handclean.hand import surface as plain
from handclean.kernels import normals


def some_mesh(rng):
    """Vertices and faces of no particular shape; the last vertex has no face."""
    return rng.normal(size=(20, 3)), rng.integers(0, 19, (40, 3))


def test_normals_are_those_of_the_plain_formula(rng):
    vertices, faces = some_mesh(rng)
    got = np.full((20, 3), np.nan)
    normals.vertex_normals(vertices, faces, got)
    np.testing.assert_allclose(got, plain.vertex_normals(vertices, faces), atol=1e-12)
    assert got[19] == pytest.approx(0.0)


def test_the_jacobian_of_unit_normals_is_their_derivative(rng):
    vertices, faces = some_mesh(rng)
    moves = rng.normal(size=(20, 3, 4))
    sums, d_sums = np.full((20, 3), np.nan), np.full((20, 3, 4), np.nan)
    normals.normal_sums(vertices, faces, sums)
    normals.normal_sums_jacobian(vertices, moves, faces, d_sums)
    normals.unit_jacobian(sums, d_sums)
    np.testing.assert_allclose(sums, plain.vertex_normals(vertices, faces), atol=1e-12)
    h = 1e-6
    for d in range(4):
        ahead = plain.vertex_normals(vertices + h * moves[:, :, d], faces)
        behind = plain.vertex_normals(vertices - h * moves[:, :, d], faces)
        want = (ahead - behind) / (2.0 * h)
        np.testing.assert_allclose(d_sums[:19, :, d], want[:19], atol=1e-6)
    np.testing.assert_array_equal(d_sums[19], 0.0)
