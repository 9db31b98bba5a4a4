"""Condition numbers of small matrices against LAPACK."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.kernels.conditions import condition


def of(matrix):
    size = len(matrix)
    return condition(matrix.copy(), np.zeros(size), np.zeros(size))


@given(
    size=st.integers(1, 26),
    rows=st.integers(0, 30),
    spread=st.floats(0.0, 4.0),
    seed=st.integers(0, 1000),
)
def test_it_is_the_ratio_of_the_extreme_eigenvalues(size, rows, spread, seed):
    rng = np.random.default_rng(seed)
    tall = rng.normal(size=(size + rows, size)) * 10.0 ** rng.uniform(-spread, 0, size)
    matrix = tall.T @ tall
    values = np.linalg.eigvalsh(matrix)
    found = of(matrix)
    true = values[-1] / values[0]
    if 0.0 < true < 1e12:
        assert found == pytest.approx(true, rel=1e-9 + 1e-15 * size * true)
    else:
        assert not found < 1e11


@given(size=st.integers(2, 26), lacking=st.integers(1, 26), seed=st.integers(0, 1000))
def test_a_matrix_without_inverse_has_an_infinite_one(size, lacking, seed):
    rows = max(size - lacking, 0)
    wide = np.random.default_rng(seed).normal(size=(rows, size))
    assert of(wide.T @ wide) > 1e13


def test_nothing_is_ever_nan_or_below_one(rng):
    for matrix in (np.eye(9), np.diag(np.arange(9.0)), np.zeros((9, 9)), np.eye(1)):
        assert of(matrix) >= 1.0
    equal = rng.normal(size=(9, 9))
    equal[:, 4] = equal[:, 5]
    assert of(equal.T @ equal) > 1e13
    assert of(np.zeros((1, 1))) == math.inf


def test_the_scale_of_a_matrix_does_not_matter(rng):
    tall = rng.normal(size=(12, 9))
    once = of(tall.T @ tall)
    for scale in (1e-12, 1e12):
        assert of(scale * tall.T @ tall) == pytest.approx(once, rel=1e-9)
