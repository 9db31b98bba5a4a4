"""A swarm's move against equations 10 and 11 of Schroeder 2016."""

import numpy as np

from handclean.kernels.swarm import Pull, Swarm, swarm_move
from handclean.layouts.particles import point_tree


def test_markers_go_to_the_candidate_nearest_to_where_they_are_pulled(rng):
    _, tree = point_tree(rng.normal(size=(80, 3)))
    size, markers = 20, 4
    now, best = rng.integers(0, 80, (2, size, markers))
    leader = rng.integers(0, 80, markers)
    velocity = rng.normal(size=(size, markers, 3)) * 0.2
    draws, (w, c1, c2) = rng.random((size, 2)), (0.73, 2.8, 1.3)
    points = tree.points
    here = points[now]
    pulled = c1 * draws[:, :1, None] * (points[best] - here)
    pulled += c2 * draws[:, 1:, None] * (points[leader] - here)
    target = here + w * (velocity + pulled)
    away = np.linalg.norm(target[:, :, None] - points, axis=3)
    swarm = Swarm(now, velocity, best, np.zeros(size))
    swarm_move(tree, swarm, leader, draws, Pull(w, c1, c2))
    np.testing.assert_array_equal(now, away.argmin(axis=2))
    np.testing.assert_array_equal(velocity, points[now] - here)
