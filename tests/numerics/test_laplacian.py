import numpy as np
import pytest
import trimesh
from scipy.sparse import identity
from scipy.spatial.transform import Rotation

from handclean.numerics.laplacian import Dissected, laplacian, turns_of_rings


def flat_patch(rng, size=9):
    x, y = np.meshgrid(np.arange(size), np.arange(size))
    at = np.column_stack([x.ravel(), y.ravel(), np.zeros(size**2)]).astype(float)
    at[:, :2] += rng.uniform(-0.3, 0.3, (size**2, 2))
    corner = np.arange(size**2).reshape(size, size)
    a, b, c, d = (
        part.ravel()
        for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    )
    inner = np.zeros((size, size), dtype=bool)
    inner[1:-1, 1:-1] = True
    return at, np.vstack([np.c_[a, b, c], np.c_[a, c, d]]), inner.ravel()


def ball(subdivisions=2, radius=1.0):
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.array(mesh.vertices), np.array(mesh.faces)


def test_the_laplacian_of_a_linear_function_on_a_flat_mesh_is_zero(rng):
    at, faces, inner = flat_patch(rng)
    turned = Rotation.random(rng=rng).apply(at)
    of = laplacian(turned, faces)
    linear = turned @ rng.normal(size=3) + 3.0
    np.testing.assert_allclose((of.matrix @ linear)[inner], 0.0, atol=1e-11)


def test_the_laplacian_of_a_square_on_a_flat_mesh_is_minus_two(rng):
    """sum over inner vertices, where uneven triangles average out."""
    at, faces, inner = flat_patch(rng, 30)
    of = laplacian(at, faces)
    found = (of.matrix @ at[:, 0] ** 2)[inner]
    mean = np.average(found, weights=of.areas[inner])
    assert mean == pytest.approx(-2.0, rel=0.03)


def test_areas_sum_to_that_of_the_mesh():
    at, faces = ball(3, 2.0)
    of = laplacian(at, faces)
    assert of.areas.sum() == pytest.approx(4 * np.pi * 4.0, rel=0.02)


def test_the_laplacian_of_a_ball_looks_out_by_twice_its_curvature():
    at, faces = ball(3, 2.0)
    found = laplacian(at, faces).matrix @ at
    np.testing.assert_allclose(found, at / 2.0, atol=0.15)  # 12 vertices of five edges
    assert np.abs(found - at / 2.0).mean() < 0.01


def test_the_laplacian_is_symmetric_once_weighted_by_areas(rng):
    at, faces = ball(2)
    of = laplacian(at + rng.normal(scale=0.02, size=at.shape), faces)
    weighted = of.matrix.toarray() * of.areas[:, None]
    np.testing.assert_allclose(weighted, weighted.T, atol=1e-12)


def test_rings_recover_a_common_rotation(rng):
    at, faces = ball(2)
    at = at * [1.0, 2.0, 0.5] + rng.normal(scale=0.01, size=at.shape)
    turn = Rotation.random(rng=rng).as_matrix()
    found = turns_of_rings(at, at @ turn.T + 7.0, laplacian(at, faces))
    np.testing.assert_allclose(found, np.broadcast_to(turn, found.shape), atol=1e-9)


def test_rings_turn_but_never_mirror(rng):
    at, faces = ball(2)
    moved = at + rng.normal(scale=0.3, size=at.shape)
    found = turns_of_rings(at, moved, laplacian(at, faces))
    np.testing.assert_allclose(np.linalg.det(found), 1.0, atol=1e-9)


def test_no_other_rotation_carries_a_ring_better(rng):
    at, faces = ball(1)
    moved = at + rng.normal(scale=0.2, size=at.shape)
    of = laplacian(at, faces)

    def left_over(turns):
        was, now = at[of.heads] - at[of.tails], moved[of.heads] - moved[of.tails]
        off = now - np.einsum("hij,hj->hi", turns[of.heads], was)
        return np.bincount(of.heads, of.weights * np.sum(off**2, axis=1))

    best = turns_of_rings(at, moved, of)
    nudge = Rotation.from_rotvec(rng.normal(scale=0.05, size=(len(at), 3))).as_matrix()
    assert np.all(left_over(best) <= left_over(nudge @ best) + 1e-12)


def test_dissection_solves_what_a_dense_solver_solves(rng):
    at, faces = ball(3)
    of = laplacian(at, faces)
    square = (of.matrix.T @ of.matrix + identity(len(at))).tocsr()
    solver = Dissected(square, at)
    right = rng.normal(size=(len(at), 3))
    for factor in (1.0, 3.0):
        matrix = (square + factor * identity(len(at))).tocsr()
        solver.factor(matrix)
        expected = np.linalg.solve(matrix.toarray(), right)
        np.testing.assert_allclose(solver.solve(right), expected, rtol=1e-8, atol=1e-12)
