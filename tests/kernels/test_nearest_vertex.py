"""The nearest of many points against looking at all of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.kernels.nearest_vertex import make_waiting, nearest_point
from handclean.layouts.particles import point_tree


@given(count=st.integers(1, 300), seed=st.integers(0, 1000), flat=st.booleans())
def test_it_is_as_near_as_the_nearest_of_all(count, seed, flat):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) * [1.0, 2.0, 0.0 if flat else 0.3]
    points[rng.random(count) < 0.2] = points[0]
    order, tree = point_tree(points)
    np.testing.assert_array_equal(np.sort(order), np.arange(count))
    np.testing.assert_array_equal(tree.points, points[order])
    waiting = make_waiting()
    for target in rng.normal(size=(20, 3)) * 2.0:
        start = int(rng.integers(count))
        found = nearest_point(*target, start, tree, waiting)
        away = np.linalg.norm(points - target, axis=1)
        assert np.linalg.norm(tree.points[found] - target) == pytest.approx(away.min())
