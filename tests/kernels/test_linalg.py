"""The Cholesky factor and what is solved with it, beside numpy and scipy."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import cho_solve, solve_triangular

from handclean.kernels import linalg

seeds, sizes = st.integers(0, 10**6), st.integers(1, 12)


def positive(seed, size):
    """A positive definite matrix whose upper triangle nobody may read."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(size, size))
    whole = root @ root.T + 0.1 * np.eye(size)
    lower = np.tril(whole)
    lower[np.triu_indices(size, 1)] = np.nan
    return whole, lower, rng


@given(seed=seeds, size=sizes)
def test_the_factor_is_numpys(seed, size):
    whole, lower, _ = positive(seed, size)
    assert linalg.factor(lower)
    np.testing.assert_allclose(np.tril(lower), np.linalg.cholesky(whole), rtol=1e-9)
    assert np.isnan(lower[np.triu_indices(size, 1)]).all()


@given(seed=seeds, size=sizes, columns=st.integers(0, 4))
def test_triangular_solves_are_scipys(seed, size, columns):
    whole, _, rng = positive(seed, size)
    lower = np.linalg.cholesky(whole)
    rows, vector = rng.normal(size=(size, columns)), rng.normal(size=size)
    for solve, given_, transposed in (
        (linalg.forward, rows, 0),
        (partial(linalg.forward_vector, first=0), vector, 0),
        (linalg.backward, vector, 1),
        (linalg.backward_by_rows, vector, 1),
    ):
        got = given_.copy()
        solve(lower, got)
        want = solve_triangular(lower, given_, lower=True, trans=transposed)
        np.testing.assert_allclose(got, want, rtol=1e-8, atol=1e-10)


@given(seed=seeds, size=sizes)
def test_zeros_before_the_first_number_stay(seed, size):
    whole, _, rng = positive(seed, size)
    lower, first = np.linalg.cholesky(whole), size // 2
    vector = rng.normal(size=size)
    vector[:first] = 0.0
    part, all_of_it = vector.copy(), vector.copy()
    linalg.forward_vector(lower, part, first)
    linalg.forward_vector(lower, all_of_it, 0)
    np.testing.assert_array_equal(part, all_of_it)


@given(seed=seeds, size=sizes)
def test_equations_are_solved_as_scipy_does(seed, size):
    whole, lower, rng = positive(seed, size)
    vector = rng.normal(size=size)
    want = cho_solve((np.linalg.cholesky(whole), True), vector)
    assert linalg.solve(lower, vector)
    np.testing.assert_allclose(vector, want, rtol=1e-7, atol=1e-9)


@given(seed=seeds, size=sizes)
def test_the_inverse_is_the_inverse_and_symmetric(seed, size):
    whole, lower, _ = positive(seed, size)
    out = np.full((size, size), np.nan)
    assert linalg.invert(lower, out)
    np.testing.assert_allclose(out @ whole, np.eye(size), atol=1e-8)
    np.testing.assert_array_equal(out, out.T)


@pytest.mark.parametrize("worst", [0.0, -1.0, np.nan])
def test_what_is_not_positive_definite_is_refused(worst):
    square = np.diag([2.0, worst, 3.0])
    vector, out = np.arange(3.0), np.zeros((3, 3))
    assert not linalg.factor(square.copy())
    assert not linalg.solve(square.copy(), vector)
    np.testing.assert_array_equal(vector, np.arange(3.0))
    assert not linalg.invert(square.copy(), out)
    assert np.isnan(out).all()
