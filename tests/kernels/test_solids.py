"""Distances and lines of sight against dense sampling."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.kernels import solids

SOLIDS = [
    (solids.BOX, [0.02, 0.03, 0.01, 0.002]),
    (solids.BOX, [0.0, 0.0, 0.0, 0.03]),
    (solids.CYLINDER, [0.02, 0.0, 0.05, 0.001]),
    (solids.ELLIPSOID, [0.02, 0.03, 0.05, 0.0]),
]
kinds = pytest.mark.parametrize(("kind", "size"), SOLIDS)


def dense(p, q, count=4001):
    return p + np.linspace(0.0, 1.0, count)[:, None] * (q - p)


def signed(points, kind, size):
    """Signed distance by brute force: nearest of many surface points."""
    size = np.asarray(size, dtype=float)
    return np.array([solids.solid_distance(*p, kind, size) for p in points])


def inside(points, kind, size):
    """Membership by the definition of each kind."""
    x, y, z = np.abs(points).T
    a, b, c, e = size
    if kind == solids.ELLIPSOID:
        return (x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2 < 1.0
    if kind == solids.CYLINDER:
        gaps = [np.hypot(x, y) - a, z - c]
    else:
        gaps = [x - a, y - b, z - c]
    return np.sqrt(sum(np.maximum(g, 0.0) ** 2 for g in gaps)) < e


@kinds
def test_the_distance_is_negative_inside_and_only_there(rng, kind, size):
    points = rng.uniform(-0.06, 0.06, (3000, 3))
    np.testing.assert_array_equal(
        signed(points, kind, size) < 0.0, inside(points, kind, size)
    )


@kinds
def test_the_distance_leads_to_the_surface(rng, kind, size):
    points = rng.uniform(-0.08, 0.08, (300, 3))
    far = signed(points, kind, size)
    points, far = points[far > 0.0], far[far > 0.0]
    h = 1e-6
    slope = np.stack(
        [
            (signed(points + h * e, kind, size) - signed(points - h * e, kind, size))
            for e in np.eye(3)
        ],
        axis=1,
    )
    slope /= np.linalg.norm(slope, axis=1, keepdims=True)
    near = np.abs(signed(points - far[:, None] * slope, kind, size))
    exact = kind != solids.ELLIPSOID
    assert near.max() < (1e-8 if exact else 0.02)


@kinds
def test_the_smallest_distance_on_a_segment_is_that_of_many_points(rng, kind, size):
    size = np.array(size)
    for _ in range(40):
        p, q = rng.uniform(-0.08, 0.08, (2, 3))
        got = solids.segment_solid_distance(p, q, kind, size)
        want = signed(dense(p, q), kind, size).min()
        assert got == pytest.approx(want, abs=3e-5)


@kinds
def test_a_segment_meets_a_solid_where_one_of_its_points_is_inside(rng, kind, size):
    met = 0
    for _ in range(200):
        p, q = rng.uniform(-0.08, 0.08, (2, 3))
        depth = signed(dense(p, q), kind, size).min()
        if abs(depth) < 1e-5:
            continue
        got = solids.segment_meets_solid(p, q, kind, np.array(size))
        assert got == (depth < 0.0)
        met += got
    assert 10 < met < 190


unit = st.floats(-1.0, 1.0)
point = st.tuples(unit, unit, unit).map(np.array)


@given(p=point, q=point, a=point, b=point)
def test_segments_are_as_far_apart_as_their_nearest_points(p, q, a, b):
    got = solids.segments_distance(p, q, a, b)
    one, two = dense(p, q, 201), dense(a, b, 201)
    want = np.linalg.norm(one[:, None] - two[None], axis=2).min()
    step = (np.linalg.norm(q - p) + np.linalg.norm(b - a)) / 200
    assert got <= want + 1e-9
    assert got >= want - step


def test_cameras_see_what_no_point_of_the_line_of_sight_denies(rng):
    markers = rng.uniform(-0.05, 0.05, (3, 6, 3))
    cameras = rng.normal(size=(5, 3))
    start, stop = rng.uniform(-0.05, 0.05, (2, 3, 4, 3))
    radius = rng.uniform(0.005, 0.015, 4)
    turns = np.linalg.qr(rng.normal(size=(3, 2, 3, 3)))[0]
    frames = np.concatenate([turns, rng.uniform(-0.03, 0.03, (3, 2, 3, 1))], axis=3)
    kind, size = np.array([0, 2]), np.array([SOLIDS[0][1], SOLIDS[3][1]])
    got = np.ones((3, 6, 5), dtype=bool)
    reach = np.linalg.norm(size[:, :3], axis=1) + size[:, 3]
    capsules = solids.Capsules(start, stop, radius)
    things = solids.Solids(frames, kind, size, reach)
    solids.sightlines(markers, cameras, capsules, things, got)
    doubtful = 0
    for t, m, c in np.ndindex(got.shape):
        line = dense(markers[t, m], cameras[c], 3001)
        gap = np.inf
        for k in range(4):
            axis = stop[t, k] - start[t, k]
            along = np.clip((line - start[t, k]) @ axis / (axis @ axis), 0, 1)
            foot = start[t, k] + along[:, None] * axis
            gap = min(gap, np.linalg.norm(line - foot, axis=1).min() - radius[k])
        for o in range(2):
            local = (line - frames[t, o, :, 3]) @ frames[t, o, :, :3]
            gap = min(gap, signed(local[:600], kind[o], size[o]).min())
        if abs(gap) < 5e-4:
            doubtful += 1
            continue
        assert got[t, m, c] == (gap > 0.0)
    assert doubtful < 10
    assert 5 < got.sum() < 85
