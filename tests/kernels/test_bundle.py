"""Equations of many frames: their parts, and the pose eliminated from them."""

import numpy as np
from oracles import random_pose
from shapes import body_for, dense_shape_jacobian, random_model

from handclean.hand import model as hand_model
from handclean.kernels import bundle, pose_fit
from handclean.subject.shape import sections


def scene(rng, frames=3, noise=0.002):
    model = random_model(rng)
    poses = np.array([random_pose(rng, model.tree) for _ in range(frames)])
    targets = hand_model.marker_positions(model, poses)
    targets += rng.normal(scale=noise, size=targets.shape)
    weights = rng.uniform(0.5e6, 2e6, targets.shape[:2])
    weights[0, 0] = 0.0
    return model, poses, targets, weights


def dense_equations(model, body, poses, targets, weights, soft):
    """Oracle: the whole system, poses first, from dense Jacobians and one product."""
    numbers, size = sum(sections(model)), 6 + len(model.tree.hinges)
    rows, rests = [], []
    for f, pose in enumerate(poses):
        by_pose = hand_model.jacobian(model, pose)
        by_shape = dense_shape_jacobian(model, pose)
        there = hand_model.marker_positions(model, pose[None])[0]
        residual = targets[f] - there
        share = 1.0 / (1.0 + soft * np.sum(residual**2, axis=1)) ** 2
        root = np.sqrt(weights[f] * share)
        for m in range(len(there)):
            row = np.zeros((3, size * len(poses) + numbers))
            row[:, size * f : size * (f + 1)] = root[m] * by_pose[m]
            row[:, size * len(poses) :] = root[m] * by_shape[m]
            rows.append(row)
            rests.append(root[m] * residual[m])
    jacobian, rest = np.concatenate(rows), np.concatenate(rests)
    square, slope = jacobian.T @ jacobian, jacobian.T @ rest
    for f, pose in enumerate(poses):
        for d, q in enumerate(pose[7:]):
            at = size * f + 6 + d
            square[at, at] += body.prior.hold[d]
            slope[at] += body.prior.hold[d] * (body.prior.centre[d] - q)
    return square, slope


def eliminated(body, poses, targets, weights, soft, damping, numbers):
    measured, room = bundle.Measured(targets, weights, soft), bundle.make_room(body)
    return bundle.eliminate(poses, measured, damping, body, room, numbers)


def test_the_cost_falls_along_the_slope_as_the_slope_says(rng):
    model, poses, targets, weights = scene(rng)
    body = body_for(model, hold=2.0, bound=5.0)
    poses[0, 7:] = 2.3  # beyond the limits
    room = bundle.make_room(body)
    size = poses.shape[1] - 1
    square, slope = np.full((size, size), np.nan), np.full(size, np.nan)
    soft = 0.05**-2
    bundle.frame_cost(poses[0], targets[0], weights[0], soft, body, room)
    bundle.pose_equations(poses[0], body, room, square, slope)
    h = 1e-6
    for a in range(size):
        step = np.zeros(size)
        step[a] = h
        costs = [
            bundle.frame_cost(
                hand_model.moved(poses[0], s), targets[0], weights[0], soft, body, room
            )
            for s in (step, -step)
        ]
        difference = (costs[0] - costs[1]) / (2 * h)
        np.testing.assert_allclose(-2 * slope[a], difference, rtol=1e-4, atol=1e-2)


def test_the_eliminated_step_equals_the_step_of_the_whole_system(rng):
    model, poses, targets, weights = scene(rng)
    body = body_for(model, hold=50.0)
    soft, numbers = 0.02**-2, sum(sections(model))
    part = eliminated(body, poses, targets, weights, soft, 0.0, numbers)
    stiff = 1e4 * np.eye(numbers)  # stands for the prior of the shape
    flat = part.reduced.reshape(-1, numbers)
    schur = part.square + stiff - flat.T @ flat
    slope = part.slope - flat.T @ part.rest.ravel()
    step = np.linalg.solve(schur, slope)
    after = bundle.follow(poses, part, step)

    square, whole = dense_equations(model, body, poses, targets, weights, soft)
    square[-numbers:, -numbers:] += stiff
    want = np.linalg.solve(square, whole)
    np.testing.assert_allclose(step, want[-numbers:], rtol=1e-5, atol=1e-9)
    size = poses.shape[1] - 1
    for f, pose in enumerate(poses):
        moved = hand_model.moved(pose, want[size * f : size * (f + 1)])
        np.testing.assert_allclose(after[f], moved, atol=1e-7)
    dense_schur = np.linalg.inv(np.linalg.inv(square)[-numbers:, -numbers:])
    np.testing.assert_allclose(schur, dense_schur, rtol=1e-4, atol=1e-3)


def test_a_pose_is_found_again_and_a_wild_marker_does_not_matter(rng):
    model, poses, targets, weights = scene(rng, noise=0.0)
    body = body_for(model, hold=1e-6)
    start = np.array(
        [hand_model.moved(p, rng.normal(0, 0.05, p.size - 1)) for p in poses]
    )
    targets[:, 3] += 0.5
    room, costs = bundle.make_room(body), np.zeros(len(poses))
    soft = 0.02**-2
    pose_fit.fit_poses(start, targets, weights, soft, 200, body, room, costs)
    places = hand_model.marker_positions(model, start)
    away = np.linalg.norm(places - targets, axis=2)
    away[0, 0] = 0.0
    assert np.delete(away, 3, axis=1).max() < 1e-3
    assert away[:, 3].min() > 0.1


def test_pose_sigmas_are_those_of_the_inverse(rng):
    model, poses, targets, weights = scene(rng)
    body = body_for(model, hold=3.0)
    room, out = bundle.make_room(body), np.full((3, poses.shape[1] - 1), np.nan)
    pose_fit.pose_sigmas(poses, targets, weights, 0.0, body, room, out)
    for f, pose in enumerate(poses):
        flat = hand_model.jacobian(model, pose)
        square = np.einsum("m,mia,mib->ab", weights[f], flat, flat)
        square[6:, 6:] += 3.0 * np.eye(square.shape[0] - 6)
        want = np.sqrt(np.diag(np.linalg.inv(square)))
        np.testing.assert_allclose(out[f], want, rtol=1e-5)


def test_damping_shortens_the_step_of_a_pose(rng):
    model, poses, targets, weights = scene(rng)
    body = body_for(model, hold=1.0)
    numbers = sum(sections(model))
    still = np.zeros(numbers)
    lengths = []
    for damping in (0.0, 1.0, 100.0):
        part = eliminated(body, poses, targets, weights, 0.0, damping, numbers)
        after = bundle.follow(poses, part, still)
        lengths.append(np.linalg.norm(after[:, 7:] - poses[:, 7:]))
    assert lengths[0] > lengths[1] > lengths[2]


def test_no_marker_of_weight_zero_enters_any_equation(rng):
    model, poses, targets, weights = scene(rng)
    body = body_for(model, hold=1.0)
    numbers = sum(sections(model))
    weights[:, 2] = 0.0
    want = eliminated(body, poses, targets, weights, 0.0, 0.0, numbers)
    targets[:, 2] = 1e6
    got = eliminated(body, poses, targets, weights, 0.0, 0.0, numbers)
    for one, other in zip(got, want, strict=True):
        np.testing.assert_array_equal(one, other)
