"""Priors learnt from angles."""

import numpy as np
import pytest

from handclean.errors import HandcleanError, UsageError
from handclean.ik.prior import coverage, learn, misfit

NAMES = ("a", "b", "c", "d")


def takes(rng, count=3, frames=300):
    """Takes that move along two directions, and a little along all."""
    along = np.array([[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
    return [
        rng.normal(size=(frames, 2)) * [1.0, 0.4] @ along
        + 0.01 * rng.normal(size=(frames, 4))
        for _ in range(count)
    ]


def test_a_prior_keeps_as_many_directions_as_hold_the_share(rng):
    prior = learn(takes(rng), NAMES, share=0.99)
    assert prior.components.shape == (4, 2)
    assert prior.variance_share.sum() > 0.99
    assert learn(takes(rng), NAMES, directions=1).components.shape == (4, 1)
    assert learn(takes(rng), NAMES, share=1.0).components.shape == (4, 4)


def test_a_prior_covers_held_out_takes_of_the_same_kind(rng):
    prior = learn(takes(rng), NAMES, directions=2)
    (held_out,) = takes(rng, 1)
    shares = coverage(prior, held_out)
    assert (np.diff(shares) >= 0.0).all()
    assert shares[-1] > 0.999
    assert misfit(prior, held_out)[-1] < 0.02
    assert coverage(prior, rng.normal(size=(100, 4)))[-1] < 0.8


def test_a_long_take_counts_no_more_than_a_short_one(rng):
    short, other = takes(rng, 2, frames=500)
    other = other + 2.0
    one = learn([short, other], NAMES)
    two = learn([short, np.repeat(other, 7, axis=0)], NAMES)
    np.testing.assert_allclose(one.mean, two.mean, atol=0.05)


def test_frames_with_unknown_angles_teach_nothing(rng):
    whole = takes(rng)
    gappy = [np.concatenate([take, np.full((40, 4), np.nan)]) for take in whole]
    a, b = learn(whole, NAMES), learn(gappy, NAMES)
    np.testing.assert_array_equal(a.components, b.components)
    with pytest.raises(HandcleanError, match="no frame"):
        learn([np.full((10, 4), np.nan)], NAMES)


def test_what_cannot_be_kept_is_refused(rng):
    for wrong in ({"directions": 5}, {"directions": 0}, {"share": 1.2}, {"share": 0.0}):
        with pytest.raises(UsageError):
            learn(takes(rng), NAMES, **wrong)
