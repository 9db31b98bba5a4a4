"""The noise of markers, from what solved postures leave of them."""

from dataclasses import replace

import numpy as np
import pytest
from people import exercise

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik.noise import (
    MAX_ABSORPTION,
    MIN_NOISE_M,
    UNDETERMINED_NOISE_M,
    marker_noise,
)
from handclean.ik.solve import solve_markers


@pytest.fixture(scope="module")
def model():
    return template_subject(load_marker_set("maycock26")).model


def solved(model, rng, frames, noise):
    poses = exercise(rng, model.tree, frames, 100.0)
    positions = marker_positions(model, poses)
    positions += rng.normal(scale=noise, size=positions.shape)
    return positions, solve_markers(model, positions)


def nothing_known(model):
    return np.full(len(model.labels), np.nan)


def test_noise_is_found_though_poses_absorb_a_part_of_it(model, rng):
    positions, solution = solved(model, rng, 200, 5e-4)
    found = marker_noise(model, positions, solution, nothing_known(model))
    assert np.sqrt(np.mean(found**2)) == pytest.approx(5e-4, rel=0.05)
    away = positions - marker_positions(model, solution.poses)
    rms = np.sqrt(np.mean(away**2))
    assert rms < 0.85 * 5e-4


def test_the_larger_of_residual_and_calibration_counts(model, rng):
    positions, solution = solved(model, rng, 100, 2e-4)
    own = marker_noise(model, positions, solution, nothing_known(model))
    known = nothing_known(model)
    known[[3, 4]] = 2e-3, 1e-6
    found = marker_noise(model, positions, solution, known)
    ratio = found / own
    assert ratio[3] > 3.0
    np.testing.assert_array_equal(np.delete(ratio, 3), 1.0)


def test_noise_is_not_less_than_any_system_has(model, rng):
    positions, solution = solved(model, rng, 20, 0.0)
    found = marker_noise(model, positions, solution, nothing_known(model))
    np.testing.assert_array_equal(found, MIN_NOISE_M)


def test_a_marker_that_is_never_seen_is_as_noisy_as_most(model, rng):
    positions, solution = solved(model, rng, 50, 3e-4)
    positions[:, 5] = np.nan
    found = marker_noise(model, positions, solution, nothing_known(model))
    assert np.delete(found, 5).min() < found[5] < np.delete(found, 5).max()


def test_frames_that_are_not_trusted_tell_only_where_none_is(model, rng):
    positions, solution = solved(model, rng, 50, 3e-4)
    half = np.arange(50) < 25
    wild = positions.copy()
    wild[half] += 0.05
    decided = replace(solution, decided=~half)
    found = marker_noise(model, wild, decided, nothing_known(model))
    assert found.max() < 1e-3
    lost = replace(solution, decided=np.zeros(50, dtype=bool))
    assert marker_noise(model, wild, lost, nothing_known(model)).min() > 1e-2


def test_where_poses_absorb_all_the_noise_has_a_floor_of_its_own(rng):
    few = template_subject(load_marker_set("hoyet6")).model
    positions, solution = solved(few, rng, 30, 0.0)
    solution = replace(solution, decided=np.ones(30, dtype=bool))
    found = marker_noise(few, positions, solution, nothing_known(few))
    np.testing.assert_array_equal(found, UNDETERMINED_NOISE_M)
    known = np.full(6, 6e-3)
    found = marker_noise(few, positions, solution, known)
    np.testing.assert_allclose(found, MAX_ABSORPTION * 6e-3 / np.sqrt(3.0))
