"""Jumps between two postures for the same markers are taken out, and only those."""

import numpy as np
import pytest
from people import exercise

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik import solve as solving
from handclean.ik.frames import PoseProblem, TakeMarkers, empty_fit
from handclean.ik.mend import (
    MAX_PATH_FRAMES,
    JumpTask,
    Path,
    bridge_open_fingers,
    continue_posture,
    has_jumps,
    jumping_limbs,
    smooth_frame,
)
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import markers_of, solve_markers
from handclean.io.hdf5.prior import read_prior
from handclean.kernels.gauss_newton import StepControl, Subspace, make_workspace
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

NOISE = 4e-4
MAYCOCK = load_marker_set("maycock26").labels


@pytest.fixture(scope="module")
def model():
    return template_subject(load_marker_set("dfki13")).model


@pytest.fixture
def mend_alone(monkeypatch):
    """What is mended is not made likeliest afterwards."""
    monkeypatch.setattr(solving, "find_map_poses", lambda *parts: None)


def unmended(monkeypatch, *args, **kwargs):
    """The same without taking jumps out."""
    with monkeypatch.context() as patch:
        patch.setattr(solving, "remove_jumps", lambda *parts: None)
        return solve_markers(*args, **kwargs)


def jumps(poses):
    return np.count_nonzero(np.abs(np.diff(poses[:, 7:], axis=0)) > np.radians(20.0))


def usual(residual):
    return np.sqrt(np.nanmean(residual**2))


@pytest.mark.usefixtures("mend_alone")
def test_two_markers_per_finger_jump_less_at_the_same_residual(model, rng, monkeypatch):
    poses = exercise(rng, model.tree, 900, 150.0)
    poses[:, 7:] *= 0.6  # near straight, where elbows are up or down
    seen = marker_positions(model, poses)
    seen += rng.normal(scale=NOISE, size=seen.shape)
    prior = read_prior()
    before = unmended(monkeypatch, model, seen, prior=prior)
    after = solve_markers(model, seen, prior=prior)
    assert jumps(before.poses) > 20
    assert jumps(after.poses) < 0.8 * jumps(before.poses)
    assert usual(after.residual) < 1.01 * usual(before.residual)
    off = [np.abs(found.poses - poses)[:, 7:].mean() for found in (before, after)]
    assert off[1] < 1.02 * off[0]


@pytest.mark.usefixtures("mend_alone")
def test_grasps_seen_by_two_markers_per_finger_lose_a_third_of_their_jumps(monkeypatch):
    settings = SimulateConfig(
        marker_set="dfki13", trials=4, subjects=4, duration_s=3.0, rate_hz=100.0, seed=5
    )
    prior, before, after = read_prior(), 0, 0
    for trial in simulate("grasp", settings):
        hand = trial.subject.model
        seen = markers_of(trial.labelled, hand)
        rough = unmended(monkeypatch, hand, seen, prior=prior)
        found = solve_markers(hand, seen, prior=prior)
        assert usual(found.residual) < 1.01 * usual(rough.residual)
        before += jumps(rough.poses)
        after += jumps(found.poses)
    assert after < 0.65 * before


@pytest.mark.usefixtures("mend_alone")
def test_a_finger_that_is_hidden_for_a_while_comes_back_without_a_jump(
    model, rng, monkeypatch
):
    poses = exercise(rng, model.tree, 240, 150.0)
    seen = marker_positions(model, poses)
    seen += rng.normal(scale=5e-5, size=seen.shape)
    index = [n for n, label in enumerate(model.labels) if "index" in label.lower()]
    assert index
    seen[100:125, index] = np.nan
    hinges = [7 + d for d, name in enumerate(model.tree.hinges) if "index" in name]
    prior = read_prior()
    before = unmended(monkeypatch, model, seen, prior=prior).poses[:, hinges]
    after = solve_markers(model, seen, prior=prior).poses[:, hinges]
    steps = [np.abs(np.diff(found[95:130], axis=0)).max() for found in (before, after)]
    assert steps[0] > 0.3
    assert steps[1] < 0.8 * steps[0]
    assert steps[1] < 0.3
    off = [np.abs(f - poses[:, hinges])[100:125].mean() for f in (before, after)]
    assert off[1] < off[0]


def test_residuals_are_those_of_the_mended_poses(model, rng):
    poses = exercise(rng, model.tree, 300, 150.0)
    poses[:, 7:] *= 0.6
    seen = marker_positions(model, poses)
    seen += rng.normal(scale=NOISE, size=seen.shape)
    found = solve_markers(model, seen, prior=read_prior())
    away = marker_positions(model, found.poses) - seen
    want = np.sqrt((away**2).sum(axis=2).mean(axis=1))
    np.testing.assert_allclose(found.residual, want, atol=1e-12)


def test_a_true_jump_stays(rng):
    model = template_subject(load_marker_set("maycock26")).model
    poses = exercise(rng, model.tree, 60, 150.0)
    column = 7 + model.tree.hinges.index("index_pip_flexion")
    poses[:30, column], poses[30:, column] = 0.2, 1.2
    seen = marker_positions(model, poses)
    seen += rng.normal(scale=NOISE, size=seen.shape)
    found = solve_markers(model, seen, prior=read_prior())
    np.testing.assert_allclose(found.poses[:, column], poses[:, column], atol=0.25)
    assert found.residual.max() < 3.0 * NOISE


