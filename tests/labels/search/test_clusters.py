"""Clusters are what short steps link."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial.distance import cdist

from handclean.labels.clusters import cluster, cluster_candidates, longest_step

LINE = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.5, 0, 0], [2.5, 1.0, 0], [9.0, 0, 0]])
clouds = st.integers(0, 2**32 - 1).map(
    lambda seed: np.random.default_rng(seed).uniform(size=(12, 3))
)


def test_points_linked_by_steps_no_longer_than_the_radius_are_one_cluster():
    assert cluster(LINE, 1.0).tolist() == [0, 0, 1, 1, 2]
    assert cluster(LINE, 1.5).tolist() == [0, 0, 0, 0, 1]
    assert cluster(LINE, 0.5).tolist() == [0, 1, 2, 3, 4]


@given(points=clouds)
def test_clusters_are_the_connected_parts_of_the_graph_of_short_steps(points):
    number = connected_components(cdist(points, points) <= 0.3)[1]
    mine = cluster(points, 0.3)
    np.testing.assert_array_equal(
        mine[:, None] == mine[None], number[:, None] == number[None]
    )


@given(points=clouds)
def test_the_longest_step_is_that_of_the_shortest_tree(points):
    expected = minimum_spanning_tree(cdist(points, points)).max()
    assert longest_step(points) == pytest.approx(expected)
    assert (cluster(points, longest_step(points)) == 0).all()
    assert cluster(points, 0.999 * longest_step(points)).max() == 1


def test_candidates_are_the_clusters_at_growing_radii_and_everything_last():
    found = [rows.tolist() for rows in cluster_candidates(LINE, 1.1, 2)]
    assert found == [[0, 1], [2, 3], [0, 1, 2, 3], [0, 1, 2, 3, 4]]


def test_small_clusters_are_no_candidates():
    found = [rows.tolist() for rows in cluster_candidates(LINE, 1.1, 3)]
    assert found == [[0, 1, 2, 3], [0, 1, 2, 3, 4]]
    assert cluster_candidates(LINE, 1.1, 6) == []


def test_one_point_has_no_steps():
    assert longest_step(np.zeros((1, 3))) == 0.0
