"""Alignment recovers known motions, and nothing near its answer is better."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from handclean.errors import ShapeError
from handclean.numerics.procrustes import align

seeds = st.integers(0, 10_000)


def cost(source, target, weights, rotvec, translation, scale):
    """Oracle: the weighted sum of squares, as it is written."""
    turned = scale * Rotation.from_rotvec(rotvec).apply(source) + translation
    return float(np.sum(weights * np.sum((target - turned) ** 2, axis=1)))


def problem(seed, points=7):
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(2, points, 3))
    return rng, source, target, rng.uniform(0.05, 3.0, points)


@given(seed=seeds, scaled=st.booleans())
def test_a_known_motion_comes_back(seed, scaled):
    rng, source, _, weights = problem(seed)
    turn = Rotation.random(random_state=seed)
    scale = rng.uniform(0.3, 3.0) if scaled else 1.0
    shift = rng.normal(size=3)
    target = scale * turn.apply(source) + shift
    got = align(source, target, weights, scaled=scaled)
    np.testing.assert_allclose(got.rotation, turn.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(got.translation, shift, atol=1e-9)
    assert got.scale == pytest.approx(scale, abs=1e-9)
    assert got.rms < 1e-9
    np.testing.assert_allclose(got.apply(source), target, atol=1e-9)


@given(seed=seeds, scaled=st.booleans())
def test_no_perturbed_motion_has_a_lower_weighted_cost(seed, scaled):
    rng, source, target, weights = problem(seed)
    got = align(source, target, weights, scaled=scaled)
    rotvec = Rotation.from_matrix(got.rotation).as_rotvec()
    best = cost(source, target, weights, rotvec, got.translation, got.scale)
    assert best == pytest.approx(weights.sum() * got.rms**2)
    for size in (1e-3, 0.1, 1.0):
        turned = rotvec + size * rng.normal(size=3)
        moved = got.translation + size * rng.normal(size=3)
        scale = got.scale * (1.0 + size * rng.uniform(-0.5, 0.5) * scaled)
        assert best <= cost(source, target, weights, turned, moved, scale) + 1e-12


def test_a_general_minimiser_finds_nothing_better():
    _, source, target, weights = problem(4)
    got = align(source, target, weights)
    starts = [Rotation.random(random_state=k).as_rotvec() for k in range(8)]
    found = min(
        minimize(
            lambda x: cost(source, target, weights, x[:3], x[3:], 1.0),
            np.concatenate([start, np.zeros(3)]),
        ).fun
        for start in starts
    )
    assert weights.sum() * got.rms**2 == pytest.approx(found, rel=1e-6)


@given(seed=seeds)
def test_the_rotation_never_reflects_even_for_mirrored_points(seed):
    _, source, _, weights = problem(seed)
    got = align(source, source * [-1.0, 1.0, 1.0], weights)
    assert np.linalg.det(got.rotation) == pytest.approx(1.0)


@given(seed=seeds)
def test_points_of_weight_zero_do_not_matter_even_if_missing(seed):
    _, source, target, weights = problem(seed)
    weights[[1, 4]] = 0.0
    keep = weights > 0
    want = align(source[keep], target[keep], weights[keep])
    source[1], target[4] = np.nan, np.nan
    got = align(source, target, weights)
    np.testing.assert_allclose(got.rotation, want.rotation, atol=1e-12)
    np.testing.assert_allclose(got.translation, want.translation, atol=1e-12)


def test_two_points_are_enough_for_a_proper_answer():
    source = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    target = np.array([[2.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    got = align(source, target)
    np.testing.assert_allclose(got.apply(source), target, atol=1e-12)
    assert np.linalg.det(got.rotation) == pytest.approx(1.0)


def test_no_weight_at_all_is_an_error():
    with pytest.raises(ShapeError, match="weights should hold at least one positive"):
        align(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(2))
