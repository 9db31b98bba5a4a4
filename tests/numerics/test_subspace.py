"""Principal components against the eigenvectors of the covariance."""

import numpy as np
import pytest

from handclean.errors import HandcleanError
from handclean.numerics.subspace import covered, misfit, principal_components


@pytest.fixture
def samples(rng):
    spread = np.diag([3.0, 2.0, 1.0, 0.5, 0.1])
    turn = np.linalg.qr(rng.normal(size=(5, 5)))[0]
    return rng.normal(size=(400, 5)) @ spread @ turn + rng.normal(size=5)


def test_directions_are_the_eigenvectors_of_the_covariance(samples):
    found = principal_components(samples)
    values, vectors = np.linalg.eigh(np.cov(samples.T))
    np.testing.assert_allclose(found.deviations**2, values[::-1], rtol=1e-10)
    np.testing.assert_allclose(
        np.abs((found.components * vectors[:, ::-1]).sum(axis=0)), 1.0, atol=1e-10
    )
    np.testing.assert_allclose(found.share, values[::-1] / values.sum())
    np.testing.assert_allclose(found.mean, samples.mean(axis=0))


def test_signs_do_not_depend_on_the_order_of_samples(samples, rng):
    one = principal_components(samples)
    two = principal_components(samples[rng.permutation(len(samples))])
    np.testing.assert_allclose(one.components, two.components, atol=1e-9)
    largest = np.abs(one.components).argmax(axis=0)
    assert (one.components[largest, range(5)] > 0.0).all()


def test_fewer_samples_than_dimensions_give_fewer_directions(rng):
    found = principal_components(rng.normal(size=(3, 8)))
    product = found.components.T @ found.components
    np.testing.assert_allclose(product, np.eye(3), atol=1e-12)
    assert found.deviations[2] == pytest.approx(0.0, abs=1e-12)


def test_what_is_covered_adds_up_to_the_shares_of_the_own_samples(samples):
    found = principal_components(samples)
    shares = covered(found.components, samples)
    np.testing.assert_allclose(shares, np.cumsum(found.share), rtol=1e-10)
    assert shares[-1] == pytest.approx(1.0)


def test_what_is_covered_of_others_is_one_less_what_projection_leaves(samples, rng):
    found = principal_components(samples, 2)
    others = rng.normal(size=(50, 5)) + 3.0
    away = others - others.mean(axis=0)
    left = away - away @ found.components @ found.components.T
    want = 1.0 - (left**2).sum() / (away**2).sum()
    assert covered(found.components, others)[-1] == pytest.approx(want)


def test_the_misfit_is_the_distance_from_the_subspace(samples, rng):
    found = principal_components(samples, 3)
    others = rng.normal(size=(50, 5)) + 3.0
    away = others - found.mean
    got = misfit(found.mean, found.components, others)
    for k in range(4):
        basis = found.components[:, :k]
        left = away - away @ basis @ basis.T
        assert got[k] == pytest.approx(np.sqrt((left**2).mean()))


def test_samples_that_do_not_vary_are_refused():
    with pytest.raises(HandcleanError, match="vary"):
        principal_components(np.ones((5, 3)))
    with pytest.raises(HandcleanError, match="2"):
        principal_components(np.ones((1, 3)))
    with pytest.raises(HandcleanError, match="vary"):
        covered(np.eye(3), np.ones((5, 3)))
