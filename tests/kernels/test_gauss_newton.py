"""The solver's parts against dense matrices, and its optimum against scipy's."""

from dataclasses import replace

import numpy as np
import pytest
from oracles import random_pose, random_tree
from scipy.optimize import least_squares

from handclean.hand import model as hand_model
from handclean.hand.model import Model
from handclean.ik.solve import chain_of
from handclean.kernels import gauss_newton as gn


def random_model(rng, bones=8, markers=20):
    tree = random_tree(rng, bones)
    return Model(
        tree=tree,
        labels=tuple(f"m{m}" for m in range(markers)),
        bone=rng.integers(0, bones, markers),
        at=rng.normal(scale=0.02, size=(markers, 3)),
    )


@pytest.fixture(params=[1, 4, 12])
def problem(request, rng):
    """A model, a pose, targets near it, weights with zeros, and the dense system."""
    model = random_model(rng, request.param)
    pose = random_pose(rng, model.tree)
    target = hand_model.marker_positions(model, pose[None])[0]
    target += rng.normal(scale=0.01, size=target.shape)
    weight = rng.random(len(target)) + 0.2
    weight[3] = 0.0
    target[3] = np.nan
    jacobian = hand_model.jacobian(model, pose)
    error = target - hand_model.marker_positions(model, pose[None])[0]
    error[3] = 0.0
    normal = np.einsum("mid,m,mie->de", jacobian, weight, jacobian)
    right = np.einsum("mid,m,mi->d", jacobian, weight, error)
    cost = (weight[:, None] * error**2).sum()
    return model, pose, target, weight, normal, right, cost


def prepared(model, pose, target, weight):
    work = gn.make_workspace(len(model.tree.hinges), len(target))
    tree = chain_of(model)
    fit = gn.misfit(pose, gn.Observations(target, weight), tree, work)
    return fit, tree, work


def solved(model, pose, target, control):
    """Solve for a pose in place, all hinges free; return the cost."""
    zeros = np.zeros(len(model.tree.hinges))
    seen = gn.Observations(target, np.ones(len(target)))
    work = gn.make_workspace(len(zeros), len(target))
    anchor = gn.Anchor(zeros, zeros)
    return gn.solve_full(pose, seen, anchor, chain_of(model), control, work).cost


def test_cost_and_right_hand_side_are_those_of_the_jacobian(problem):
    model, pose, target, weight, _, right, want = problem
    fit, tree, work = prepared(model, pose, target, weight)
    np.testing.assert_allclose(fit.cost, want, rtol=1e-12)
    got = gn.right_hand_side(fit, weight, tree, work)
    np.testing.assert_allclose(got, right, atol=1e-12)


def test_normal_matrix_is_the_jacobians_and_empty_between_branches(problem):
    model, pose, target, weight, normal, _, _ = problem
    fit, tree, work = prepared(model, pose, target, weight)
    got = np.tril(gn.normal_matrix(fit, weight, tree, work))
    np.testing.assert_allclose(got, np.tril(normal), atol=1e-12)


