"""Jumps between two postures for the same markers are taken out, and only those."""

import numpy as np
import pytest
from people import exercise

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik import solve as solving
from handclean.ik.solve import markers_of, solve_markers
from handclean.io.hdf5.prior import read_prior
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

NOISE = 4e-4


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