class Solved:
    """A solved take of one hand, whose poses may be made wrong."""

    def __init__(self, model, poses, prior=None):
        self.poses = poses
        markers = marker_positions(model, poses)
        mean, basis = solving.prior_arrays(model, prior)
        self.limb = model.tree.limbs()[model.tree.hinge_bone]
        settings = SolveConfig()
        fit = empty_fit(len(poses), len(mean))
        fit.poses[:], fit.opened[:], fit.decided[:] = poses, False, True
        fit.residual[:] = 1e-6
        self.task = JumpTask(
            TakeMarkers(markers, np.ones(len(model.labels))),
            PoseProblem(
                solving.chain_of(model),
                Subspace(mean, basis, settings.prior_m),
                StepControl(settings.damping, settings.enough_m, settings.iterations),
                settings.lever_m,
            ),
            NOISE,
            fit,
            make_workspace(len(mean), len(model.labels), basis.shape[1]),
        )
        self.finger = np.array(["index" in name for name in model.tree.hinges])

    def bent_wrong(self, start, stop, by):
        """Bend the index finger of some frames, which then fit worse."""
        fit = self.task.fit
        for t in range(start, stop):
            fit.poses[t, 7:][self.finger] += by
            fit.residual[t] = 3e-3

    def path(self):
        return Path(
            np.full((MAX_PATH_FRAMES, self.poses.shape[1]), np.nan),
            np.full(MAX_PATH_FRAMES, np.nan),
        )


@pytest.fixture
def solved(rng):
    whole = template_subject(load_marker_set("maycock26")).model
    poses = exercise(rng, whole.tree, 60, 150.0)
    return Solved(whole, poses)


@pytest.mark.parametrize(("start", "way"), [(19, 1), (30, -1)])
def test_a_posture_is_continued_until_it_meets_the_takes_own(solved, start, way):
    solved.bent_wrong(20, 30, 0.4)
    path = solved.path()
    found = continue_posture(start, way, solved.finger, solved.task, path)
    assert found.frames == 10
    assert found.gain > 10.0
    rows = start + way * np.arange(1, 11)
    away = path.poses[:10] - solved.poses[rows]
    assert np.abs(away[:, 7:]).max() < 1e-3
    np.testing.assert_array_equal(path.residual[:10] < 1e-5, True)


def test_a_posture_is_not_continued_through_frames_without_markers(solved):
    solved.bent_wrong(20, 30, 0.4)
    solved.task.markers.targets[24] = np.nan
    args = solved.finger, solved.task, solved.path()
    assert continue_posture(19, 1, *args).frames == 0


def test_an_open_finger_ends_the_path(solved):
    solved.bent_wrong(20, 30, 0.4)
    solved.task.fit.opened[25] = solved.finger
    args = solved.finger, solved.task, solved.path()
    assert continue_posture(19, 1, *args).frames == 5


def test_a_frame_is_smoothed_towards_its_neighbours_if_it_fits_as_well(solved):
    fit, truth = solved.task.fit, solved.poses[25].copy()
    fit.poses[25, 7:][solved.finger] += 0.2
    fit.residual[25] = NOISE
    smooth_frame(25, solved.finger, solved.task)
    np.testing.assert_allclose(fit.poses[25, 7:], truth[7:], atol=0.01)
    fit.poses[40, 7:][solved.finger] += 0.2
    fit.residual[40] = 1e-9  # no other posture fits as well
    before = fit.poses[40].copy()
    smooth_frame(40, solved.finger, solved.task)
    np.testing.assert_array_equal(fit.poses[40], before)


def test_an_open_finger_is_bridged_only_if_that_costs_less(solved):
    fit, markers = solved.task.fit, solved.task.markers
    names = ["INDEX" in label for label in MAYCOCK]
    markers.targets[20:30, names] = np.nan
    fit.opened[20:30] = solved.finger
    fit.poses[20:30, 7:][:, solved.finger] += 1.0
    straight = solved.poses.copy()
    bridge_open_fingers(solved.limb, solved.task)
    away = np.abs(fit.poses - straight)[:, 7:]
    assert away.max() < 0.15
    fit.poses[:] = straight
    smooth = fit.poses.copy()
    bridge_open_fingers(solved.limb, solved.task)
    np.testing.assert_array_equal(fit.poses, smooth)


def test_a_jump_where_a_finger_becomes_open_is_bridged_though_none_follows(solved):
    fit, markers = solved.task.fit, solved.task.markers
    fit.poses[:], markers.targets[:] = solved.poses[20], markers.targets[20].copy()
    markers.targets[20:30, ["INDEX" in label for label in MAYCOCK]] = np.nan
    fit.opened[20:30] = solved.finger
    fit.poses[20:, 7:] += 0.8 * solved.finger
    bridge_open_fingers(solved.limb, solved.task)
    steps = np.diff(fit.poses[19:31, 7:], axis=0)[:, solved.finger]
    np.testing.assert_allclose(steps, 0.8 / 11.0, atol=0.03)


def test_limbs_that_jump_are_found_whole_unless_they_are_open(solved):
    fit, out = solved.task.fit, np.zeros(len(solved.finger), dtype=bool)
    fit.poses[:, 7:] = 0.3
    one = np.flatnonzero(solved.finger)[2]
    fit.poses[20:, 7 + one] += 0.5
    assert not jumping_limbs(19, solved.limb, fit, out)
    assert jumping_limbs(20, solved.limb, fit, out)
    np.testing.assert_array_equal(out, solved.finger)
    fit.opened[20, one] = True
    assert not jumping_limbs(20, solved.limb, fit, out)
    assert has_jumps(fit.poses)
    assert not has_jumps(fit.poses[:20])
