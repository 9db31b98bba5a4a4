"""How uncertain postures are, against dense matrices and against sampling."""

import numpy as np
from oracles import random_pose, random_tree

from handclean.gaps.uncertainty import spread
from handclean.hand.model import Model, jacobian, marker_positions, moved


def random_model(rng, bones=8, markers=7):
    return Model(
        tree=random_tree(rng, bones),
        labels=tuple(f"m{m}" for m in range(markers)),
        bone=rng.integers(0, bones, markers),
        at=rng.normal(scale=0.02, size=(markers, 3)),
    )


def test_spread_is_that_of_dense_matrices(rng):
    model = random_model(rng)
    poses = np.array([random_pose(rng, model.tree) for _ in range(5)])
    seen, asked = rng.random((5, 7)) < 0.6, rng.random((5, 7)) < 0.5
    weight = seen / rng.uniform(1e-4, 1e-3, 7) ** 2
    precision = rng.uniform(1.0, 100.0, (5, 6 + len(model.tree.hinges)))
    variance, distance = spread(model, poses, weight, precision, asked)
    for t, pose in enumerate(poses):
        columns = jacobian(model, pose)
        matrix = np.diag(precision[t])
        for m in range(7):
            matrix += weight[t, m] * columns[m].T @ columns[m]
        inverse = np.linalg.inv(matrix)
        np.testing.assert_allclose(variance[t], np.diag(inverse), rtol=1e-6)
        for m in range(7):
            want = np.trace(columns[m] @ inverse @ columns[m].T) if asked[t, m] else 0
            np.testing.assert_allclose(distance[t, m], want, rtol=1e-6)


def test_a_hidden_marker_is_as_far_off_as_its_variance_says(rng):
    model = random_model(rng)
    pose = random_pose(rng, model.tree)
    dofs = len(pose) - 1
    precision = np.full((1, dofs), 1e8)  # small steps, about which all is linear
    asked = np.ones((1, 7), dtype=bool)
    distance = spread(model, pose[None], np.zeros((1, 7)), precision, asked)[1][0]
    steps = rng.normal(scale=1e-4, size=(4000, dofs))
    there = marker_positions(model, np.array([moved(pose, step) for step in steps]))
    away = there - marker_positions(model, pose[None])
    np.testing.assert_allclose(np.mean(np.sum(away**2, 2), 0), distance, rtol=0.1)


def test_what_is_seen_lowers_every_variance(rng):
    model = random_model(rng)
    poses = random_pose(rng, model.tree)[None]
    precision = np.ones((1, poses.shape[1] - 1))
    ask = np.zeros((1, 7), dtype=bool)
    blind = spread(model, poses, np.zeros((1, 7)), precision, ask)[0]
    seeing = spread(model, poses, np.full((1, 7), 1e6), precision, ask)[0]
    assert np.all(seeing <= blind * (1 + 1e-12))
    np.testing.assert_allclose(blind, 1.0)
