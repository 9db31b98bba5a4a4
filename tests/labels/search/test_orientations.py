"""Orientations to start from: axes onto axes, and all others evenly."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.labels.search.orientations import (
    principal_axes,
    sign_combinations,
    spread_rotations,
)

BOX = np.array(
    [[x, y, z] for x in (-3.0, 3.0) for y in (-2.0, 2.0) for z in (-1.0, 1.0)]
)


def test_a_box_has_its_own_axes_and_extents(rng):
    turn, shift = Rotation.random(rng=rng), np.array([5.0, 6.0, 7.0])
    middle, axes, extents = principal_axes(turn.apply(BOX) + shift)
    np.testing.assert_allclose(middle, shift)
    np.testing.assert_allclose(extents, [6.0, 4.0, 2.0])
    np.testing.assert_allclose(np.abs(axes.T @ turn.as_matrix()), np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_signs_give_the_four_rotations_of_axes_onto_axes(rng):
    source, target = (r.as_matrix() for r in Rotation.random(2, rng=rng))
    turns = sign_combinations(source, target)
    for turn in turns:
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) == pytest.approx(1.0)
        np.testing.assert_allclose(
            np.abs(target.T @ turn @ source), np.eye(3), atol=1e-12
        )
    assert len({tuple(np.round(turn, 6).ravel()) for turn in turns}) == 4


@pytest.mark.parametrize(("count", "most"), [(30, 80.0), (300, 40.0)])
def test_no_orientation_is_far_from_all_of_an_even_spread(count, most, rng):
    spread = Rotation.from_matrix(spread_rotations(count))
    some = Rotation.random(500, rng=rng)
    away = np.degrees([(spread.inv() * one).magnitude().min() for one in some])
    assert away.max() < most
    assert spread_rotations(0).shape == (0, 3, 3)
