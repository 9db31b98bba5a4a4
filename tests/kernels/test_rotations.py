"""Rotations against scipy's and the laws of the group."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from handclean.kernels import rotations

vectors = arrays(float, 3, elements=st.floats(-4.0, 4.0))


def exp(v):
    out = np.full(4, np.nan)
    rotations.exponential(np.asarray(v, float), out)
    return out


def log(q):
    out = np.full(3, np.nan)
    rotations.logarithm(q, out)
    return out


def matrix(q):
    out = np.full((3, 3), np.nan)
    rotations.matrix_from_quaternion(q, out)
    return out


@given(v=vectors)
def test_exponential_agrees_with_scipy(v):
    np.testing.assert_allclose(
        matrix(exp(v)), Rotation.from_rotvec(v).as_matrix(), atol=1e-12
    )


@given(v=vectors, size=st.sampled_from([1e-12, 1e-8, 1e-4, 1.0, np.pi - 1e-9]))
def test_logarithm_undoes_exponential_also_near_zero_and_pi(v, size):
    if np.linalg.norm(v) < 1e-3:
        return
    v = v / np.linalg.norm(v) * size
    np.testing.assert_allclose(log(exp(v)), v, atol=1e-7 * max(size, 1e-5))


@given(v=vectors)
def test_both_signs_of_a_quaternion_are_one_rotation(v):
    q = exp(v)
    np.testing.assert_allclose(matrix(exp(log(q))), matrix(exp(log(-q))), atol=1e-9)


@given(v=vectors)
def test_a_matrix_gives_its_quaternion_back(v):
    q = exp(v)
    back = np.full(4, np.nan)
    rotations.quaternion_from_matrix(matrix(q), back)
    assert back[0] >= 0.0
    np.testing.assert_allclose(matrix(back), matrix(q), atol=1e-12)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_turns_survive_the_matrix(axis):
    q = np.concatenate([[0.0], axis])
    back = np.full(4, np.nan)
    rotations.quaternion_from_matrix(matrix(q), back)
    np.testing.assert_allclose(abs(back @ q), 1.0, atol=1e-12)


@given(v=vectors, w=vectors)
def test_composition_is_the_product_of_matrices(v, w):
    out = np.full(4, np.nan)
    rotations.compose(exp(v), exp(w), out)
    np.testing.assert_allclose(matrix(out), matrix(exp(v)) @ matrix(exp(w)), atol=1e-12)


@given(v=vectors, w=vectors)
def test_the_product_of_many_is_that_of_each(v, w):
    many = rotations.product(np.stack([exp(v)] * 3, axis=1), np.stack([exp(w)] * 3, 1))
    each = np.full(4, np.nan)
    rotations.compose(exp(v), exp(w), each)
    np.testing.assert_allclose(np.array(many).T, [each] * 3, atol=1e-15)
