"""The sparse Gaussian process against dense formulas and the exact one."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose

from handclean.numerics.gp import sparse
from handclean.numerics.gp.exact import Evidence, posterior
from handclean.numerics.gp.kernels import Kernel
from handclean.numerics.gp.means import MEANS, basis
from handclean.numerics.gp.settings import FitSettings
from handclean.numerics.gp.sparse import SparseEvidence, sparse_posterior
from handclean.numerics.gp.train_sparse import spread_out, train_sparse

S = 3
SUMS = [("rbf",), ("lard", "seard"), ("seard", "seard"), ("poly2", "seard")]


def samples(rng, count):
    inputs = rng.normal(size=(count, S))
    targets = np.sin(inputs[:, 0]) + inputs[:, 1] + 0.3 * inputs[:, 2] * inputs[:, 0]
    return inputs, targets + 0.1 * rng.normal(size=count)


def hyperparameters(rng, kernel):
    logs = rng.normal(0.0, 0.3, kernel.size + 1)
    logs[-1] = -2.0
    return logs


def dense(kernel, logs, inputs, pseudo, jitter):
    """The covariance C, made entry by entry."""
    across = kernel.gram(logs[:-1], inputs, pseudo)
    among = kernel.gram(logs[:-1], pseudo, pseudo) + jitter * np.eye(len(pseudo))
    explained = across @ np.linalg.solve(among, across.T)
    lost = kernel.diagonal(logs[:-1], inputs) - np.diag(explained)
    diagonal = lost + np.exp(logs[-1])
    return explained + np.diag(diagonal), diagonal


def mean_weights(covariance, columns, targets):
    solved = np.linalg.solve(covariance, columns)
    if not columns.shape[1]:
        return np.zeros(0)
    return np.linalg.solve(columns.T @ solved, solved.T @ targets)


@pytest.mark.parametrize("mean", MEANS)
@pytest.mark.parametrize("terms", SUMS, ids="+".join)
def test_the_evidence_is_the_dense_ones_and_its_gradient_the_slope(terms, mean, rng):
    inputs, targets = samples(rng, 300)  # several chunks
    kernel = Kernel(terms, S)
    logs, pseudo = hyperparameters(rng, kernel), rng.normal(size=(12, S))
    evidence = SparseEvidence(kernel, mean, inputs, targets, len(pseudo))
    vector = np.concatenate([logs, pseudo.ravel()])
    value, gradient = evidence(vector)

    covariance, _ = dense(kernel, logs, inputs, pseudo, evidence.jitter)
    columns = basis(mean, inputs)
    left = targets - columns @ mean_weights(covariance, columns, targets)
    expected = 0.5 * (
        left @ np.linalg.solve(covariance, left)
        + np.linalg.slogdet(covariance)[1]
        + len(left) * np.log(2.0 * np.pi)
    )
    assert value == pytest.approx(expected, rel=1e-7)

    for place in range(len(vector)):
        move = np.zeros(len(vector))
        move[place] = 1e-5
        rise = evidence(vector + move)[0] - evidence(vector - move)[0]
        assert gradient[place] == pytest.approx(rise / 2e-5, rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("mean", MEANS)
def test_the_prediction_is_equation_19_with_the_mean_added(mean, rng):
    inputs, targets = samples(rng, 80)
    kernel = Kernel(("lard", "seard"), S)
    logs, pseudo = hyperparameters(rng, kernel), rng.normal(size=(10, S))
    evidence = SparseEvidence(kernel, mean, inputs, targets, len(pseudo))
    ready = sparse_posterior(evidence, logs, pseudo)
    covariance, diagonal = dense(kernel, logs, inputs, pseudo, evidence.jitter)
    columns = basis(mean, inputs)
    alpha = mean_weights(covariance, columns, targets)
    across = kernel.gram(logs[:-1], inputs, pseudo)
    among = kernel.gram(logs[:-1], pseudo, pseudo)
    q = among + across.T @ (across / diagonal[:, None])
    new = rng.normal(size=(8, S))
    k = kernel.gram(logs[:-1], new, pseudo)
    left = (targets - columns @ alpha) / diagonal
    expected = basis(mean, new) @ alpha + k @ np.linalg.solve(q, across.T @ left)
    gone = np.linalg.inv(among) - np.linalg.inv(q)
    variance = kernel.diagonal(logs[:-1], new) - np.diag(k @ gone @ k.T)
    found = ready.predict(new)
    assert_allclose(found[0], expected, rtol=1e-5, atol=1e-6)
    assert_allclose(found[1], variance, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("mean", MEANS)
def test_with_all_samples_as_pseudo_inputs_it_is_the_exact_model(mean, rng):
    inputs, targets = samples(rng, 60)
    kernel = Kernel(("lard", "seard"), S)
    logs = hyperparameters(rng, kernel)
    evidence = SparseEvidence(kernel, mean, inputs, targets, len(inputs))
    value, gradient = evidence(np.concatenate([logs, inputs.ravel()]))
    exact, by_logs = Evidence(kernel, mean, inputs, targets)(logs)
    assert value == pytest.approx(exact, abs=1e-4)
    assert_allclose(gradient[: len(logs)], by_logs, atol=1e-3)
    new = rng.normal(size=(9, S))
    found = sparse_posterior(evidence, logs, inputs).predict(new)
    expected = posterior(kernel, mean, logs, inputs, targets).predict(new)
    assert_allclose(found, expected, atol=1e-5)


def test_pseudo_inputs_that_coincide_are_survived(rng):
    inputs, targets = samples(rng, 50)
    kernel = Kernel(("lard", "seard"), S)
    logs = hyperparameters(rng, kernel)
    logs[: kernel.size] += 15.0  # so large that the jitter drowns in rounding
    evidence = SparseEvidence(kernel, "ml", inputs, targets, 20)
    vector = np.concatenate([logs, np.tile(inputs[:1], (20, 1)).ravel()])
    value, gradient = evidence(vector)
    assert np.isfinite(value)
    assert np.isfinite(gradient).all()
    assert evidence.jitter > sparse.JITTER_VARIANCES[0]


def test_pseudo_inputs_start_where_no_sample_is_far_from_all(rng):
    inputs, _ = samples(rng, 200)
    kernel = Kernel(("seard",), S)
    logs = np.zeros(kernel.size)
    chosen = spread_out(kernel, logs, inputs, 30)
    assert len(np.unique(chosen, axis=0)) == 30

    def left(pseudo):
        across = kernel.gram(logs, inputs, pseudo)
        among = kernel.gram(logs, pseudo, pseudo)
        return (1.0 - np.diag(across @ np.linalg.solve(among, across.T))).max()

    assert left(chosen) < min(left(inputs[begin : begin + 30]) for begin in (0, 60, 90))


def test_training_finds_better_pseudo_inputs_than_chance(rng):
    inputs, targets = samples(rng, 600)
    kernel = Kernel(("lard", "seard"), S)
    settings = FitSettings(pseudo_inputs=8, evaluations=60)
    trained = train_sparse(kernel, "ml", inputs, targets, settings, rng)
    evidence = SparseEvidence(kernel, "ml", inputs, targets, 8)
    vector = np.concatenate([trained.logs, trained.pseudo.ravel()])
    assert trained.value == pytest.approx(evidence(vector)[0], abs=1e-6)
    random = np.concatenate([trained.logs, inputs[:8].ravel()])
    assert trained.value < evidence(random)[0] - 20.0


def test_memory_grows_with_samples_times_pseudo_inputs(rng):
    inputs, targets = samples(rng, 20000)
    kernel = Kernel(("lard", "seard"), S)
    vector = np.concatenate([hyperparameters(rng, kernel), inputs[:40].ravel()])
    tracemalloc.start()
    value, _ = SparseEvidence(kernel, "ml", inputs, targets, 40)(vector)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert np.isfinite(value)
    assert peak < 5 * 8 * 20000 * 40
