"""Points turned by rotations, against scipy's."""

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.numerics.rotations import rotated, rotated_back


def test_each_point_is_turned_by_its_own_rotation_and_back(rng):
    turns = Rotation.from_rotvec(rng.normal(size=(12, 3)))
    points = rng.normal(size=(12, 3))
    matrices = turns.as_matrix()
    np.testing.assert_allclose(rotated(matrices, points), turns.apply(points))
    np.testing.assert_allclose(
        rotated_back(matrices, points), turns.apply(points, inverse=True)
    )


def test_one_set_of_points_is_turned_in_every_frame(rng):
    matrices = Rotation.random(20, random_state=3).as_matrix().reshape(4, 5, 3, 3)
    points = rng.normal(size=(5, 3))
    many = rotated(matrices, points)
    assert many.shape == (4, 5, 3)
    np.testing.assert_array_equal(many[2], rotated(matrices[2], points))