def test_step_solves_the_dense_system(problem):
    model, pose, target, weight, normal, right, _ = problem
    fit, tree, work = prepared(model, pose, target, weight)
    damping, step = 1e-4, np.full(len(right), np.nan)
    factors = gn.normal_matrix(fit, weight, tree, work)
    factors[np.diag_indices(len(right))] += damping
    gn.factorise(tree, factors)
    gradient = gn.right_hand_side(fit, weight, tree, work)
    promise = gn.substitute(tree, factors, gradient, step)
    want = np.linalg.solve(normal + damping * np.eye(len(right)), right)
    np.testing.assert_allclose(step, want, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(promise, want @ right, rtol=1e-8)


def test_result_is_the_optimum_a_general_solver_finds(rng):
    for _ in range(5):
        model = random_model(rng, 6, 24)
        truth = random_pose(rng, model.tree)
        target = hand_model.marker_positions(model, truth[None])[0]
        target += rng.normal(scale=0.001, size=target.shape)
        start = hand_model.moved(truth, rng.normal(scale=0.05, size=len(truth) - 1))

        def residual(step, model=model, start=start, target=target):
            pose = hand_model.moved(start, step)
            return (target - hand_model.marker_positions(model, pose[None])[0]).ravel()

        best = least_squares(
            residual, np.zeros(len(truth) - 1), xtol=1e-14, ftol=1e-14, gtol=1e-14
        )
        cost = solved(model, start, target, gn.StepControl(1e-12, 1e-9, 50))
        assert np.sqrt(cost) <= 1.01 * np.sqrt(2 * best.cost) + 1e-9


def test_angles_stay_within_limits_and_a_held_joint_is_the_best_there(rng):
    model = random_model(rng, 3, 12)
    while len(model.tree.hinges) == 0:
        model = random_model(rng, 3, 12)
    pose = random_pose(rng, model.tree)
    pose[7:] = 2.5  # [rad] beyond the limits of 2.0
    target = hand_model.marker_positions(model, pose[None])[0]
    pose[7:] = 1.9
    solved(model, pose, target, gn.StepControl(1e-9, 1e-9, 60))
    assert (pose[7:] <= 2.0).all()
    assert (pose[7:] >= -2.0).all()
    assert (pose[7:] > 1.9).any()


def test_no_bounded_solver_improves_on_a_result_at_limits(rng):
    held = 0
    for _ in range(6):
        model = random_model(rng, 5, 20)
        tree, hinges = model.tree, len(model.tree.hinges)
        truth = random_pose(rng, tree)
        target = hand_model.marker_positions(model, truth[None])[0]
        limits = np.tile([-0.25, 0.25], (hinges, 1))
        model = replace(model, tree=replace(tree, limits=limits))
        pose = truth.copy()
        pose[7:] = np.clip(truth[7:], -0.2, 0.2)
        cost = solved(model, pose, target, gn.StepControl(1e-12, 1e-9, 100))
        assert (np.abs(pose[7:]) <= 0.25).all()
        held += (np.abs(pose[7:]) == 0.25).sum()

        def residual(step, model=model, pose=pose, target=target):
            moved = hand_model.moved(pose, step)
            return (target - hand_model.marker_positions(model, moved[None])[0]).ravel()

        free = np.full(6, np.inf)
        low = np.concatenate([-free, limits[:, 0] - pose[7:] - 1e-9])
        high = np.concatenate([free, limits[:, 1] - pose[7:] + 1e-9])
        best = least_squares(
            residual, np.zeros(6 + hinges), bounds=(low, high),
            xtol=1e-14, ftol=1e-14, gtol=1e-14,
        )  # fmt: skip
        assert np.sqrt(cost) <= 1.01 * np.sqrt(2 * best.cost) + 1e-6
    assert held > 0


def test_subspace_gradient_is_that_of_the_chain_rule(problem, rng):
    model, pose, target, weight, normal, right, _ = problem
    hinges, directions = len(model.tree.hinges), 2
    basis = rng.normal(size=(hinges, directions))
    work = gn.make_workspace(hinges, len(target), directions)
    tree, alpha = chain_of(model), np.array([0.3, -0.2])
    fit = gn.misfit(pose, gn.Observations(target, weight), tree, work)
    subspace = gn.Subspace(np.zeros(hinges), basis, np.sqrt(1e-3))
    reduced = gn.reduce_to_subspace(
        gn.normal_matrix(fit, weight, tree, work),
        gn.right_hand_side(fit, weight, tree, work),
        subspace,
        alpha,
        0.0,
        work,
    )
    mapping = np.zeros((6 + hinges, 6 + directions))
    mapping[:6, :6] = np.eye(6)
    mapping[6:, 6:] = basis
    want = mapping.T @ normal @ mapping
    want[6:, 6:] += 1e-3 * np.eye(directions)
    pull = mapping.T @ right
    pull[6:] -= 1e-3 * alpha
    np.testing.assert_allclose(np.tril(reduced.matrix), np.tril(want), atol=1e-12)
    np.testing.assert_allclose(reduced.right, pull, atol=1e-12)


def test_markers_and_prior_decide_what_the_dense_covariance_says(problem, rng):
    model, pose, target, weight, normal, _, _ = problem
    hinges, noise = len(model.tree.hinges), 5e-4
    if hinges == 0:
        pytest.skip("nothing to be decided")
    root = rng.normal(size=(hinges, hinges))
    precision = root @ root.T + 4.0 * np.eye(hinges)
    whole = normal / noise**2
    whole[6:, 6:] += precision
    deviations = np.sqrt(np.diag(np.linalg.inv(whole)))
    worst = deviations[3:6].max(), deviations[6:].max()
    prior = gn.AnglePrior(np.zeros(hinges), precision, noise)
    for share, want in (((1.01, 1.01), True), ((0.99, 9.0), False), ((9.0, 0.99), 0)):
        fit, tree, work = prepared(model, pose, target, weight)
        most = gn.SpreadLimits(worst[0] * share[0], worst[1] * share[1])
        made = gn.factored_information(fit, weight, prior, tree, work)
        assert made.positive
        assert gn.is_spread_within(made.lower, most, work) == bool(want)
