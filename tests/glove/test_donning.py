"""A calibration adapted to another donning of its glove."""

from dataclasses import replace

import numpy as np
import pytest
from linear_glove import GLOVE, QUICK, linear_samples, readings_of

from handclean.errors import HandcleanError
from handclean.glove import calibrate as cal
from handclean.glove import calibration as calibration_of
from handclean.glove import samples
from handclean.glove.donning import adapt_to_donning

OWN = [GLOVE.hand.index(row.rotation) for row in GLOVE.measured]


@pytest.fixture(scope="module")
def made():
    rng = np.random.default_rng(5)
    return cal.calibrate(GLOVE, linear_samples(rng, 400, noise=0.3), QUICK)


def changed(rng, usual=1.5):
    """Shift and gain of each sensor: readings of a new donning."""
    shift = 100.0 / 90.0 * usual * rng.normal(size=14)
    return shift, 1.0 + 0.02 * rng.normal(size=14)


def donned(values, change):
    return 90.0 + (values - 90.0) * change[1] + change[0]


def some(rng, change, poses, each=20):
    """Samples of poses held still in the new donning."""
    low, high = GLOVE.hand.ranges.T
    share = rng.uniform(0.1, 0.9, (poses, len(low)))
    truth = np.repeat(low + share * (high - low), each, axis=0)
    values = donned(readings_of(truth), change) + 0.3 * rng.normal(
        size=(len(truth), 14)
    )
    one = samples.make_samples(GLOVE, values, truth, samples.FK, "again", "S02")
    group = np.repeat(np.arange(poses), each)
    return replace(one, group=group, groups=tuple(f"p{k}" for k in range(poses)))


def errors(calibration, rng, change):
    low, high = GLOVE.hand.ranges.T
    truth = low + rng.uniform(0.1, 0.9, (200, len(low))) * (high - low)
    mean, _ = calibration_of.predict_measured(
        calibration, donned(readings_of(truth), change)
    )
    return np.degrees(np.abs(mean - truth[:, OWN]))


def test_samples_of_a_new_donning_undo_what_changed(made, rng):
    change = changed(rng)
    found = adapt_to_donning(made, some(rng, change, 8))
    before, after = (errors(c, rng, change) for c in (made, found.calibration))
    assert after.mean() < 0.5 * before.mean()
    assert found.after < 0.5 * found.before
    undone = found.calibration.as_sampled(donned(np.full((1, 14), 90.0), change))
    assert np.abs(undone - 90.0).mean() < 0.4 * np.abs(change[0]).mean()
    assert found.calibration.subject == "S02"


def test_what_did_not_change_is_hardly_changed(made, rng):
    none = np.zeros(14), np.ones(14)
    found = adapt_to_donning(made, some(rng, none, 4))
    assert np.nanmax(np.abs(np.degrees(found.shift))) < 0.5
    assert np.nanmax(np.abs(found.gain - 1.0)) < 0.02
    assert found.scale == 1.0


def test_larger_changes_than_usual_are_seen_as_such(made, rng):
    found = adapt_to_donning(made, some(rng, changed(rng, usual=12.0), 8))
    assert found.scale >= 4.0


def test_more_samples_leave_less_doubt(made, rng):
    change = changed(rng)
    doubts = [
        adapt_to_donning(made, some(rng, change, count)).doubt for count in (1, 4, 16)
    ]
    assert doubts[0] > doubts[1] > doubts[2] > 0.0


def test_frames_of_a_still_recording_count_once(made, rng):
    change = changed(rng)
    few = some(np.random.default_rng(1), change, 3, each=5)
    many = some(np.random.default_rng(1), change, 3, each=200)
    one, other = adapt_to_donning(made, few), adapt_to_donning(made, many)
    assert one.doubt == pytest.approx(other.doubt, rel=0.05)


def test_a_second_adaptation_begins_from_the_samples_donning(made, rng):
    change = changed(rng)
    again = some(rng, change, 4)
    once = adapt_to_donning(made, again)
    twice = adapt_to_donning(once.calibration, again)
    np.testing.assert_array_equal(once.shift, twice.shift)


def test_sensors_without_samples_keep_their_readings(made, rng):
    one = some(rng, changed(rng), 4)
    targets = one.targets.copy()
    targets[:, GLOVE.hand.index("ring_pip_flexion")] = np.nan
    found = adapt_to_donning(made, replace(one, targets=targets))
    k = GLOVE.sensors.index("R_PIP")
    assert found.shift[k] == pytest.approx(0.0, abs=1e-9)
    assert found.gain[k] == pytest.approx(1.0)


def test_samples_of_another_glove_are_refused(made, rng):
    one = some(rng, changed(rng), 2)
    with pytest.raises(HandcleanError, match="the calibration of generic14"):
        adapt_to_donning(made, replace(one, glove="mine"))


def test_samples_that_tell_nothing_are_refused(made, rng):
    one = some(rng, changed(rng), 2)
    with pytest.raises(HandcleanError, match="tell no rotation"):
        adapt_to_donning(made, replace(one, targets=np.full_like(one.targets, np.nan)))
