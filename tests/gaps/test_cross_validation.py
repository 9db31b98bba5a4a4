"""What a take says about bridging its own gaps."""

import numpy as np
import pytest

from handclean.gaps.cross_validation import choose, fits_to_try, lengths_to_try, shape


def wander(rng, frames, noise):
    """A path of random acceleration, seen with noise."""
    push = np.convolve(rng.normal(size=frames), np.ones(9) / 9, mode="same")
    path = np.cumsum(np.cumsum(push)) * 1e-4
    return path, path + rng.normal(scale=noise, size=frames)


def test_noise_makes_fits_longer(rng):
    known = np.ones((4000, 1), dtype=bool)
    quiet = wander(rng, 4000, 1e-9)[1][:, None]
    loud = wander(rng, 4000, 3e-2)[1][:, None]
    assert choose(quiet, known, 25, 100.0)[0].frames == 5
    assert choose(loud, known, 25, 100.0)[0].frames == 10


@pytest.mark.parametrize("gap", [5, 15, 25])
def test_the_law_says_how_far_off_bridges_are(rng, gap):
    from handclean.gaps.min_acceleration import bridge
    from handclean.gaps.runs import Limits, clusters_of

    path = wander(rng, 6000, 0.0)[0][:, None]
    whole = np.ones(6000, dtype=bool)
    fit, law = choose(path, whole[:, None], 25, 100.0)
    limits = Limits(longest=gap, seed=5, rate=100.0)
    inside = []
    for start in range(103, 5800, 71):  # not where the trial looked
        known = whole.copy()
        known[start : start + gap] = False
        (part,) = bridge(path, known, clusters_of(known, limits)[0], fit, 10)
        off = np.abs(part.path - path[start : start + gap])[gap // 2, 0]
        inside.append(off / np.sqrt(law.variance(gap, part.bend)[0]))
    inside = np.array(inside)
    assert 0.55 < np.mean(inside < 1.0) < 0.85
    assert np.mean(inside < 2.0) > 0.88


def test_errors_grow_with_the_gap(rng):
    path = wander(rng, 3000, 0.0)[1][:, None]
    law = choose(path, np.ones((3000, 1), dtype=bool), 50, 100.0)[1]
    bend = np.array([1e-4])
    spread = [law.variance(n, bend)[0] for n in (1, 3, 10, 30, 50, 80)]
    assert all(np.diff(spread) > 0.0)


def test_a_take_too_short_to_try_gets_a_law_of_its_bend():
    still = np.zeros((12, 1))
    fit, law = choose(still, np.ones((12, 1), dtype=bool), 50, 100.0)
    assert fit in fits_to_try(100.0)
    assert (
        law.variance(10, np.array([2.0]))[0] > law.variance(5, np.array([2.0]))[0] > 0
    )


def test_errors_are_largest_in_the_middle_and_vanish_towards_the_ends():
    along = shape(9)
    assert np.argmax(along) == 4
    assert along[4] == pytest.approx(1.0)
    np.testing.assert_allclose(along, along[::-1])


@pytest.mark.parametrize("longest", [0, 1, 2, 10, 50, 51, 100])
def test_lengths_to_try_are_odd_and_reach_the_longest(longest):
    lengths = lengths_to_try(longest)
    assert np.all(lengths % 2 == 1)
    assert lengths[0] == 1
    assert lengths[-1] in (max(longest - 1, 1), max(longest, 1))
    assert np.all(np.diff(lengths) > 0)
