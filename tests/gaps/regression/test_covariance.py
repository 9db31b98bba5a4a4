"""The covariance of frames, against its formula written out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.gaps.regression import covariance as cov
from handclean.gaps.regression.covariance import (
    Rows,
    Scale,
    covariance,
    own_variance,
)


def rows(rng, count, size=6):
    return Rows(
        posture=rng.normal(size=(count, size)),
        slow=rng.normal(scale=0.01, size=(count, size)),
        quick=rng.normal(scale=0.002, size=(count, 2 * size)),
        frame=rng.integers(0, 3000, size=count),
    )


def written_out(left, s, right, t, centre, variance):
    """k(s, t) of the module's formula, number by number."""
    distance = np.linalg.norm(left.posture[s] - right.posture[t])
    apart = 1.2 * abs(left.frame[s] - right.frame[t])

    slow = (left.slow[s] - centre) @ (right.slow[t] - centre)
    return (
        1e-3
        + slow * (0.9 + 0.09 * np.exp(-(distance**2) / 2.0))
        + left.quick[s] @ right.quick[t]
        + variance * 0.05 * np.exp(-distance / 2.0 - apart / 200.0)
    )


def test_it_is_the_formula():
    rng = np.random.default_rng(1)
    left, right, centre = rows(rng, 5), rows(rng, 4), rng.normal(scale=0.01, size=6)
    found = covariance(left, right, Scale(centre, 1e-4, 1.2))
    for s in range(5):
        for t in range(4):
            expected = written_out(left, s, right, t, centre, 1e-4)
            assert found[s, t] == pytest.approx(expected, rel=1e-12)


@given(st.integers(0, 10**6), st.integers(2, 30))
def test_own_variance_is_its_diagonal_and_no_combination_has_less_than_none(
    seed, count
):
    rng = np.random.default_rng(seed)
    some, centre = rows(rng, count), rng.normal(scale=0.01, size=6)
    scale = Scale(centre, 1e-4, 1.0)
    square = covariance(some, some, scale)
    np.testing.assert_allclose(np.diag(square), own_variance(some, scale))
    half = covariance(some, some, scale, lower=True)
    np.testing.assert_array_equal(np.tril(square), np.tril(half))
    np.testing.assert_allclose(square, square.T, rtol=1e-12)
    assert np.linalg.eigvalsh(square)[0] > -1e-12


@pytest.mark.parametrize("term", ["RESIDUAL", "GLOBAL_SLOPE", "LOCAL_SLOPE"])
def test_every_term_counts(term, monkeypatch):
    rng = np.random.default_rng(2)
    some, centre = rows(rng, 6), np.zeros(6)
    scale = Scale(centre, 1e-4, 1.0)
    whole = covariance(some, some, scale)
    monkeypatch.setattr(cov, term, 0.0)
    assert np.abs(covariance(some, some, scale) - whole).max() > 1e-9
