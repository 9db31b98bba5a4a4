"""Markers follow the hand's shape as differences say."""

import numpy as np
import pytest
from oracles import random_pose
from shapes import dense_shape_jacobian, random_model

from handclean.hand.model import marker_positions
from handclean.subject.shape import SIZE_NUMBERS, Shape, sections


@pytest.mark.parametrize("bones", [1, 3, 8])
def test_shape_jacobian_is_the_derivative_of_the_markers_by_the_shape(rng, bones):
    model = random_model(rng, bones)
    pose = random_pose(rng, model.tree)
    got = dense_shape_jacobian(model, pose)
    here = Shape(model=model, sizes=np.ones(SIZE_NUMBERS))
    h = 1e-6
    for n in range(got.shape[2]):
        step = np.zeros(got.shape[2])
        step[n] = h
        ahead = marker_positions(here.stepped(step).model, pose[None])[0]
        behind = marker_positions(here.stepped(-step).model, pose[None])[0]
        np.testing.assert_allclose(got[:, :, n], (ahead - behind) / (2 * h), atol=1e-8)


def test_tilting_an_axis_moves_nothing_while_the_angle_is_zero(rng):
    model = random_model(rng)
    pose = random_pose(rng, model.tree)
    pose[7:] = 0.0
    start, count = sections(model)[:2]
    tilts = dense_shape_jacobian(model, pose)[:, :, start : start + count]
    np.testing.assert_allclose(tilts, 0.0, atol=1e-15)
