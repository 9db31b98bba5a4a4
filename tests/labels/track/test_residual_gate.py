"""The threshold is the average plus a margin, and follows what is accepted."""

import numpy as np
import pytest

from handclean.labels.track.residual_gate import (
    learn_residual,
    threshold,
    usual_residuals,
)

SMALL_M = 1e-3


def test_the_first_averages_are_those_of_random_vectors(rng):
    lengths = np.linalg.norm(rng.normal(scale=3.0, size=(200_000, 3)), axis=1)
    rms = np.sqrt(np.mean(lengths**2))
    usual = usual_residuals(np.array([rms]), SMALL_M)
    assert usual.mean[0] == pytest.approx(lengths.mean(), rel=0.01)
    assert np.sqrt(usual.variance[0]) == pytest.approx(lengths.std(), rel=0.01)


def test_the_threshold_is_average_spread_and_a_small_term():
    usual = usual_residuals(np.array([1e-3, 2e-3]), SMALL_M)
    usual.mean[1], usual.variance[1] = 4e-3, 9e-6
    assert threshold(usual, 1, 2.0, SMALL_M) == pytest.approx(4e-3 + 6e-3 + 1e-3)


def test_averages_follow_the_distances_that_are_accepted(rng):
    usual = usual_residuals(np.array([2e-3, 2e-3]), SMALL_M)
    for distance in rng.normal(3e-3, 2e-4, size=1000):
        learn_residual(usual, 0, distance, 1.0)
    assert usual.mean[0] == pytest.approx(3e-3, rel=0.05)
    assert np.sqrt(usual.variance[0]) == pytest.approx(2e-4, rel=0.5)
    assert usual.mean[1] == usual_residuals(np.array([2e-3]), SMALL_M).mean[0]


def test_no_average_grows_beyond_its_limit():
    usual = usual_residuals(np.array([1e-3]), SMALL_M)
    for _ in range(2000):
        learn_residual(usual, 0, 0.1, 1.0)
    assert usual.mean[0] == usual.most[0] == 3e-3
    assert usual.variance[0] <= 0.25 * usual.most[0] ** 2


def test_a_distance_counts_up_to_a_limit():
    one, two = (usual_residuals(np.array([1e-3]), SMALL_M) for _ in range(2))
    learn_residual(one, 0, 5.0, 2e-3)
    learn_residual(two, 0, 2e-3, 2e-3)
    assert one.mean[0] == two.mean[0]
    assert one.variance[0] == two.variance[0]
