"""Where on a scan vertices belong."""

import numpy as np
import pytest

from handclean.errors import ShapeError
from handclean.subject.scan.cloud import Cloud, Scan

UP = np.array([0.0, 0.0, 1.0])


def sheet(rng, count=4000, noise=0.0, hole=0.0):
    """A flat square of 10 cm, looking up."""
    points = rng.uniform(-0.05, 0.05, (count, 3))
    points[:, 2] = rng.normal(scale=noise, size=count) if noise else 0.0
    points = points[np.hypot(points[:, 0], points[:, 1]) >= hole]
    return Cloud(points=points, normals=np.tile(UP, (len(points), 1)))


def above(rng, count=200, height=0.003, wide=0.04):
    at = rng.uniform(-wide, wide, (count, 3))
    at[:, 2] = height
    return at


def test_vertices_belong_at_their_feet(rng):
    at = above(rng)
    pairs = sheet(rng).pairs(at, np.tile(UP, (len(at), 1)), 0.01, 0.9)
    assert len(pairs.rows) > 0.9 * len(at)
    expected = at[pairs.rows] * [1.0, 1.0, 0.0]
    np.testing.assert_allclose(pairs.places, expected, atol=1e-12)


def test_noise_of_the_points_averages_out(rng):
    at = above(rng)
    pairs = sheet(rng, noise=0.0005).pairs(at, np.tile(UP, (len(at), 1)), 0.01, 0.9)
    assert pairs.places[:, 2].std() < 0.0005 / 2.0


def test_points_that_look_elsewhere_are_no_counterparts(rng):
    at, cloud = above(rng), sheet(rng)
    for angle, there in ((0.8, True), (1.0, False), (np.pi, False)):
        normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
        pairs = cloud.pairs(at, np.tile(normal, (len(at), 1)), 0.01, 0.9)
        assert (len(pairs.rows) > 0) == there


def test_points_out_of_reach_are_no_counterparts(rng):
    at, cloud = above(rng), sheet(rng)
    up = np.tile(UP, (len(at), 1))
    assert len(cloud.pairs(at, up, 0.002, 0.9).rows) == 0
    assert len(cloud.pairs(at, up, 0.006, 0.9).rows) > 0


def test_skin_over_a_hole_is_left_alone(rng):
    cloud = sheet(rng, hole=0.01)
    at = above(rng, height=0.001, wide=0.005)
    pairs = cloud.pairs(at, np.tile(UP, (len(at), 1)), 0.02, 0.9)
    assert len(pairs.rows) < 0.02 * len(at)  # in the very middle sides balance


def test_landmarks_snap_onto_the_sheet(rng):
    at = above(rng, 20, 0.002)
    snapped = sheet(rng).snapped(at)
    np.testing.assert_allclose(snapped, at * [1.0, 1.0, 0.0], atol=1e-12)


def test_a_scan_has_a_normal_and_a_color_for_every_point():
    points = np.zeros((4, 3))
    with pytest.raises(ShapeError):
        Scan(points=points, normals=np.zeros((3, 3)))
    with pytest.raises(ShapeError):
        Scan(points=points, colors=np.zeros((4, 4), dtype=np.uint8))
