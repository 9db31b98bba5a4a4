"""The likeliest posture where markers leave some open: laws, and against scipy."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik import likeliest
from handclean.ik import solve as solving
from handclean.ik.decide import precision_of
from handclean.ik.likeliest import (
    Spectrum,
    add_cheapest_steps,
    combine_priors,
    find_map_pose,
    frames_to_nearest,
    half_descent,
    neg_log_posterior,
)
from handclean.ik.solve import chain_of, prior_arrays, solve_markers
from handclean.io.hdf5.prior import read_prior
from handclean.kernels.gauss_newton import (
    AnglePrior,
    Observations,
    advance,
    make_workspace,
)

NOISE = 5e-4


def model_of(name):
    return template_subject(load_marker_set(name)).model


def likely_poses(model, prior, frames, rng):
    """Slow motion near the prior's subspace, anywhere in space."""
    mean, basis = prior_arrays(model, prior)
    time = np.linspace(0.0, 1.0, frames)[:, None]
    phase = rng.uniform(0.0, 2 * np.pi, basis.shape[1])
    angles = mean + np.sin(2 * np.pi * time + phase) @ basis.T
    stray = rng.uniform(0.0, 2 * np.pi, len(mean))
    angles += 0.25 * np.sin(2 * np.pi * time + stray)
    angles = np.clip(angles, *model.tree.limits.T)
    turn = Rotation.random(rng=rng) * Rotation.from_rotvec(time * rng.normal(size=3))
    place = rng.normal(size=3) + 0.2 * time
    return np.hstack([place, np.roll(turn.as_quat(), 1, axis=1), angles])


class Frame:
    """One frame's markers, few of them, and all the kernels want."""

    def __init__(self, name, rng):
        self.model = model_of(name)
        prior = read_prior()
        self.mean, basis = prior_arrays(self.model, prior)
        self.prior = AnglePrior(self.mean, precision_of(basis), NOISE)
        self.pose = likely_poses(self.model, prior, 1, rng)[0]
        self.markers = marker_positions(self.model, self.pose[None])[0]
        self.markers += rng.normal(scale=NOISE, size=self.markers.shape)
        self.weight = np.ones(len(self.markers))
        self.chain = chain_of(self.model)
        self.work = make_workspace(len(self.mean), len(self.markers), basis.shape[1])

    def posterior(self, pose):
        seen = Observations(self.markers, self.weight)
        return neg_log_posterior(pose, seen, self.prior, self.chain, self.work)

    def cost(self, pose):
        return self.posterior(pose).cost

    def moved(self, pose, step):
        out = np.zeros_like(pose)
        advance(pose, step, 1.0, self.chain, self.work, out)
        return out

    def likeliest(self, pose):
        pose, seen = pose.copy(), Observations(self.markers, self.weight)
        found = find_map_pose(pose, seen, self.prior, self.chain, self.work)
        return pose, found.cost


def test_the_gradient_is_that_of_finite_differences(rng):
    frame = Frame("hoyet8", rng)
    pose = frame.pose.copy()
    pose[7:] = frame.model.tree.limits @ [0.5, 0.5]
    fit = frame.posterior(pose).fit
    gradient = half_descent(
        pose, fit, frame.weight, frame.prior, frame.chain, frame.work
    ).copy()
    for n, entry in enumerate(gradient):
        step = np.zeros(len(gradient))
        step[n] = 1e-6
        more = frame.cost(frame.moved(pose, step))
        less = frame.cost(frame.moved(pose, -step))
        change = (less - more) / 4e-6
        assert change == pytest.approx(entry, rel=1e-4, abs=1e-5 * abs(gradient).max())


@pytest.mark.parametrize("name", ["hoyet6", "schroeder8"])
def test_scipy_finds_nothing_likelier_nearby(name, rng):
    for _ in range(3):
        frame = Frame(name, rng)
        start = frame.pose.copy()
        start[7:] = np.clip(frame.mean, *frame.chain.limits.T)
        found, cost = frame.likeliest(start)
        assert cost == frame.cost(found) <= frame.cost(start)
        for _ in range(4):
            before, (found, cost) = cost, frame.likeliest(found)
            assert before - 0.3 < cost <= before
        low, high = (frame.chain.limits - found[7:, None]).T
        scale = np.r_[np.full(3, 1e-3), np.full(3 + len(low), 0.03)]
        bounds = [(None, None)] * 6 + list(zip(low, high, strict=True))
        best = minimize(
            lambda step, at=found, unit=scale, of=frame: of.cost(
                of.moved(at, step * unit)
            ),
            np.zeros(len(scale)),
            method="L-BFGS-B",
            bounds=[
                (a if a is None else a / s, b if b is None else b / s)
                for (a, b), s in zip(bounds, scale, strict=True)
            ],
        )
        assert best.fun > cost - 0.02 - 1e-3 * cost


def test_the_search_ends_within_the_limits_and_never_lower(rng):
    frame = Frame("hoyet6", rng)
    low, high = frame.chain.limits.T
    for _ in range(40):
        start = frame.pose.copy()
        start[7:] = rng.uniform(low, high)
        found, cost = frame.likeliest(start)
        assert cost <= frame.cost(start)
        assert (low <= found[7:]).all()
        assert (found[7:] <= high).all()


def test_two_priors_are_one_with_their_product(rng):
    mean, angles = rng.normal(size=(2, 5))
    root = rng.normal(size=(5, 5))
    precision = root @ root.T + np.eye(5)
    values, vectors = np.linalg.eigh(precision)
    prior = AnglePrior(mean, precision, NOISE)
    both = AnglePrior(np.full(5, np.nan), np.full((5, 5), np.nan), NOISE)
    combine_priors(angles, 3.0, prior, Spectrum(values, vectors), both)
    np.testing.assert_allclose(both.precision, precision + 3.0 * np.eye(5))
    want = precision @ mean + 3.0 * angles
    np.testing.assert_allclose(both.precision @ both.mean, want)


