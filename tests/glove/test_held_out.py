"""How far variances can be believed."""

import numpy as np
import pytest

from handclean.glove.held_out import count_angles, fit_variance, hold_out_groups


def test_errors_that_recordings_share_are_in_the_variance(rng):
    """Twelve widgets, each a little off: samples agree within, not between."""
    t = rng.normal(size=(12, 40)) * 0.2 + np.linspace(-3, 3, 12)[:, None]
    off = np.radians(3.0) * rng.normal(size=(12, 1))
    scale, floor = fit_variance(
        "lmc-gpr", t.reshape(-1, 1) * 30.0 + 100.0, (0.2 * t + off).ravel(),
        np.repeat(np.arange(12), 40), 0.0, rng,
    )  # fmt: skip
    assert np.degrees(floor) > 1.5 or scale >= 4.0


def test_a_bend_between_the_poses_is_in_the_variance(rng):
    """Five poses on a curve with a kink: none tells what lies between them."""
    angles = np.repeat(np.radians([0.0, 20.0, 45.0, 70.0, 90.0]), 40)
    values = 60.0 * np.maximum(angles - 0.6, 0.0) + 100.0 * angles
    values += rng.normal(size=200)
    group = np.repeat(np.arange(10), 20)  # every pose twice
    scale, floor = fit_variance("spgp", values[:, None], angles, group, 0.0, rng)
    assert np.degrees(floor) > 1.0 or scale >= 4.0


def test_recordings_at_one_angle_are_held_out_together(rng):
    moving = rng.normal(size=20)
    targets = np.concatenate([[0.0] * 5, [9.0] * 5, [0.01] * 5, moving, moving])
    group = np.repeat([7, 3, 9, 4, 5], [5, 5, 5, 20, 20])
    found = hold_out_groups(targets, group)
    assert set(found[:5]) == set(found[10:15])
    assert len(set(found.tolist())) == 4
    assert len(set(found[15:35])) == len(set(found[35:])) == 1


def test_what_cannot_be_held_out_is_in_doubt(rng):
    one = np.linspace(0.0, 1.0, 20)
    group = np.zeros(20, dtype=int)
    scale, floor = fit_variance("spgp", one[:2, None], one[:2], group[:2], 0.0, rng)
    assert (scale, floor) == (1.0, 0.15 * (one[1] - one[0]))


def test_two_angles_leave_what_lies_between_in_doubt(rng):
    angles = np.repeat([0.0, 1.5], 40)
    values = (100.0 * angles + rng.normal(size=80))[:, None]
    _, floor = fit_variance("spgp", values, angles, np.repeat([0, 1], 40), 0.01, rng)
    assert floor == pytest.approx(0.15 * 1.5)
    assert count_angles(angles, np.repeat([0, 1], 40)) == 2


def test_a_recording_that_is_most_there_is_is_held_out_in_pieces(rng):
    moving = np.sin(np.linspace(0.0, 12.0, 200))
    targets = np.concatenate([moving, [0.0] * 10])
    group = np.repeat([0, 1], [200, 10])
    found = hold_out_groups(targets, group)
    assert np.bincount(found)[np.unique(found)].tolist() in ([10, 50, 50, 50, 50],)
    values = (40.0 * targets + rng.normal(size=210))[:, None]
    _, floor = fit_variance("spgp", values, targets, group, 0.001, rng)
    assert floor < 0.1
    assert count_angles(targets, group) > 10
