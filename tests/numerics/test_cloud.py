import numpy as np

from handclean.numerics.cloud import (
    clusters,
    crowded,
    neighbours,
    plane_normals,
    thinned,
    turned_along,
)


def ball(rng, count=2000, radius=0.05):
    out = rng.normal(size=(count, 3))
    return radius * out / np.linalg.norm(out, axis=1, keepdims=True)


def test_normals_of_a_ball_look_along_its_radii(rng):
    points = ball(rng)
    out = points / 0.05
    found = plane_normals(points)
    assert np.abs(np.sum(found * out, axis=1)).min() > 0.95
    turned = turned_along(found, out)
    assert np.sum(turned * out, axis=1).min() > 0.95


def test_neighbours_are_those_of_a_full_table(rng):
    points = rng.normal(size=(30, 3))
    table = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(table, np.inf)
    away, rows = neighbours(points, 4)
    np.testing.assert_allclose(away, np.sort(table, axis=1)[:, :4])
    np.testing.assert_array_equal(rows, np.argsort(table, axis=1)[:, :4])


def test_lonely_points_are_found(rng):
    points = np.vstack([ball(rng), [[0.2, 0.2, 0.2], [0.0, 0.0, 0.08]]])
    kept = crowded(points, 10, 6.0)
    assert not kept[-2:].any()
    assert kept[:-2].mean() > 0.98


def test_clusters_are_numbered_by_size(rng):
    small, big = ball(rng, 300) + np.array([0.2, 0.0, 0.0]), ball(rng, 3000)
    label = clusters(np.vstack([small, big]), 0.02)
    assert set(label[:300]) == {1}
    assert set(label[300:]) == {0}


def test_a_gap_narrower_than_asked_for_is_bridged(rng):
    points = np.zeros((50, 3))
    points[:, 0] = 0.001 * np.arange(50) + 0.0037
    points[25:, 0] += 0.008
    assert clusters(points, 0.01).max() == 0
    assert clusters(points, 0.003).max() == 1


def test_thinning_keeps_few_points_untouched_and_both_ends(rng):
    np.testing.assert_array_equal(thinned(np.zeros((5, 3)), 9), np.arange(5))
    rows = thinned(np.zeros((1000, 3)), 7)
    assert len(rows) == 7
    assert rows[0] == 0
    assert rows[-1] == 999
