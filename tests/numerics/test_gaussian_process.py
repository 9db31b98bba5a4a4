"""The exact Gaussian process against the textbook's formulas and finite differences."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize

from handclean.errors import UnknownNameError
from handclean.numerics.gp.descent import descend
from handclean.numerics.gp.exact import BLOCK_ROWS, Evidence, posterior
from handclean.numerics.gp.kernels import TERMS, Kernel
from handclean.numerics.gp.means import MEANS, basis
from handclean.numerics.gp.settings import FitSettings
from handclean.numerics.gp.train import bounds, train_exact

S = 3
SUMS = [
    ("lard",),
    ("rbf",),
    ("seard",),
    ("poly2",),
    ("poly3",),
    ("lard", "seard"),
    ("seard", "seard"),
    ("poly2", "seard"),
]
FORMULAS = {
    "lard": lambda h, a, b: (h * a * b).sum(),
    "rbf": lambda h, a, b: h[0] * np.exp(-0.5 * h[1] * ((a - b) ** 2).sum()),
    "seard": lambda h, a, b: h[0] * np.exp(-0.5 * (h[1:] * (a - b) ** 2).sum()),
    "poly2": lambda h, a, b: (h[0] + (h[1:] * a * b).sum()) ** 2,
    "poly3": lambda h, a, b: (h[0] + (h[1:] * a * b).sum()) ** 3,
}


def slope(function, at, step=1e-5):
    """Central differences of a function, entry by entry of its argument."""
    found = np.zeros(at.shape)
    for place in np.ndindex(at.shape):
        move = np.zeros(at.shape)
        move[place] = step
        found[place] = (function(at + move) - function(at - move)) / (2.0 * step)
    return found


def samples(rng, count):
    inputs = rng.normal(size=(count, S))
    targets = np.sin(inputs[:, 0]) + inputs[:, 1] + 0.3 * inputs[:, 2] * inputs[:, 0]
    return inputs, targets + 0.1 * rng.normal(size=count)


def hyperparameters(rng, kernel):
    logs = rng.normal(0.0, 0.5, kernel.size + 1)
    logs[-1] = -2.0
    return logs


def textbook(covariance, columns, targets):
    """Negative log evidence with an explicit inverse, and alpha and a."""
    inverse = np.linalg.inv(covariance)
    alpha = np.zeros(columns.shape[1])
    if len(alpha):
        normal = columns.T @ inverse @ columns
        alpha = np.linalg.solve(normal, columns.T @ inverse @ targets)
    left = targets - columns @ alpha
    _, size = np.linalg.slogdet(covariance)
    value = 0.5 * (left @ inverse @ left + size + len(left) * np.log(2.0 * np.pi))
    return value, alpha, inverse @ left


@pytest.mark.parametrize("name", TERMS)
def test_a_terms_matrix_has_its_formula_in_every_entry(name, rng):
    term = TERMS[name]
    logs = rng.normal(size=len(term.names(S)))
    a, b = rng.normal(size=(4, S)), rng.normal(size=(5, S))
    expected = [[FORMULAS[name](np.exp(logs), p, q) for q in b] for p in a]
    assert_allclose(term.gram(logs, a, b), expected, rtol=1e-12)
    alone = [FORMULAS[name](np.exp(logs), p, p) for p in a]
    assert_allclose(term.diagonal(logs, a), alone, rtol=1e-12)


@pytest.mark.parametrize("terms", SUMS, ids="+".join)
def test_pull_is_the_derivative_of_the_matrix(terms, rng):
    kernel = Kernel(terms, S)
    logs = rng.normal(0.0, 0.5, kernel.size)
    a, b, up = rng.normal(size=(6, S)), rng.normal(size=(5, S)), rng.normal(size=(6, 5))
    by_logs, by_b = kernel.pull(logs, a, b, kernel.grams(logs, a, b), up)
    expected = slope(lambda x: (up * kernel.gram(x, a, b)).sum(), logs)
    assert_allclose(by_logs, expected, rtol=1e-6, atol=1e-7)
    expected = slope(lambda x: (up * kernel.gram(logs, a, x)).sum(), b)
    assert_allclose(by_b, expected, rtol=1e-6, atol=1e-7)
    expected = slope(lambda x: up[:, 0] @ kernel.diagonal(x, a), logs)
    found = kernel.pull_diagonal(logs, a, up[:, 0])
    assert_allclose(found, expected, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("mean", MEANS)
@pytest.mark.parametrize("terms", SUMS, ids="+".join)
def test_the_evidence_is_the_textbooks_and_its_gradient_the_slope(terms, mean, rng):
    inputs, targets = samples(rng, 40)
    kernel = Kernel(terms, S)
    logs = hyperparameters(rng, kernel)
    evidence = Evidence(kernel, mean, inputs, targets)
    value, gradient = evidence(logs)
    covariance = kernel.gram(logs[:-1], inputs, inputs)
    covariance += np.exp(logs[-1]) * np.eye(len(inputs))
    expected, _, _ = textbook(covariance, basis(mean, inputs), targets)
    assert value == pytest.approx(expected, rel=1e-9)
    assert evidence.jitter == 0.0
    expected = slope(lambda x: evidence(x)[0], logs)
    assert_allclose(gradient, expected, rtol=1e-5, atol=1e-5)


def test_samples_in_several_blocks_count_like_those_in_one(rng):
    inputs, targets = samples(rng, 2 * BLOCK_ROWS + 37)
    kernel = Kernel(("lard", "seard"), S)
    logs = hyperparameters(rng, kernel)
    evidence = Evidence(kernel, "ml", inputs, targets)
    value, gradient = evidence(logs)
    covariance = kernel.gram(logs[:-1], inputs, inputs)
    covariance += np.exp(logs[-1]) * np.eye(len(inputs))
    assert value == pytest.approx(
        textbook(covariance, basis("ml", inputs), targets)[0], rel=1e-9
    )
    assert_allclose(gradient, slope(lambda x: evidence(x)[0], logs), rtol=1e-5)


def test_the_means_weights_are_those_of_most_evidence(rng):
    inputs, targets = samples(rng, 30)
    kernel = Kernel(("rbf",), S)
    logs = hyperparameters(rng, kernel)
    ready = posterior(kernel, "ml", logs, inputs, targets)
    covariance = kernel.gram(logs[:-1], inputs, inputs)
    covariance += np.exp(logs[-1]) * np.eye(len(inputs))

    def cost(alpha):
        left = targets - basis("ml", inputs) @ alpha
        return 0.5 * left @ np.linalg.solve(covariance, left)

    assert_allclose(slope(cost, ready.alpha), 0.0, atol=1e-7)


@pytest.mark.parametrize("mean", MEANS)
@pytest.mark.parametrize("terms", SUMS, ids="+".join)
def test_the_prediction_is_the_textbooks_with_the_mean_added(terms, mean, rng):
    inputs, targets = samples(rng, 40)
    new = rng.normal(size=(7, S))
    kernel = Kernel(terms, S)
    logs = hyperparameters(rng, kernel)
    covariance = kernel.gram(logs[:-1], inputs, inputs)
    covariance += np.exp(logs[-1]) * np.eye(len(inputs))
    _, alpha, solved = textbook(covariance, basis(mean, inputs), targets)
    across = kernel.gram(logs[:-1], new, inputs)
    expected = basis(mean, new) @ alpha + across @ solved
    within = kernel.gram(logs[:-1], new, new)
    variance = np.diag(within - across @ np.linalg.inv(covariance) @ across.T)
    found = posterior(kernel, mean, logs, inputs, targets).predict(new)
    assert_allclose(found[0], expected, rtol=1e-7, atol=1e-7)
    assert_allclose(found[1], variance, rtol=1e-6, atol=1e-8)


def test_a_linear_covariance_is_bayesian_linear_regression(rng):
    inputs, targets = samples(rng, 50)
    new = rng.normal(size=(6, S))
    kernel = Kernel(("lard",), S)
    logs = hyperparameters(rng, kernel)
    prior, noise = np.diag(np.exp(-logs[:S])), np.exp(logs[-1])
    weights = np.linalg.inv(inputs.T @ inputs / noise + prior)
    mean, variance = posterior(kernel, "m0", logs, inputs, targets).predict(new)
    assert_allclose(mean, new @ weights @ inputs.T @ targets / noise, rtol=1e-9)
    assert_allclose(variance, np.diag(new @ weights @ new.T), rtol=1e-7)


def test_duplicate_samples_without_noise_are_survived_and_told(rng):
    inputs, targets = samples(rng, 30)
    inputs, targets = np.tile(inputs, (3, 1)), np.tile(targets, 3)
    kernel = Kernel(("rbf",), S)
    evidence = Evidence(kernel, "m0", inputs, targets)
    value, gradient = evidence(np.array([0.0, 0.0, -60.0]))
    assert np.isfinite(value)
    assert np.isfinite(gradient).all()
    assert evidence.jitter > 0.0


def test_an_unknown_term_or_mean_is_named(rng):
    with pytest.raises(UnknownNameError, match="did you mean seard"):
        Kernel(("sard",), S)
    with pytest.raises(UnknownNameError, match="mean function"):
        basis("m1", np.zeros((2, S)))


def rosenbrock(x):
    value = 100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2
    by_first = -400.0 * x[0] * (x[1] - x[0] ** 2) - 2.0 * (1.0 - x[0])
    return value, np.array([by_first, 200.0 * (x[1] - x[0] ** 2)])


def test_descend_follows_a_bent_valley_to_its_end():
    wide = np.full(2, 10.0)
    found = descend(rosenbrock, np.array([-1.2, 1.0]), -wide, wide, tolerance=1e-12)
    assert found.converged
    assert_allclose(found.point, 1.0, atol=1e-4)


def test_descend_stops_at_a_bound_that_it_is_pushed_against():
    found = descend(
        rosenbrock,
        np.array([-1.2, 0.2]),
        np.array([-2.0, -1.0]),
        np.array([2.0, 0.25]),
        tolerance=1e-12,
    )
    assert found.converged
    assert found.point[1] == 0.25
    assert found.point[0] == pytest.approx(0.5, abs=0.02)
    assert abs(found.gradient[0]) < 1e-3


def test_with_the_hessian_known_a_parabola_takes_one_step(rng):
    root = rng.normal(size=(5, 5))
    matrix, goal = root @ root.T + np.eye(5), rng.normal(size=5)

    def bowl(x):
        return 0.5 * (x - goal) @ matrix @ (x - goal), matrix @ (x - goal)

    wide = np.full(5, 100.0)
    start = goal + 0.5
    found = descend(bowl, start, -wide, wide, hessian=matrix, tolerance=1e-9)
    assert found.evaluations == 2
    assert_allclose(found.point, goal, atol=1e-9)


@pytest.mark.parametrize("terms", [("rbf",), ("lard", "seard")], ids="+".join)
def test_training_ends_where_a_plain_descent_with_all_samples_ends(terms, rng):
    inputs, targets = samples(rng, 300)
    kernel = Kernel(terms, S)
    settings = FitSettings(subset=32)
    trained = train_exact(kernel, "ml", inputs, targets, settings, rng)
    evidence = Evidence(kernel, "ml", inputs, targets)
    start = np.zeros(kernel.size + 1)
    start[-1] = np.log(0.1)
    plain = minimize(
        evidence,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=np.column_stack(bounds(kernel)),
    )
    assert trained.converged
    assert trained.value <= plain.fun + 0.01
    assert trained.value == pytest.approx(evidence(trained.logs)[0], abs=1e-9)
    assert trained.evaluations < plain.nfev


def test_scikit_learn_finds_no_more_evidence(rng):
    gaussian_process = pytest.importorskip("sklearn.gaussian_process")
    kernels = gaussian_process.kernels
    inputs, targets = samples(rng, 200)
    theirs = gaussian_process.GaussianProcessRegressor(
        kernels.ConstantKernel(1.0, (1e-6, 1e4)) * kernels.RBF(np.ones(S), (1e-2, 1e3))
        + kernels.WhiteKernel(0.1, (1e-8, 10.0)),
        alpha=0.0,
    ).fit(inputs, targets)
    kernel = Kernel(("seard",), S)
    trained = train_exact(kernel, "m0", inputs, targets, FitSettings(subset=64), rng)
    assert trained.value <= -theirs.log_marginal_likelihood_value_ + 0.01
    amplitude, noise = theirs.kernel_.k1.k1, theirs.kernel_.k2
    lengths = theirs.kernel_.k1.k2.length_scale
    logs = np.log([amplitude.constant_value, *(1.0 / lengths**2), noise.noise_level])
    value = Evidence(kernel, "m0", inputs, targets)(logs)[0]
    assert value == pytest.approx(-theirs.log_marginal_likelihood_value_, rel=1e-9)
    new = rng.normal(size=(20, S))
    mean, variance = posterior(kernel, "m0", logs, inputs, targets).predict(new)
    expected, deviation = theirs.predict(new, return_std=True)
    assert_allclose(mean, expected, rtol=1e-6)
    # theirs is of a measurement: the noise is one of its kernel's terms
    assert_allclose(variance + noise.noise_level, deviation**2, rtol=1e-6)


def test_what_a_subset_took_for_noise_is_found_with_all_samples(rng):
    """Ripples that are too short for the samples of the subset to follow."""
    inputs = rng.uniform(-1.7, 1.7, size=(1200, 2))
    targets = inputs[:, 0] + 0.5 * np.sin(6.0 * inputs[:, 0]) * inputs[:, 1]
    targets += 0.1 * rng.normal(size=1200)
    kernel = Kernel(("lard", "seard"), 2)
    settings = FitSettings(starts=1, subset=48)
    trained = train_exact(kernel, "ml", inputs, targets, settings, rng)
    assert np.exp(0.5 * trained.logs[-1]) == pytest.approx(0.1, rel=0.15)
