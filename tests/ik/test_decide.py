"""Which postures markers and a prior decide, and for which frames an answer holds."""

import numpy as np
import pytest
from people import exercise

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import jacobian, marker_positions
from handclean.hand.subject import template_subject
from handclean.ik.decide import (
    DECIDED_SD,
    OFF_SUBSPACE_SD_RAD,
    REUSE_FRAMES,
    UNKNOWN_HINGE_SD_RAD,
    answers,
    is_expected,
    mark_decided_frames,
    precision_of,
)
from handclean.ik.frames import TakeMarkers, empty_fit
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import chain_of, prior_arrays
from handclean.io.hdf5.prior import read_prior
from handclean.kernels.gauss_newton import AnglePrior, make_workspace

NOISE_M, LEVER_M = SolveConfig().prior_m, SolveConfig().lever_m


@pytest.fixture(scope="module")
def model():
    return template_subject(load_marker_set("maycock26")).model


@pytest.fixture(scope="module")
def prior(model):
    mean, basis = prior_arrays(model, read_prior())
    return AnglePrior(mean, precision_of(basis), NOISE_M)


def near_the_mean(model, prior, frames):
    poses = exercise(np.random.default_rng(1), model.tree, frames, 100.0)
    poses[:, 7:] = np.clip(prior.mean, *model.tree.limits.T)
    return poses


def decided(model, prior, poses, targets, sure):
    """(T,) the answer where markers leave every hinge open, as far as they say."""
    fit = empty_fit(len(poses), len(prior.mean))
    fit.poses[:], fit.decided[:] = poses, sure
    work = make_workspace(len(prior.mean), targets.shape[1], 0)
    markers = TakeMarkers(targets, np.ones(targets.shape[1]))
    args = markers, chain_of(model), prior, LEVER_M, work, fit
    mark_decided_frames(*args)
    return fit.decided


def test_the_prior_allows_for_what_the_subspace_does_not_say(rng):
    basis = rng.normal(size=(4, 2))
    basis[3] = 0.0  # a hinge that the prior does not know
    want = basis @ basis.T
    want += np.diag([OFF_SUBSPACE_SD_RAD**2] * 3 + [UNKNOWN_HINGE_SD_RAD**2])
    np.testing.assert_allclose(np.linalg.inv(precision_of(basis)), want, atol=1e-12)


def test_an_expected_posture_is_a_newton_step_from_where_the_prior_has_it(model, rng):
    mean = np.zeros(len(model.tree.hinges))
    root = rng.normal(size=(len(mean), len(mean)))
    prior = AnglePrior(mean, root @ root.T + np.eye(len(mean)), NOISE_M)
    pose = near_the_mean(model, prior, 1)[0]
    pose[7:] = rng.normal(scale=0.3, size=len(mean))
    slope = jacobian(model, pose).reshape(-1, len(pose) - 1)[:9]
    matrix = slope.T @ slope / NOISE_M**2 + 1e-6 * np.eye(len(pose) - 1)
    matrix[6:, 6:] += prior.precision
    pull = np.r_[np.zeros(6), prior.precision @ (mean - pose[7:])]
    step = np.abs(np.linalg.solve(matrix, pull)[6:]).max()
    lower, work = np.linalg.cholesky(matrix), make_workspace(len(mean), 26)
    assert is_expected(pose, lower, prior, 1.01 * step, work)
    assert not is_expected(pose, lower, prior, 0.99 * step, work)


def test_an_answer_holds_for_the_same_markers_and_yes_for_more():
    then = np.array([1.0, 1.0, 0.0])
    more, less = np.ones(3), np.array([1.0, 0.0, 0.0])
    for known in (True, False):
        assert answers(then, then, known)
        assert answers(more, then, known) == known
        assert not answers(less, then, known)


def test_a_whole_hand_is_decided_and_one_without_a_finger_is_not(model, prior):
    poses = near_the_mean(model, prior, 90)
    targets = marker_positions(model, poses)
    ring = ["RING" in label for label in model.labels]
    targets[30:60, ring] = np.nan
    want = (np.arange(90) // 30) != 1
    found = decided(model, prior, poses, targets, sure=True)
    np.testing.assert_array_equal(found, want)


def test_too_few_markers_decide_nothing(model, prior):
    poses = near_the_mean(model, prior, 10)
    targets = marker_positions(model, poses)
    targets[4:6, 2:] = np.nan
    found = decided(model, prior, poses, targets, sure=True)
    np.testing.assert_array_equal(found, ~np.isin(np.arange(10), (4, 5)))


def test_a_posture_the_prior_does_not_expect_is_not_decided():
    """Bent the way that its markers tell least of, it fits them, but it is unlikely."""
    few = template_subject(load_marker_set("hoyet8")).model
    mean, basis = prior_arrays(few, read_prior())
    prior = AnglePrior(mean, precision_of(basis), NOISE_M)
    likely = near_the_mean(few, prior, 2 * REUSE_FRAMES)
    slope = jacobian(few, likely[0]).reshape(-1, 6 + len(mean)) / NOISE_M
    matrix = slope.T @ slope
    matrix[6:, 6:] += prior.precision
    loosest = np.linalg.eigh(np.linalg.inv(matrix)[6:, 6:])[1][:, -1]
    bent = likely.copy()
    bent[:, 7:] += 3.0 * DECIDED_SD.hinge_rad * loosest / np.abs(loosest).max()
    for poses, want in ((likely, True), (bent, False)):
        targets = marker_positions(few, poses)
        found = decided(few, prior, poses, targets, sure=True)
        assert (found == want).all()