def test_distances_count_to_the_nearest_frame_that_stays():
    stays = np.array([0, 0, 1, 0, 0, 0, 1, 0], dtype=bool)
    assert frames_to_nearest(stays).tolist() == [2, 1, 0, 1, 2, 1, 0, 1]


def without(monkeypatch, *arguments, **named):
    """What is solved without the pass."""
    with monkeypatch.context() as patch:
        patch.setattr(solving, "find_map_poses", lambda *_: None)
        return solve_markers(*arguments, **named)


def test_frames_whose_markers_decide_everything_stay_to_the_bit(monkeypatch, rng):
    model, prior = model_of("maycock26"), read_prior()
    markers = marker_positions(model, likely_poses(model, prior, 200, rng))
    markers += rng.normal(scale=3e-4, size=markers.shape)
    index = [n for n, label in enumerate(model.labels) if "index" in label.lower()]
    assert index
    markers[80:120, index] = np.nan
    before = without(monkeypatch, model, markers, prior=prior)
    after = solve_markers(model, markers, prior=prior)
    whole = ~before.opened.any(axis=1)
    assert whole[:80].all()
    assert whole[120:].all()
    np.testing.assert_array_equal(after.poses[whole], before.poses[whole])
    np.testing.assert_array_equal(after.residual[whole], before.residual[whole])
    assert (after.poses[80:120] != before.poses[80:120]).any()
    jump = np.abs(np.diff(after.poses[:, 7:], axis=0)).max()
    assert jump < np.abs(np.diff(before.poses[:, 7:], axis=0)).max() + 0.05


@pytest.mark.parametrize("name", ["hoyet6", "schroeder6", "hoyet8"])
def test_angles_of_few_markers_get_truer_and_likelier(name, monkeypatch, rng):
    model, prior = model_of(name), read_prior()
    poses = likely_poses(model, prior, 200, rng)
    markers = marker_positions(model, poses)
    markers += rng.normal(scale=3e-4, size=markers.shape)
    before = without(monkeypatch, model, markers, prior=prior)
    after = solve_markers(model, markers, prior=prior)
    off = [np.abs(s.poses - poses)[:, 7:].mean() for s in (before, after)]
    assert off[1] < 0.8 * off[0]
    frame = Frame(name, rng)
    costs = []
    for found in (before, after):
        total = 0.0
        for markers_of_frame, pose in zip(markers, found.poses, strict=True):
            frame.markers = markers_of_frame
            total += frame.cost(pose)
        costs.append(total)
    assert costs[1] < costs[0]
    assert (after.residual <= 1.05 * before.residual + 2.001e-4).all()


def test_without_a_prior_nothing_changes(monkeypatch, rng):
    model = model_of("hoyet6")
    markers = marker_positions(model, likely_poses(model, read_prior(), 50, rng))
    before = without(monkeypatch, model, markers)
    np.testing.assert_array_equal(solve_markers(model, markers).poses, before.poses)


def test_frames_of_two_markers_keep_the_likelier_pose_before_them(monkeypatch, rng):
    model, prior = model_of("hoyet6"), read_prior()
    markers = marker_positions(model, likely_poses(model, prior, 60, rng))
    markers[30:35, 2:] = np.nan
    before = without(monkeypatch, model, markers, prior=prior)
    plain = getattr(likeliest.find_map_poses, "py_func", likeliest.find_map_poses)
    monkeypatch.setattr(solving, "find_map_poses", plain)
    monkeypatch.setattr(likeliest, "smooth_neighbours", lambda *_: None)
    after = solve_markers(model, markers, prior=prior)
    assert np.isnan(after.residual[30:35]).all()
    assert (after.poses[29] != before.poses[29]).any()
    np.testing.assert_array_equal(after.poses[30:35], np.tile(after.poses[29], (5, 1)))


def test_elbows_up_and_down_are_told_apart_by_the_prior(monkeypatch, rng):
    model, prior = model_of("dfki13"), read_prior()
    poses = likely_poses(model, prior, 300, rng)
    poses[:, 7:] *= 0.7
    markers = marker_positions(model, poses)
    markers += rng.normal(scale=3e-4, size=markers.shape)
    before = without(monkeypatch, model, markers, prior=prior)
    after = solve_markers(model, markers, prior=prior)
    off = [np.abs(s.poses - poses)[:, 7:] for s in (before, after)]
    assert off[1].mean() < 0.7 * off[0].mean()
    assert (off[1] > 0.5).mean() < 0.2 * (off[0] > 0.5).mean()
    steps = [np.abs(np.diff(s.poses[:, 7:], axis=0)) for s in (before, after)]
    assert steps[1].max() < 0.35 < steps[0].max()


def test_each_candidate_comes_from_the_one_that_is_cheapest_with_the_step_to_it():
    before, after = np.zeros((3, 9)), np.zeros((3, 9))
    before[:, 7] = 0.0, 0.2, 5.0
    after[:, 7] = 0.0, 0.2, 2.0
    cost, origin = np.array([1.0, 2.0, 4.0]), np.full(3, -1)
    add_cheapest_steps(np.array([3.0, 1.0, 0.5]), before, after, cost, origin)
    # a step of 0.2 rad costs 4, a long one 9
    assert origin.tolist() == [0, 1, 2]
    np.testing.assert_allclose(cost, [1.0 + 3.0, 2.0 + 1.0, 4.0 + 9.5])
