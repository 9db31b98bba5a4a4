"""Models of all rotations together."""

from dataclasses import replace

import numpy as np
import pytest
from linear_glove import GLOVE, QUICK, linear_samples, readings_of
from told import texts

from handclean.errors import HandcleanError
from handclean.glove import calibrate as cal
from handclean.glove import calibration as calibration_of
from handclean.glove import samples
from handclean.glove.settings import GloveFitConfig

LINE = GloveFitConfig(model="linear")


@pytest.fixture(scope="module")
def made():
    rng = np.random.default_rng(5)
    return cal.calibrate(GLOVE, linear_samples(rng, noise=0.5), QUICK)


def test_rotations_of_a_linear_glove_come_back(made, rng):
    ranges = GLOVE.hand.ranges
    middle, size = ranges.mean(axis=1), np.ptp(ranges, axis=1)
    truth = middle + 0.3 * size * rng.uniform(-1, 1, (50, len(size)))
    mean, variance = calibration_of.predict_measured(made, readings_of(truth))
    own = [GLOVE.hand.index(row.rotation) for row in GLOVE.measured]
    assert np.degrees(np.abs(mean - truth[:, own])).mean() < 1.0
    assert np.all(variance > 0.0)


def test_a_linear_calibration_knows_nothing_of_coupling(rng):
    made = cal.calibrate(GLOVE, linear_samples(rng), LINE)
    assert all(len(fit.sensors) == 1 for fit in made.fits)
    flexion = next(f for f in made.fits if f.rotation == "index_pip_flexion")
    assert np.degrees(flexion.fitted.noise) < 1e-6


def test_what_follows_has_the_sigma_of_what_it_follows(made, rng):
    names = (
        "index_pip_flexion",
        "index_dip_flexion",
        "middle_mcp_abduction",
        "little_mcp_abduction",
        "thumb_cmc_flexion",
    )
    order = [row.rotation for row in GLOVE.measured]
    mean, variance = rng.normal(size=(2, 4, 14)) ** 2
    angles, sigma = calibration_of.to_hinges(GLOVE, names, mean, variance)
    pip = order.index("index_pip_flexion")
    np.testing.assert_allclose(angles[:, 0], mean[:, pip])
    np.testing.assert_allclose(angles[:, 1], 0.6667 * mean[:, pip])
    rule = 0.1 * 0.6667 * mean[:, pip]  # people differ in how a DIP follows
    np.testing.assert_allclose(sigma[:, 1] ** 2, 0.6667**2 * variance[:, pip] + rule**2)
    ring, little = (
        order.index(n) for n in ("middle_ring_abduction", "ring_little_abduction")
    )
    np.testing.assert_allclose(angles[:, 3], -mean[:, ring] - mean[:, little])
    both = variance[:, ring] + variance[:, little]
    np.testing.assert_allclose(sigma[:, 3], np.sqrt(both))
    assert np.all(angles[:, 2] == 0.0)
    assert np.isnan(sigma[:, 2]).all()
    np.testing.assert_allclose(angles[:, 4], np.radians(10.0))  # rests, unmeasured


def test_doubt_grows_away_from_the_samples(made):
    truth = np.tile(GLOVE.hand.ranges.mean(axis=1), (2, 1))
    values = readings_of(truth)
    values[1] += 150.0
    _, variance = calibration_of.predict_measured(made, values)
    assert np.all(variance[1] > variance[0])
    between = np.sqrt(0.5 * (variance[0].max() + variance[1].max()))
    near, far = calibration_of.sure(made, variance, between)
    assert near
    assert not far
    assert calibration_of.foreign(made, values).tolist() == [[False] * 14, [True] * 14]


def test_missing_readings_give_missing_rotations(made):
    values = readings_of(np.tile(GLOVE.hand.ranges.mean(axis=1), (3, 1)))
    values[1, GLOVE.sensors.index("I_PIP")] = np.nan
    mean, variance = calibration_of.predict_measured(made, values)
    k = [row.rotation for row in GLOVE.measured].index("index_pip_flexion")
    assert np.isnan(mean[1, k])
    assert np.isfinite(mean[[0, 2]]).all()
    assert not calibration_of.sure(made, variance, 1.0)[1]


def test_samples_of_one_kind_can_be_taken_alone(rng):
    fk = linear_samples(rng)
    ik = replace(linear_samples(rng), kind=np.ones(120, dtype=np.uint8))
    both = samples.merged([fk, ik])
    for use, counts in (("fk", (120, 0)), ("ik", (0, 120)), ("all", (120, 120))):
        tasks, _ = cal.fit_tasks(GLOVE, both, replace(LINE, use=use), 0)
        assert {(task.fk, task.ik) for task in tasks} == {counts}


def test_thinning_takes_the_most_from_the_longest_recordings(rng):
    one = linear_samples(rng, 130)
    group = np.repeat([0, 1], [10, 120])
    tasks, _ = cal.fit_tasks(
        GLOVE, replace(one, group=group, groups=("a", "b")), replace(LINE, most=60), 0
    )
    assert np.bincount(tasks[0].group).tolist() == [10, 50]


def test_rotations_that_no_sample_tells_are_named(rng):
    one = linear_samples(rng)
    targets = one.targets.copy()
    targets[:, GLOVE.hand.index("ring_pip_flexion")] = np.nan
    targets[:, GLOVE.hand.index("little_pip_flexion")] = 0.1
    tasks, told = cal.fit_tasks(GLOVE, replace(one, targets=targets), LINE, 0)
    assert len(tasks) == 12
    assert any(
        "ring_pip_flexion is not calibrated: 0 samples" in one.text for one in told
    )
    assert any("little_pip_flexion" in x and "5.73 degrees" in x for x in texts(told))
    with pytest.raises(HandcleanError, match="tell no rotation"):
        cal.fit_tasks(
            GLOVE, replace(one, targets=np.full_like(targets, np.nan)), LINE, 0
        )


def test_a_sensor_that_never_changed_is_named(rng):
    one = linear_samples(rng)
    values = one.readings.copy()
    values[:, GLOVE.sensors.index("I_PIP")] = 88.0
    with pytest.raises(HandcleanError, match="I_PIP reads 88 in all 120"):
        cal.fit_tasks(GLOVE, replace(one, readings=values), LINE, 0)


def test_samples_that_come_many_times_are_no_matter(rng):
    one = linear_samples(rng, 40, noise=0.5)
    many = samples.merged([one] * 4)
    made = cal.calibrate(GLOVE, many, replace(QUICK, model="lmc-gpr"))
    mean, variance = calibration_of.predict_measured(made, one.readings)
    own = [GLOVE.hand.index(row.rotation) for row in GLOVE.measured]
    assert np.degrees(np.abs(mean - one.targets[:, own])).mean() < 1.5
    assert np.isfinite(variance).all()
