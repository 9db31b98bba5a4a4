"""Affine combinations against the paper's formula."""

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.gaps.family import affine


def equation_8(place, others):
    """Oracle: as printed, seen from the centroid, in units of the markers' extent."""
    centre = others.mean(axis=0)
    unit = np.sqrt(((others - centre) ** 2).sum())
    x = np.hstack([(others - centre) / unit, np.ones((len(others), 1))])
    y = np.append((place - centre) / unit, 1.0)
    return y @ x.T @ np.linalg.inv(x @ x.T + 1e-8 * np.eye(len(others)))


def test_weights_are_those_of_equation_8(rng):
    for markers in (4, 5, 12):
        place, others = rng.normal(size=3), rng.normal(size=(markers, 3))
        weights = affine.weights_of(place, others)
        expected = equation_8(place, others)
        np.testing.assert_allclose(weights, expected, atol=1e-6)
        assert abs(weights.sum() - 1.0) < 1e-14
        np.testing.assert_allclose(weights @ others, place, atol=1e-5)


def test_four_markers_that_are_not_in_a_plane_give_the_one_solution():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    weights = affine.weights_of(np.array([0.2, 0.3, 0.4]), corners)
    np.testing.assert_allclose(weights, [0.1, 0.2, 0.3, 0.4], atol=1e-7)


def test_a_still_posture_is_restored_wherever_it_is_carried(bodies, rng):
    whole = bodies.whole(rng, 100, bend=0.0)
    fill = affine.prepare(bodies.without(whole, ([2, 5], 40, 70)))
    for marker in (2, 5):
        path = fill(bodies.gap(marker, 40, 70)).places
        np.testing.assert_allclose(path, whole[40:70, marker], atol=1e-7)


def test_no_marker_jumps_where_another_disappears_or_few_are_seen(bodies, rng):
    whole = bodies.whole(rng, 100, markers=6)
    tracks = bodies.without(whole, (0, 40, 70), (1, 50, 60), ([2, 3], 55, 80))
    path = affine.prepare(tracks)(bodies.gap(0, 40, 70)).places
    joined = np.concatenate([whole[39:40, 0], path])
    usual = np.linalg.norm(np.diff(whole, axis=0), axis=2).max()
    assert np.linalg.norm(np.diff(joined, axis=0), axis=1).max() < 3.0 * usual
    before = affine.weights_of(path[9], whole[49, 2:])  # marker 1 is gone from then on
    expected = before @ whole[50:55, 2:]
    np.testing.assert_allclose(path[10:15], expected, atol=1e-7)


def test_markers_in_a_plane_carry_one_beside_it_along(bodies, rng):
    flat = rng.normal(scale=0.04, size=(5, 3)) * [1.0, 1.0, 0.0]
    flat[4, 2] = 0.03
    turn = Rotation.from_rotvec([0.0, 0.0, 0.2]).as_matrix()
    whole = np.stack([flat, flat @ turn.T, flat + 0.1])
    tracks = bodies.without(whole, (4, 1, 3))
    path = affine.prepare(tracks)(bodies.gap(4, 1, 3)).places
    np.testing.assert_allclose(path, whole[1:, 4], atol=1e-7)
