"""The contract every model of a rotation keeps, and what each is."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from handclean.errors import HandcleanError, ShapeError, UnknownNameError
from handclean.glove.models import BATCH_READINGS, KINDS, fit, from_arrays
from handclean.glove.scaled import EXACT, TABLE_2
from handclean.numerics.gp.settings import FitSettings

SETTINGS = FitSettings(subset=48, starts=2, pseudo_inputs=15, evaluations=30)
PROCESSES = (*EXACT, "spgp")
SMOOTH = ("lmc-gpr", "m0-rbf", "ml-seard+seard", "spgp")


def bent(inputs):
    """A rotation [rad] of two sensors that affect each other; a third does nothing."""
    main, other = inputs[:, 0], inputs[:, 1]
    return 0.3 * main + 0.05 * np.sin(2.0 * main) * other - 0.1


def samples(rng, count=120, noise=0.01):
    inputs = rng.uniform(-2.0, 2.0, size=(count, 3))
    return inputs, bent(inputs) + noise * rng.normal(size=count)


def fitted(kind, rng, **given):
    return fit(kind, *samples(rng, **given), SETTINGS, np.random.default_rng(1))


every_kind = pytest.mark.parametrize("kind", KINDS)
every_process = pytest.mark.parametrize("kind", PROCESSES)


@every_kind
def test_the_same_seed_gives_the_same_model(kind):
    first, second = (fitted(kind, np.random.default_rng(3)) for _ in range(2))
    left, right = first.to_arrays(), second.to_arrays()
    assert left.keys() == right.keys()
    for name in left:
        assert_array_equal(left[name], right[name])


@every_kind
def test_a_model_made_again_from_its_arrays_predicts_the_same(kind, rng):
    model = fitted(kind, rng)
    arrays = model.to_arrays()
    assert all(array.dtype == np.float64 for array in arrays.values())
    again = from_arrays(kind, arrays)
    new = rng.normal(size=(20, 3))
    assert_array_equal(again.predict(new), model.predict(new))
    assert (again.nlml, again.noise) == (model.nlml, model.noise)
    assert again.hyperparameters == model.hyperparameters
    assert again.figures.evaluations == model.figures.evaluations
    assert again.figures.constant == model.figures.constant


@every_kind
def test_a_model_that_has_predicted_travels_light(kind, rng):
    model = fitted(kind, rng)
    size = len(pickle.dumps(model))
    new = rng.normal(size=(5, 3))
    expected = model.predict(new)
    carried = pickle.dumps(model)
    assert len(carried) == size
    assert_array_equal(pickle.loads(carried).predict(new), expected)


@every_kind
def test_long_streams_are_predicted_like_short_ones(kind, rng):
    model = fitted(kind, rng)
    new = rng.normal(size=(2 * BATCH_READINGS + 3, 3))
    mean, variance = model.predict(new)
    assert mean.shape == variance.shape == (len(new),)
    for at in (0, BATCH_READINGS - 1, BATCH_READINGS, len(new) - 1):
        one = model.predict(new[at : at + 1])
        assert_allclose(one[0][0], mean[at], rtol=1e-9, atol=1e-12)
        assert_allclose(one[1][0], variance[at], rtol=1e-6, atol=1e-12)
    assert model.predict(new[:0])[0].shape == (0,)


@every_kind
def test_the_variance_of_a_measurement_has_the_noise_too(kind, rng):
    model = fitted(kind, rng)
    new = rng.normal(size=(9, 3))
    _, plain = model.predict(new)
    _, measured = model.predict(new, noise=True)
    assert_allclose(measured, plain + model.noise**2, rtol=1e-12)
    assert (plain >= 0.0).all()


@every_kind
def test_a_reading_that_is_missing_gives_no_angle_and_spoils_no_other(kind, rng):
    model = fitted(kind, rng)
    new = rng.normal(size=(6, 3))
    whole = model.predict(new)
    holed = new.copy()
    holed[2, 0] = np.nan
    for values, before in zip(model.predict(holed), whole, strict=True):
        others = np.arange(6) != 2
        assert_allclose(values[others], before[others], rtol=1e-9, atol=1e-12)
    assert np.isnan(model.predict(holed)[0][2])


@every_kind
def test_the_units_of_readings_and_rotations_do_not_matter(kind, rng):
    inputs, targets = samples(rng)
    new = rng.uniform(-2.0, 2.0, size=(30, 3))
    shift, size = np.array([80.0, -3.0, 500.0]), np.array([40.0, 0.01, 7.0])
    unit, origin = 57.3, 12.0
    one = fit(kind, inputs, targets, SETTINGS, np.random.default_rng(1))
    other = fit(
        kind,
        inputs * size + shift,
        targets * unit + origin,
        SETTINGS,
        np.random.default_rng(1),
    )
    mean, variance = one.predict(new)
    again, variance_again = other.predict(new * size + shift)
    spread = targets.std()
    # stopped early, a descent may stop elsewhere: a thousandth of what there is
    assert_allclose((again - origin) / unit, mean, atol=3e-3 * spread)
    assert_allclose(
        np.sqrt(variance_again) / unit, np.sqrt(variance), atol=3e-3 * spread
    )
    assert other.noise / unit == pytest.approx(one.noise, rel=1e-2)
    expected = one.nlml + len(targets) * np.log(unit)
    assert other.nlml == pytest.approx(expected, abs=0.3)


@every_kind
def test_a_constant_channel_and_duplicates_are_told_and_survived(kind, rng):
    inputs, targets = samples(rng, count=60)
    inputs[:, 2] = 7.0
    inputs, targets = np.tile(inputs, (2, 1)), np.tile(targets, 2)
    model = fit(kind, inputs, targets, SETTINGS, rng)
    assert model.figures.constant == (False, False, True)
    assert model.figures.duplicates == 60
    mean, variance = model.predict(inputs[:60])
    assert np.isfinite(mean).all()
    assert np.isfinite(variance).all()


@every_kind
def test_samples_that_cannot_be_learnt_from_are_named(kind, rng):
    inputs, targets = samples(rng, count=20)
    holed = targets.copy()
    holed[3] = np.nan
    with pytest.raises(HandcleanError, match="1 of 20 are not finite"):
        fit(kind, inputs, holed, SETTINGS, rng)
    with pytest.raises(HandcleanError, match=r"rotation is 0\.5 in all"):
        fit(kind, inputs, np.full(20, 0.5), SETTINGS, rng)
    with pytest.raises(HandcleanError, match="needs at least"):
        fit(kind, inputs[:1], targets[:1], SETTINGS, rng)
    with pytest.raises(ShapeError):
        fit(kind, inputs, targets[:-1], SETTINGS, rng)


@every_kind
def test_readings_of_another_number_of_sensors_are_refused(kind, rng):
    with pytest.raises(ShapeError, match="inputs"):
        fitted(kind, rng).predict(np.zeros((4, 2)))


def test_unknown_kinds_and_missing_arrays_are_named(rng):
    with pytest.raises(UnknownNameError, match="did you mean lmc-gpr"):
        fit("lmc-gp", *samples(rng), SETTINGS, rng)
    arrays = fitted("linear", rng).to_arrays()
    del arrays["score"]
    with pytest.raises(HandcleanError, match="'score'"):
        from_arrays("linear", arrays)


def test_too_many_samples_for_a_full_model_are_refused_but_not_for_spgp(rng):
    few = FitSettings(subset=16, max_samples=50, pseudo_inputs=5, evaluations=5)
    with pytest.raises(HandcleanError, match="spgp takes them"):
        fit("lmc-gpr", *samples(rng, count=60), few, rng)
    assert fit("spgp", *samples(rng, count=60), few, rng).figures.samples == 60


def test_fits_in_threads_are_those_one_after_the_other(rng):
    data = [samples(rng, count=80) for _ in range(4)]

    def one(part):
        return fit("lmc-gpr", *part, SETTINGS, np.random.default_rng(0)).nlml

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(one, data)) == [one(part) for part in data]


@pytest.mark.parametrize("kind", SMOOTH)
def test_a_bent_response_is_found_to_a_fraction_of_the_noise(kind, rng):
    model = fitted(kind, rng, count=300)
    new = rng.uniform(-1.8, 1.8, size=(200, 3))
    error = model.predict(new)[0] - bent(new)
    assert np.sqrt((error**2).mean()) < 0.008
    # the sparse model's variance between pseudo-inputs takes over some of the noise
    assert (0.4 if kind == "spgp" else 0.75) < model.noise / 0.01 < 1.25
    line = fitted("linear", rng, count=300).predict(new)[0] - bent(new)
    assert np.sqrt((line**2).mean()) > 0.02


@pytest.mark.parametrize("kind", SMOOTH)
def test_the_variance_grows_away_from_the_samples(kind, rng):
    model = fitted(kind, rng)
    away = np.array([[0.0, 0.0, 0.0], [6.0, -6.0, 0.0], [30.0, -30.0, 0.0]])
    _, variance = model.predict(away)
    assert variance[0] < 0.1 * variance[1] <= variance[2]


@pytest.mark.parametrize("kind", ["lmc-gpr", "spgp"])
def test_measurements_lie_within_one_and_two_sigma_as_often_as_they_should(kind, rng):
    model = fitted(kind, rng, count=300)
    new = rng.uniform(-2.0, 2.0, size=(400, 3))
    mean, variance = model.predict(new, noise=True)
    away = np.abs(bent(new) + 0.01 * rng.normal(size=400) - mean) / np.sqrt(variance)
    # the sparse model's variance may be too large between pseudo-inputs, not too small
    most = (0.76, 0.985) if kind == "lmc-gpr" else (0.85, 1.0)
    assert 0.62 < (away < 1.0).mean() < most[0]
    assert 0.92 < (away < 2.0).mean() < most[1]


def test_spgp_with_enough_pseudo_inputs_is_nearly_the_full_model(rng):
    inputs, targets = samples(rng, count=200)
    many = FitSettings(subset=48, starts=2, pseudo_inputs=80, evaluations=60)
    new = rng.uniform(-1.8, 1.8, size=(100, 3))
    full, sparse = (
        fit(kind, inputs, targets, many, np.random.default_rng(0)).predict(new)[0]
        for kind in ("lmc-gpr", "spgp")
    )
    assert np.sqrt(((full - sparse) ** 2).mean()) < 0.003


def test_more_in_the_model_explains_more(rng):
    inputs, targets = samples(rng, count=200)
    nlml = {
        kind: fit(kind, inputs, targets, SETTINGS, np.random.default_rng(0)).nlml
        for kind in (*TABLE_2, "linear")
    }
    for terms in ("rbf", "lard", "lard+seard"):
        assert nlml[f"ml-{terms}"] <= nlml[f"m0-{terms}"] + 0.05
    assert nlml["ml-lard+seard"] < nlml["ml-lard"] - 100.0
    # a linear covariance beside a linear mean has nothing left to explain
    assert nlml["ml-lard"] == pytest.approx(nlml["linear"], abs=0.05)


def test_linear_is_least_squares(rng):
    inputs, targets = samples(rng)
    model = fit("linear", inputs, targets, SETTINGS, rng)
    columns = np.column_stack([inputs, np.ones(len(inputs))])
    weights, squares, _, _ = np.linalg.lstsq(columns, targets, rcond=None)
    new = rng.normal(size=(10, 3))
    mean, variance = model.predict(new)
    rows = np.column_stack([new, np.ones(len(new))])
    assert_allclose(mean, rows @ weights, rtol=1e-9)
    noise = squares[0] / (len(targets) - 4)
    assert model.noise == pytest.approx(np.sqrt(noise), rel=1e-9)
    within = rows @ np.linalg.inv(columns.T @ columns) @ rows.T
    assert_allclose(variance, noise * np.diag(within), rtol=1e-8)


def test_two_pose_goes_through_its_poses_and_sees_only_the_first_sensor(rng):
    inputs = np.array([[10.0, 3.0], [10.0, 9.0], [60.0, 1.0], [60.0, 4.0]])
    targets = np.array([0.0, 0.0, 1.5, 1.5])
    model = fit("two-pose", inputs, targets, SETTINGS, rng)
    assert_allclose(model.predict(inputs)[0], targets, atol=1e-12)
    assert model.predict(np.array([[35.0, -80.0]]))[0][0] == pytest.approx(0.75)
    with pytest.raises(HandcleanError, match="the same in the two poses"):
        fit("two-pose", inputs[:, :1] * 0.0 + 5.0, targets, SETTINGS, rng)


@pytest.mark.parametrize(("kind", "seed"), [("spgp", 0), ("spgp", 2), ("lmc-gpr", 2)])
def test_poses_with_one_angle_each_do_not_make_a_wild_curve(kind, seed):
    """Readings vary while a pose is held, its angle does not: as if without noise."""
    rng = np.random.default_rng(seed)
    angles = np.radians([-18.0, 0.0, 10.0, 20.0, 44.0, 82.0])
    means = np.array([50.0, 64.0, 83.0, 89.0, 130.0, 186.0])
    inputs = rng.normal(np.repeat(means, 50), 2.0)[:, None]
    targets = np.repeat(angles, 50)
    settings = FitSettings(least_noise=float(np.radians(0.5)))
    made = fit(kind, inputs, targets, settings, rng)
    assert np.degrees(made.noise) >= 0.5 - 1e-9
    between = np.linspace(50.0, 186.0, 200)[:, None]
    line = np.interp(between[:, 0], means, angles)
    mean, variance = made.predict(between)
    assert np.degrees(np.abs(mean - line)).max() < 15.0
    assert np.degrees(np.sqrt(variance)).max() < 30.0
