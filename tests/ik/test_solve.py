"""Frame-by-frame inverse kinematics on the template hand with known truth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.errors import HandcleanError, ShapeError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik import solve as solving
from handclean.ik.prior import PosturePrior
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import solve_markers
from handclean.ik.take import solve
from handclean.io.hdf5.prior import read_prior
from handclean.recording import Origin, Recording, trajectories


@pytest.fixture(scope="module")
def subject():
    return template_subject(load_marker_set("maycock26"))


def smooth_poses(tree, frames, rng, synergies=None):
    """Slow motion within the limits, anywhere in space."""
    time = np.linspace(0.0, 1.0, frames)
    low, high = tree.limits.T
    if synergies is None:
        phase = rng.uniform(0, 2 * np.pi, size=len(low))
        wave = 0.5 + 0.35 * np.sin(2 * np.pi * time[:, None] + phase)
        angles = low + wave * (high - low)
    else:
        mean, basis = synergies
        phase = rng.uniform(0, 2 * np.pi, size=basis.shape[1])
        angles = mean + np.sin(2 * np.pi * time[:, None] + phase) @ basis.T
    turn = Rotation.random(rng=rng) * Rotation.from_rotvec(
        np.outer(np.sin(3 * time), rng.normal(size=3))
    )
    quaternion = np.roll(turn.as_quat(), 1, axis=1)
    place = rng.normal(size=3) + 0.2 * np.sin(2 * time)[:, None]
    return np.hstack([np.broadcast_to(place, (frames, 3)), quaternion, angles])


def synergies(subject, rng):
    """(D,) mean and (D, 2) basis of a hand that moves in two directions only."""
    low, high = subject.model.tree.limits.T
    basis = np.linalg.qr(rng.normal(size=(len(low), 2)))[0] * [0.5, 0.3]
    return low + 0.4 * (high - low), basis


def prior_of(subject, mean, basis):
    size = np.linalg.norm(basis, axis=0)
    return PosturePrior(
        names=subject.model.tree.hinges,
        mean=mean,
        components=basis / size,
        deviations=size,
        variance_share=size**2 / (size**2).sum(),
    )


def test_noiseless_markers_give_the_angles_back_in_any_orientation(subject, rng):
    for _ in range(4):
        poses = smooth_poses(subject.model.tree, 40, rng)
        markers = marker_positions(subject.model, poses)
        found = solve_markers(subject.model, markers)
        assert found.decided.all()
        assert found.residual.max() < 2e-6
        np.testing.assert_allclose(found.poses[:, 7:], poses[:, 7:], atol=2e-3)


def test_every_frame_is_within_one_percent_of_its_converged_optimum(subject, rng):
    poses = smooth_poses(subject.model.tree, 200, rng)
    markers = marker_positions(subject.model, poses)
    markers += rng.normal(scale=5e-4, size=markers.shape)
    found = solve_markers(subject.model, markers)
    tight = SolveConfig(iterations=200, enough_m=1e-12)
    again = solve_markers(subject.model, markers, settings=tight)
    assert (found.residual <= 1.01 * again.residual + 1e-6).all()


def test_residual_counts_measured_markers_only(subject, rng):
    poses = smooth_poses(subject.model.tree, 10, rng)
    markers = marker_positions(subject.model, poses)
    markers[:, 0] = np.nan
    found = solve_markers(subject.model, markers)
    place = marker_positions(subject.model, found.poses)
    want = np.sqrt(np.nanmean(((place - markers) ** 2).sum(2), axis=1))
    np.testing.assert_allclose(found.residual, want, atol=1e-12)


def test_a_weight_of_zero_is_a_missing_marker(subject, rng):
    poses = smooth_poses(subject.model.tree, 10, rng)
    markers = marker_positions(subject.model, poses)
    weights = np.ones(markers.shape[1])
    weights[4] = 0.0
    without = markers.copy()
    without[:, 4] = np.nan
    markers[:, 4] += 0.1
    a = solve_markers(subject.model, markers, weights=weights)
    b = solve_markers(subject.model, without)
    np.testing.assert_array_equal(a.poses, b.poses)


def test_the_subspace_moves_fingers_nobody_sees_and_standard_does_not(
    subject, rng, monkeypatch
):
    """The subspace to the degree; under a prior that allows for stray, roughly."""
    mean, basis = synergies(subject, rng)
    poses = smooth_poses(subject.model.tree, 60, rng, (mean, basis))
    markers = marker_positions(subject.model, poses)
    hidden = [n for n, label in enumerate(subject.model.labels) if "RING" in label]
    assert hidden
    markers[:, hidden] = np.nan
    ring = [n for n, name in enumerate(subject.model.tree.hinges) if "ring" in name]

    def error(prior):
        found = solve_markers(subject.model, markers, prior=prior)
        assert found.opened[:, ring].all()
        return np.degrees(np.abs(found.poses - poses)[:, 7:][:, ring]).mean()

    prior = prior_of(subject, mean, basis)
    likeliest, standard = error(prior), error(None)
    monkeypatch.setattr(solving, "find_map_poses", lambda *parts: None)
    layered = error(prior)
    assert layered < 1.0
    assert likeliest < 0.5 * standard
    assert standard > 4.0


def test_hidden_markers_leave_their_finger_open_and_no_other(subject, rng):
    poses = smooth_poses(subject.model.tree, 5, rng)
    markers = marker_positions(subject.model, poses)
    hidden = [n for n, label in enumerate(subject.model.labels) if "LITTLE" in label]
    markers[:, hidden] = np.nan
    found = solve_markers(subject.model, markers)
    little = np.array(["little" in name for name in subject.model.tree.hinges])
    np.testing.assert_array_equal(found.opened[-1], little)


def test_a_frame_without_markers_keeps_its_pose_and_is_not_trusted(subject, rng):
    poses = smooth_poses(subject.model.tree, 20, rng)
    markers = marker_positions(subject.model, poses)
    markers[7:10] = np.nan
    found = solve_markers(subject.model, markers)
    assert not found.decided[7:10].any()
    assert found.decided[10:].all()
    assert np.isnan(found.residual[7:10]).all()
    np.testing.assert_array_equal(found.poses[9], found.poses[6])
    np.testing.assert_allclose(found.poses[10, 7:], poses[10, 7:], atol=2e-3)


def test_a_jump_of_the_take_is_followed(subject, rng):
    poses = smooth_poses(subject.model.tree, 40, rng)
    poses[20:, :3] += [0.4, -0.3, 0.2]
    poses[20:, 3:7] = smooth_poses(subject.model.tree, 20, rng)[:, 3:7]
    found = solve_markers(subject.model, marker_positions(subject.model, poses))
    assert found.residual.max() < 1e-5


def test_solving_twice_gives_the_same_bits(subject, rng):
    markers = marker_positions(subject.model, smooth_poses(subject.model.tree, 20, rng))
    a, b = (solve_markers(subject.model, markers) for _ in range(2))
    np.testing.assert_array_equal(a.poses, b.poses)


def test_filled_samples_are_not_measurements(subject, rng):
    poses = smooth_poses(subject.model.tree, 20, rng)
    markers = marker_positions(subject.model, poses)
    take = trajectories(markers, subject.model.labels)
    origin = take.origin.copy()
    origin[:, 3] = Origin.FILLED
    poisoned = markers.copy()
    poisoned[:, 3] += 0.05
    take = replace(take, positions=poisoned, origin=origin)
    found = solve(Recording(rate=100.0, frames=20, markers=take), subject)
    motion = found.motions["right"]
    np.testing.assert_allclose(motion.angles, poses[:, 7:], atol=5e-3)
    assert motion.residual.max() < 1e-5
    assert found.skeletons["right"] is subject.model.tree


def test_a_take_without_the_subjects_markers_is_refused(subject):
    take = trajectories(np.zeros((3, 1, 3)), ("LKNEE",))
    with pytest.raises(HandcleanError, match="none of the subject's markers"):
        solve(Recording(rate=100.0, frames=3, markers=take), subject)
    with pytest.raises(ShapeError):
        solve_markers(subject.model, np.zeros((3, 2, 3)))


SIX = ("R_HAND_BACK", "THUMB_TIP", "INDEX_TIP", "MIDDLE_TIP", "RING_TIP", "LITTLE_TIP")


def six_markers(subject):
    """One marker on the back of the hand and five on the tips."""
    labels = subject.model.labels
    tips = [next(n for n in labels if tip in n) for tip in SIX[1:]]
    back = next(n for n in labels if "HAND" in n)
    return replace(subject, model=subject.model.selected([back, *tips]))


def in_subspace(subject, prior, rng, frames, stray=0.0):
    """Postures that the prior knows, from one to another, or near such."""
    alpha = rng.normal(scale=0.7, size=(2, len(prior.deviations)))
    alpha = alpha[:1] + np.linspace(0, 1, frames)[:, None] * (alpha[1:] - alpha[:1])
    poses = smooth_poses(subject.model.tree, frames, rng)
    poses[:, 7:] = prior.mean + (alpha * prior.deviations) @ prior.components.T
    poses[:, 7:] += rng.normal(scale=stray, size=poses.shape[1] - 7)
    poses[:, 7:] = np.clip(poses[:, 7:], *subject.model.tree.limits.T)
    return poses


def test_six_markers_and_a_prior_are_trusted_where_they_are_right(rng):
    """Of what is trusted hardly a joint is far off, though five have one marker."""
    whole, prior = template_subject(load_marker_set("maycock26")), read_prior()
    sparse = six_markers(whole).model
    away, trusted = [], []
    for _ in range(40):
        poses = in_subspace(whole, prior, rng, 40, 0.3)
        markers = marker_positions(sparse, poses)
        markers += rng.normal(scale=2e-4, size=markers.shape)
        found = solve_markers(sparse, markers, prior=prior)
        away.append(np.abs(found.poses - poses)[:, 7:].max(axis=1))
        trusted.append(found.decided)
    away, trusted = np.concatenate(away), np.concatenate(trusted)
    assert trusted.mean() > 0.25
    assert np.mean(away[trusted] > 1.0) < 0.1
    assert np.median(away[trusted]) < 0.7


def test_three_markers_on_the_hand_are_not_trusted(rng):
    whole, prior = template_subject(load_marker_set("maycock26")), read_prior()
    hand = [n for n in whole.model.labels if "HAND" in n][:3]
    assert len(hand) == 3
    few = whole.model.selected(hand)
    markers = marker_positions(few, in_subspace(whole, prior, rng, 40))
    assert not solve_markers(few, markers, prior=prior).decided.any()


@pytest.mark.parametrize("finger", ["THUMB", "INDEX", "MIDDLE", "RING", "LITTLE"])
def test_a_finger_without_markers_is_not_trusted_with_a_prior(finger, subject, rng):
    poses = in_subspace(subject, read_prior(), rng, 60)
    markers = marker_positions(subject.model, poses)
    assert solve_markers(subject.model, markers, prior=read_prior()).decided.all()
    gone = [n for n, label in enumerate(subject.model.labels) if finger in label]
    markers[20:40, gone] = np.nan
    found = solve_markers(subject.model, markers, prior=read_prior())
    np.testing.assert_array_equal(found.decided, (np.arange(60) // 20) != 1)
