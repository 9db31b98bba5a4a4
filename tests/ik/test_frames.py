"""One frame and its neighbours: the parts of frame-by-frame inverse kinematics."""

import math

import numpy as np
import pytest
from people import exercise

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik import frames
from handclean.ik.frames import (
    HINGE_STEP_SD_RAD,
    MAX_STEP_COST,
    PoseProblem,
    TakeMarkers,
    empty_fit,
    extrapolate,
    multi_start,
    open_hinges_of,
    resolve_backwards,
    rms,
    solve_frame,
    solve_frames,
    step_cost,
    weigh_markers,
)
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import chain_of, prior_arrays, start_postures
from handclean.io.hdf5.prior import read_prior
from handclean.kernels.gauss_newton import (
    ALL_DECIDED,
    HINGES_OPEN,
    ROOT_OPEN,
    Observations,
    StepControl,
    Subspace,
    make_workspace,
)

SETTINGS = SolveConfig()


class Hand:
    """The template hand with its markers, and all that the kernels want."""

    def __init__(self, name="maycock26", prior=None):
        self.model = template_subject(load_marker_set(name)).model
        self.mean, basis = prior_arrays(self.model, prior)
        self.labels = self.model.labels
        self.hinges = self.model.tree.hinges
        self.problem = PoseProblem(
            chain_of(self.model),
            Subspace(self.mean, basis, SETTINGS.prior_m),
            StepControl(SETTINGS.damping, SETTINGS.enough_m, SETTINGS.iterations),
            SETTINGS.lever_m,
        )
        self.starts = start_postures(self.model, self.mean)
        self.work = make_workspace(len(self.mean), len(self.labels), basis.shape[1])

    def poses(self, rng, count):
        return exercise(rng, self.model.tree, count, 100.0)

    def seen(self, pose, hidden=""):
        """Observations of one pose, without the markers of a finger."""
        weight = np.ones(len(self.labels))
        if hidden:
            weight[[hidden in label for label in self.labels]] = 0.0
        return Observations(marker_positions(self.model, pose[None])[0], weight)

    def openness(self, pose, seen):
        out = np.ones(len(self.mean), dtype=bool)
        return open_hinges_of(pose, seen, self.problem, self.work, out)

    def solved(self, pose, seen, max_open_step=math.inf):
        open_now = self.openness(pose, seen)
        return solve_frame(pose, seen, open_now, self.problem, self.work, max_open_step)

    def of(self, finger):
        return np.array([finger in name for name in self.hinges])


@pytest.fixture
def hand():
    return Hand()


def test_markers_in_sight_keep_their_weights_and_the_others_have_none():
    target = np.zeros((4, 3))
    target[1, 2] = np.nan
    weight, out = np.array([1.0, 2.0, 3.0, 0.0]), np.zeros(4)
    first = weigh_markers(target, weight, out)
    assert out.tolist() == [1.0, 0.0, 3.0, 0.0]
    assert (first.markers, first.unchanged) == (2, False)
    assert weigh_markers(target, weight, out) == (2, True)


def test_the_rms_counts_markers_that_are_there():
    error = np.array([[3e-3, 4e-3, 0.0], [np.nan] * 3, [0.0, 0.0, 5e-3]])
    assert rms(np.array([1.0, 0.0, 0.1]), error) == pytest.approx(5e-3)


def test_a_step_costs_its_square_up_to_the_price_of_a_jump():
    one, two = np.zeros(9), np.zeros(9)
    two[:7] = 1.0  # the root moves free
    two[7] = 2.0 * HINGE_STEP_SD_RAD
    assert step_cost(one, two) == pytest.approx(4.0)
    two[8] = 3.0
    assert step_cost(one, two) == pytest.approx(4.0 + MAX_STEP_COST)


def test_a_pose_moves_on_with_its_velocity_but_for_open_hinges():
    pose, velocity = np.zeros(9), np.full(9, 0.1)
    pose[3] = 1.0
    extrapolate(pose, velocity, np.array([True, False]))
    np.testing.assert_allclose(pose[[0, 1, 2, 7, 8]], [0.1, 0.1, 0.1, 0.0, 0.1])
    assert np.linalg.norm(pose[3:7]) == pytest.approx(1.0)
    np.testing.assert_allclose(pose[4:7] / pose[3], 0.1 / 1.1)


