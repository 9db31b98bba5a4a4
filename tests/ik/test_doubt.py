"""The sigma of angles says how far off they are."""

from dataclasses import replace

import numpy as np
import pytest
from people import as_take, exercise, person

from handclean.gaps.fill import fill
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik.doubt import (
    angle_uncertainty,
    even_noise,
    zero_sigma,
)
from handclean.ik.take import solve
from handclean.io.hdf5.prior import read_prior
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig


@pytest.fixture(scope="module")
def template():
    return template_subject(load_marker_set("maycock26"))


@pytest.fixture(scope="module")
def people():
    """Pairs of a person, and a subject calibrated from their take."""
    found = []
    for seed in (1, 2):
        one = person(seed)
        known = calibrate([one.take], one.set, CalibrateConfig(frames=80))[0]
        found.append((one, known))
    return found


def hinge(model, name):
    return model.tree.hinges.index(name)


def test_calibrated_subjects_say_how_far_off_angles_are(people, rng):
    """Of people who are not the template; what is unknown is mostly where zero is."""
    ratios = []
    for one, known in people:
        poses = exercise(rng, one.model.tree, 300, 50.0)
        seen = marker_positions(one.model, poses)
        seen += rng.normal(scale=2e-4, size=seen.shape)
        take = as_take(seen, one.model.labels)
        motion = fill(take, known, prior=read_prior())[0].motions["right"]
        ratios.append(np.abs(motion.angles - poses[:, 7:]) / motion.angles_sigma)
    ratios = np.concatenate(ratios)
    assert 0.4 < np.mean(ratios < 1.0) < 0.9
    assert np.mean(ratios < 2.0) > 0.8
    assert np.mean(ratios < 3.0) > 0.93


def test_a_hinge_with_one_marker_beyond_has_the_least_certain_zero(template):
    sigma = zero_sigma(template)
    dip, pip, mcp = (
        sigma[hinge(template.model, f"index_{name}_flexion")]
        for name in ("dip", "pip", "mcp")
    )
    assert dip > pip > mcp


def test_zeros_are_as_uncertain_as_the_subject_says(template):
    errors = {"index_pip_length_sigma_m": 1e-3, "thumb_ip_length_sigma_m": 1e-3}
    one = replace(template, calibrated=True, errors=errors)
    two = replace(one, errors=dict.fromkeys(errors, 0.002))
    np.testing.assert_allclose(zero_sigma(two), 2.0 * zero_sigma(one))
    assert np.all(zero_sigma(template) > zero_sigma(two))


def test_sigma_agrees_with_repeated_noise(template, rng):
    poses = exercise(rng, template.model.tree, 1, 50.0)
    seen = np.ones((400, 26), dtype=bool)
    poses = np.repeat(poses, 400, axis=0)
    noise = 3e-4
    places = marker_positions(template.model, poses)
    places += rng.normal(scale=noise, size=places.shape)
    take = as_take(places, template.model.labels)
    found = fill(take, template)[0].motions["right"].angles
    sigma = angle_uncertainty(
        template.model, poses, seen, np.full(26, noise), None
    ).hinges[0]
    np.testing.assert_allclose(found.std(axis=0), sigma, rtol=0.25)


def test_hidden_fingers_have_a_sigma_with_a_prior_only(template, rng):
    poses = exercise(rng, template.model.tree, 5, 50.0)
    seen = np.ones((5, 26), dtype=bool)
    seen[:, ["RING" in label for label in template.model.labels]] = False
    ring = ["ring" in name for name in template.model.tree.hinges]
    noise = np.full(26, 2e-4)
    without, sigma = (
        angle_uncertainty(template.model, poses, seen, noise, prior).hinges
        for prior in (None, read_prior())
    )
    assert np.isnan(without[:, ring]).all()
    assert np.isfinite(without[:, np.logical_not(ring)]).all()
    assert np.isfinite(sigma).all()
    others = sigma[:, np.logical_not(ring)]
    assert sigma[:, ring].min() > 2.0 * np.median(others)


def test_a_marker_that_poses_follow_is_not_quieter_than_the_others():
    noise = np.array([1e-5, 5e-4, 2e-4])
    positions = np.zeros((10, 3, 3))
    residual, left = np.full(10, 3e-4), np.full(10, 0.5)
    even = even_noise(noise, positions, residual, left)
    assert even[0] == pytest.approx(3e-4 / np.sqrt(1.5))
    assert even[1] == 5e-4


def test_trusted_frames_have_no_doubtful_joint(people, rng):
    """But for the zeros, whose doubt is the same in all frames."""
    one, known = people[0]
    poses = exercise(rng, one.model.tree, 300, 50.0)
    seen = marker_positions(one.model, poses)
    seen += rng.normal(scale=2e-4, size=seen.shape)
    for _ in range(6):
        start = int(rng.integers(0, 250))
        gone = rng.choice(len(one.model.labels), 8, replace=False)
        seen[start : start + int(rng.integers(5, 50)), gone] = np.nan
    take = as_take(seen, one.model.labels)
    motion = fill(take, known, prior=read_prior())[0].motions["right"]
    doubt = np.sqrt(motion.angles_sigma**2 - zero_sigma(known) ** 2)
    assert 0.1 < motion.trusted.mean() < 0.9
    assert np.max(doubt[motion.trusted]) < 0.4 + 1e-9


def test_solved_angles_have_the_sigma_that_filling_gives_them(people, rng):
    """Bit for bit in whole takes; without a prior, none where nothing tells."""
    one, known = people[0]
    poses = exercise(rng, one.model.tree, 60, 50.0)
    seen = marker_positions(one.model, poses)
    seen += rng.normal(scale=2e-4, size=seen.shape)
    whole = as_take(seen, one.model.labels)
    solved = solve(whole, known, prior=read_prior()).motions["right"]
    filled = fill(whole, known, prior=read_prior())[0].motions["right"]
    np.testing.assert_array_equal(solved.angles_sigma, filled.angles_sigma)
    assert np.isfinite(solved.angles_sigma).all()
    ring = ["RING" in label for label in one.model.labels]
    seen[:, ring] = np.nan
    bare = solve(as_take(seen, one.model.labels), known).motions["right"]
    hidden = np.array(["ring" in name for name in one.model.tree.hinges])
    assert np.isnan(bare.angles_sigma[:, hidden]).all()
    assert np.isfinite(bare.angles_sigma[:, ~hidden]).all()
