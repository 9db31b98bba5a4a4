"""How far variances can be believed."""

import numpy as np

from handclean.glove.held_out import held_out, held_together


def test_errors_that_recordings_share_are_in_the_variance(rng):
    """Twelve widgets, each a little off: samples agree within, not between."""
    t = rng.normal(size=(12, 40)) * 0.2 + np.linspace(-3, 3, 12)[:, None]
    off = np.radians(3.0) * rng.normal(size=(12, 1))
    scale, floor = held_out(
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
    scale, floor = held_out("spgp", values[:, None], angles, group, 0.0, rng)
    assert np.degrees(floor) > 1.0 or scale >= 4.0


def test_recordings_at_one_angle_are_held_out_together(rng):
    moving = rng.normal(size=20)
    targets = np.concatenate([[0.0] * 5, [1.0] * 5, [0.01] * 5, moving, moving])
    group = np.repeat([7, 3, 9, 4, 5], [5, 5, 5, 20, 20])
    found = held_together(targets, group)
    assert set(found[:5]) == set(found[10:15])
    assert len(set(found.tolist())) == 4
    assert len(set(found[15:35])) == len(set(found[35:])) == 1


def test_too_few_recordings_say_nothing(rng):
    one = np.linspace(0.0, 1.0, 20)
    group = np.zeros(20, dtype=int)
    assert held_out("spgp", one[:, None], one, group, 0.0, rng) == (1.0, 0.0)