def test_what_a_frame_leaves_open_has_three_levels(hand, rng):
    pose = hand.poses(rng, 1)[0]
    assert hand.openness(pose, hand.seen(pose)).level == ALL_DECIDED
    found = hand.openness(pose, hand.seen(pose, "INDEX"))
    assert found.level == HINGES_OPEN
    np.testing.assert_array_equal(found.hinges, hand.of("index"))
    two = Observations(hand.seen(pose).target, np.zeros(len(hand.labels)))
    two.weight[:2] = 1.0
    assert hand.openness(pose, two).level == ROOT_OPEN


def test_a_frame_is_solved_from_a_pose_nearby(hand, rng):
    truth = hand.poses(rng, 1)[0]
    pose = truth.copy()
    pose[:3] += 0.01
    pose[7:] += 0.1
    seen = hand.seen(truth)
    found = hand.solved(pose, seen)
    np.testing.assert_allclose(pose[7:], truth[7:], atol=1e-3)
    away = marker_positions(hand.model, pose[None])[0] - seen.target
    np.testing.assert_allclose(found.error, -away, atol=1e-12)
    assert 0 < found.steps < SETTINGS.iterations


def test_open_hinges_keep_their_angles_without_a_subspace(hand, rng):
    truth = hand.poses(rng, 1)[0]
    pose, index = truth.copy(), np.r_[np.zeros(7, bool), hand.of("index")]
    pose[index] += 0.2
    pose[:3] += 0.01
    before = pose[index].copy()
    hand.solved(pose, hand.seen(truth, "INDEX"))
    np.testing.assert_allclose(pose[index], before, atol=1e-6)
    np.testing.assert_allclose(pose[~index][7:], truth[~index][7:], atol=1e-3)


def test_open_hinges_go_to_the_subspace_no_further_than_they_may(rng):
    hand = Hand(prior=read_prior())
    truth = hand.poses(rng, 1)[0]
    truth[7:] = hand.mean
    ring = np.r_[np.zeros(7, bool), hand.of("ring")]
    start = truth.copy()
    start[ring] = np.clip(start[ring] + 0.5, None, hand.model.tree.limits[ring[7:], 1])
    seen = hand.seen(truth, "RING")
    free, slow = start.copy(), start.copy()
    hand.solved(free, seen)
    hand.solved(slow, seen, max_open_step=0.05)
    np.testing.assert_allclose(free[ring], truth[ring], atol=0.05)
    assert np.abs(slow - start)[ring].max() == pytest.approx(0.05, abs=1e-3)


def test_of_several_starts_the_best_is_kept(hand, rng):
    truth = hand.poses(rng, 1)[0]
    seen, pose = hand.seen(truth), np.full(len(truth), np.nan)
    found = multi_start(pose, np.inf, hand.starts, seen, hand.problem, hand.work)
    assert found < 1e-5
    np.testing.assert_allclose(pose[7:], truth[7:], atol=2e-3)
    best = min(
        multi_start(truth.copy(), np.inf, one[None], seen, hand.problem, hand.work)
        for one in hand.starts
    )
    assert found == best


def test_a_pose_stays_where_no_start_leads_to_a_better_one(hand, rng):
    truth = hand.poses(rng, 1)[0]
    pose = truth.copy()
    seen = hand.seen(truth)
    assert multi_start(pose, 0.0, hand.starts, seen, hand.problem, hand.work) == 0.0
    np.testing.assert_array_equal(pose, truth)


def wrong_until(hand, poses, end):
    """A solved take whose index finger is wrong before a frame; its markers."""
    count = len(poses)
    markers = TakeMarkers(
        marker_positions(hand.model, poses), np.ones(len(hand.labels))
    )
    fit = empty_fit(count, len(hand.mean))
    fit.poses[:], fit.opened[:] = poses, False
    fit.residual[:end], fit.residual[end:] = 5e-3, 0.0
    fit.poses[:end, 7:][:, hand.of("index")] = 0.0
    return markers, fit


