"""The motion of a body in all frames against one alignment at a time."""

import numpy as np
import pytest

from handclean.gaps.body import motion_onto
from handclean.numerics.procrustes import align


@pytest.mark.parametrize("flat", [False, True])
def test_each_frame_is_laid_as_one_alignment_would(rng, flat):
    points, reference = rng.normal(size=(40, 5, 3)), rng.normal(size=(5, 3))
    if flat:  # the determinant decides which of two rotations is proper
        points[:, :, 2] = reference[:, 2] = 0.0
    motion = motion_onto(points, reference)
    laid = motion.to_body(points)
    for frame, here in enumerate(points):
        expected = align(here, reference).apply(here)
        np.testing.assert_allclose(laid[frame], expected, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(motion.turn), 1.0, atol=1e-12)


def test_places_go_back_where_they_came_from(rng):
    points = rng.normal(size=(40, 5, 3))
    motion = motion_onto(points, points[3])
    places = rng.normal(size=(40, 3))
    there = motion.to_body(places[:, None])[:, 0]
    np.testing.assert_allclose(motion.to_laboratory(there), places, atol=1e-12)