def test_frames_before_a_restart_are_solved_again_backwards(hand, rng):
    poses = hand.poses(rng, 30)
    markers, fit = wrong_until(hand, poses, 20)
    resolve_backwards(20, markers, hand.problem, hand.work, fit)
    np.testing.assert_allclose(fit.poses[:20, 7:], poses[:20, 7:], atol=1e-3)
    assert fit.residual[:20].max() < 1e-5
    np.testing.assert_array_equal(fit.poses[20:], poses[20:])


def test_they_are_until_one_was_as_good_already_or_has_no_markers(hand, rng):
    poses = hand.poses(rng, 30)
    for stops in ("good", "blind"):
        markers, fit = wrong_until(hand, poses, 20)
        if stops == "good":
            fit.residual[9] = 0.0
        else:
            markers.targets[9] = np.nan
        before = fit.poses[:10].copy()
        resolve_backwards(20, markers, hand.problem, hand.work, fit)
        np.testing.assert_array_equal(fit.poses[:10], before)
        np.testing.assert_allclose(fit.poses[10:20, 7:], poses[10:20, 7:], atol=1e-3)


def half_turn(axis):
    """(4, 4) what turns rows of quaternions, w first, about an axis of the hand."""
    n = 1 + "xyz".index(axis)
    unit = np.zeros(4)
    unit[n] = 1.0
    w, x, y, z = unit
    return np.array([[w, x, y, z], [-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])


def solved_take(hand, targets):
    fit = empty_fit(len(targets), len(hand.mean))
    markers = TakeMarkers(targets, np.ones(len(hand.labels)))
    args = hand.starts, SETTINGS.restart_m, hand.work, fit
    solve_frames(markers, hand.problem, *args)
    return fit


def test_frames_fitted_wrongly_until_a_restart_are_solved_again(hand):
    """The hand turns over in one frame, in which a restart does not help."""
    rng = np.random.default_rng(4)
    poses = hand.poses(rng, 60)
    poses[30:, 3:7] = poses[30:, 3:7] @ half_turn("x")
    targets = marker_positions(hand.model, poses)
    targets[30, 0] += 5.0  # [m] no posture fits that, none is better than another
    fit = solved_take(hand, targets)
    away = np.abs(fit.poses[:, 7:] - poses[:, 7:]).max(axis=1)
    assert np.delete(away, 30).max() < 2e-3
    assert np.delete(fit.residual, 30).max() < 1e-4


def test_frames_with_two_markers_keep_the_pose_and_leave_all_open(hand, rng):
    poses = hand.poses(rng, 20)
    targets = marker_positions(hand.model, poses)
    targets[8:11, 2:] = np.nan
    fit = solved_take(hand, targets)
    np.testing.assert_array_equal(fit.poses[8:11], np.tile(fit.poses[7], (3, 1)))
    assert fit.opened[8:11].all()
    assert not fit.decided[8:11].any()
    assert np.isnan(fit.residual[8:11]).all()
    assert (fit.steps[8:11] == 0).all()
    assert frames.MIN_MARKERS == 3


def restarts_of(hand, targets, monkeypatch):
    """Frames of a take in which a restart is tried, and never leads anywhere."""
    tried = []
    monkeypatch.setattr(frames, "restart", lambda t, *_: bool(tried.append(t)))
    fit = empty_fit(len(targets), len(hand.mean))
    markers = TakeMarkers(targets, np.ones(len(hand.labels)))
    plain = getattr(solve_frames, "py_func", solve_frames)
    plain(markers, hand.problem, hand.starts, SETTINGS.restart_m, hand.work, fit)
    return tried


def test_a_take_is_restarted_where_it_fits_worse_than_it_did_and_only_there(
    hand, rng, monkeypatch
):
    targets = marker_positions(hand.model, hand.poses(rng, 80))
    targets += rng.normal(scale=3e-4, size=targets.shape)
    assert restarts_of(hand, targets, monkeypatch) == []
    worse = targets.copy()
    growing = np.minimum(np.arange(80) / 20.0, 1.0)[:, None, None]
    worse += growing * rng.normal(scale=4e-3, size=targets.shape)
    tried = restarts_of(hand, worse, monkeypatch)
    assert tried
    waits = frames.RESTART_WAIT_FRAMES, frames.POOR_RESTART_WAIT_FRAMES
    assert (np.diff(tried) >= min(waits)).all()
