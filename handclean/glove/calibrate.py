"""A calibration: a model per measured rotation, learnt from samples.

The entry of ``calibrate-glove fit`` and ``apply``. What a rotation's model takes is its
measuring sensor and those that affect it; the linear calibrations, which know nothing
of coupling, take the measuring sensor alone. Rotations that follow others get their
mean and variance from them. How far
their variance can be believed, `handclean.glove.held_out` finds by holding recordings
out; what another wearing changes, which no single wearing shows, is added.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.errors import HandcleanError
from handclean.glove.gloves import Correspondence, Glove
from handclean.glove.held_out import angles_told, held_out
from handclean.glove.models import Fitted, fit
from handclean.glove.samples import FK, IK, Samples, spread
from handclean.glove.settings import GloveFitConfig
from handclean.numerics.gp.settings import FitSettings

LINEAR = ("linear", "two-pose")
"""Models of one sensor."""

_FEW = 3
"""Angles below which a rotation's curve is not known between them."""

_RULE = 0.1
"""Share of what follows (a DIP its PIP) by which people differ from the rule."""

_BEYOND = 0.25
"""Readings this share of the samples' range outside of it are foreign to them."""


@dataclass(frozen=True, kw_only=True)
class FitTask:
    """What one process needs to fit one rotation.

    Attributes
    ----------
    rotation : its name; sensors : names of the C inputs.
    inputs : (N, C); targets : (N,) [rad].
    group : (N,) the recording each sample is of.
    fk, ik : how many of the samples are of each kind.
    kind, settings, seed : of the model.
    """

    rotation: str
    sensors: tuple[str, ...]
    inputs: Floats
    targets: Floats
    group: Ints
    fk: int
    ik: int
    kind: str
    settings: FitSettings
    seed: int


@dataclass(frozen=True, kw_only=True)
class RotationFit:
    """The model of one rotation.

    Attributes
    ----------
    rotation, sensors : what of what.
    fitted : the model.
    fk, ik : samples it was learnt from.
    scale, floor : k and e [rad] of its variance.
    """

    rotation: str
    sensors: tuple[str, ...]
    fitted: Fitted
    fk: int
    ik: int
    scale: float = 1.0
    floor: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Wearing:
    """How a wearing differs from the one of the samples, see `handclean.glove.rewear`.

    Attributes
    ----------
    middle, shift, gain : (S,) of x' = middle + gain (x - middle) + shift.
    doubt : [rad] what is not known of them, one standard deviation.
    """

    middle: Floats
    shift: Floats
    gain: Floats
    doubt: float

    def as_before(self, readings: Floats) -> Floats:
        """(T, S) readings x' of the earlier wearing for x of this one."""
        out: Floats = self.middle + self.gain * (readings - self.middle) + self.shift
        return out


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """What turns a glove's readings into rotations.

    Attributes
    ----------
    glove : which it is for.
    kind : of the models; use : of samples, "all", "fk" or "ik".
    subject : who wore it.
    fits : one per measured rotation, in the glove's order; some may be missing.
    low, high : (S,) readings of the samples' range, NaN for sensors not used.
    repeat : [rad] what another wearing changes, one standard deviation.
    wearing : what the readings of this wearing were in that of the samples; None if it
        is the same.
    """

    glove: Glove
    kind: str
    use: str
    subject: str
    fits: tuple[RotationFit, ...]
    low: Floats
    high: Floats
    repeat: float = 0.0
    wearing: Wearing | None = None

    def as_sampled(self, readings: Floats) -> Floats:
        """(T, S) what the samples' wearing would have read."""
        return readings if self.wearing is None else self.wearing.as_before(readings)


def fit_tasks(
    glove: Glove, samples: Samples, settings: GloveFitConfig, seed: int
) -> tuple[list[FitTask], tuple[str, ...]]:
    """List the fits of a calibration, and what should be known of them.

    Raises
    ------
    HandcleanError
        If no rotation can be learnt, or a sensor never changed.
    """
    if settings.use != "all":
        samples = samples.chosen(samples.kind == {"fk": FK, "ik": IK}[settings.use])
    tasks, told = [], []
    for number, row in enumerate(glove.measured):
        task, why = _task(glove, row, samples, settings, seed + number)
        if task is None:
            told.append(f"{row.rotation} is not calibrated: {why}")
            continue
        tasks.append(task)
        if (count := angles_told(task.targets, task.group)) < _FEW:
            told.append(
                f"{row.rotation} is known at {count} angles; what lies between is a "
                f"guess, {_FEW} or more would tell"
            )
    if not tasks:
        raise HandcleanError(
            "samples: tell no rotation" + (f" ({told[0]})" if told else "")
        )
    return tasks, tuple(told)


def _task(
    glove: Glove,
    row: Correspondence,
    samples: Samples,
    settings: GloveFitConfig,
    seed: int,
) -> tuple[FitTask | None, str]:
    """Return the fit of one rotation, or why there is none."""
    sensors = row.inputs[:1] if settings.model in LINEAR else row.inputs
    columns = [glove.sensors.index(sensor) for sensor in sensors]
    targets = samples.targets[:, glove.hand.index(row.rotation)]
    inputs = samples.readings[:, columns]
    known = np.flatnonzero(np.isfinite(targets) & np.isfinite(inputs).all(axis=1))
    if len(known) < len(sensors) + 3:
        return None, f"{len(known)} samples know it"
    if np.ptp(targets[known]) < 1e-6:
        angle = np.degrees(targets[known[0]])
        return None, f"it is {angle:.4g} degrees in all its {len(known)} samples"
    if np.ptp(inputs[known, 0]) <= 1e-9 * np.abs(inputs[known, 0]).max():
        raise HandcleanError(
            f"samples: {row.measured_by} reads {inputs[known[0], 0]:g} in all "
            f"{len(known)} samples of {row.rotation}; a sensor that works changes"
        )
    rows = known[_even(samples, known, settings.most)]
    kinds = samples.kind[rows]
    return (
        FitTask(
            rotation=row.rotation,
            sensors=sensors,
            inputs=np.ascontiguousarray(inputs[rows]),
            targets=np.ascontiguousarray(targets[rows]),
            group=samples.group[rows],
            fk=int((kinds == FK).sum()),
            ik=int((kinds == IK).sum()),
            kind=settings.model,
            settings=FitSettings(
                starts=settings.starts,
                pseudo_inputs=max(min(settings.pseudo_inputs, len(rows) - 1), 1),
                evaluations=settings.evaluations,
                least_noise=float(np.radians(settings.noise_deg)),
            ),
            seed=seed,
        ),
        "",
    )


def _even(samples: Samples, known: Ints, most: int) -> Ints:
    """Places in ``known`` of at most so many samples; small recordings stay whole."""
    if most <= 0 or len(known) <= most:
        return np.arange(len(known))
    groups = samples.group[known]
    numbers, counts = np.unique(groups, return_counts=True)
    left, quota = most, {}
    for done, k in enumerate(np.argsort(counts, kind="stable")):
        quota[numbers[k]] = min(int(counts[k]), left // (len(numbers) - done))
        left -= quota[numbers[k]]
    kept = [
        np.flatnonzero(groups == number)[spread(int(count), quota[number])]
        for number, count in zip(numbers, counts, strict=True)
        if quota[number] > 0
    ]
    return np.sort(np.concatenate(kept))


def run_task(task: FitTask) -> RotationFit:
    """Fit one rotation; the same task gives the same model in any process.

    Raises
    ------
    HandcleanError
        If its samples cannot be fitted; says which rotation.
    """
    rng = np.random.default_rng(task.seed)
    try:
        fitted = fit(task.kind, task.inputs, task.targets, task.settings, rng)
    except HandcleanError as error:
        raise HandcleanError(f"{error}", where=task.rotation) from None
    least = task.settings.least_noise
    scale, floor = held_out(
        task.kind, task.inputs, task.targets, task.group, least, rng
    )
    return RotationFit(
        rotation=task.rotation,
        sensors=task.sensors,
        fitted=fitted,
        fk=task.fk,
        ik=task.ik,
        scale=scale,
        floor=floor,
    )


def assemble(
    glove: Glove,
    samples: Samples,
    settings: GloveFitConfig,
    fits: Sequence[RotationFit],
) -> Calibration:
    """Put the models of all rotations together."""
    low, high = (np.full(len(glove.sensors), np.nan) for _ in range(2))
    own = [glove.sensors.index(sensor) for sensor in glove.used]
    low[own] = samples.readings[:, own].min(axis=0)
    high[own] = samples.readings[:, own].max(axis=0)
    order = [row.rotation for row in glove.measured]
    return Calibration(
        glove=glove,
        kind=settings.model,
        use=settings.use,
        subject=samples.subject,
        fits=tuple(sorted(fits, key=lambda f: order.index(f.rotation))),
        low=low,
        high=high,
        repeat=float(np.radians(settings.repeat_deg)),
    )


def calibrate(
    glove: Glove, samples: Samples, settings: GloveFitConfig, seed: int = 0
) -> Calibration:
    """Fit all rotations, one after the other."""
    tasks, _ = fit_tasks(glove, samples, settings, seed)
    return assemble(glove, samples, settings, [run_task(task) for task in tasks])


def predict_measured(
    calibration: Calibration, readings: Floats
) -> tuple[Floats, Floats]:
    """(T, R') [rad], [rad^2] mean and variance of measured rotations.

    Those that are not calibrated stay at 0 with a variance of NaN.
    """
    glove = calibration.glove
    worn = calibration.wearing
    off = calibration.repeat if worn is None else worn.doubt
    readings = calibration.as_sampled(readings)
    order = [row.rotation for row in glove.measured]
    mean = np.zeros((len(readings), len(order)))
    variance = np.full(mean.shape, np.nan)
    for one in calibration.fits:
        columns = [glove.sensors.index(sensor) for sensor in one.sensors]
        k = order.index(one.rotation)
        inputs = np.ascontiguousarray(readings[:, columns])
        mean[:, k], own = one.fitted.predict(inputs)
        more = one.floor**2 + off**2
        variance[:, k] = one.scale * own + more
    return mean, variance


def to_hinges(
    glove: Glove, names: Sequence[str], mean: Floats, variance: Floats
) -> tuple[Floats, Floats]:
    """(T, D) [rad] hinge angles and their sigma from measured rotations.

    Rotations count as independent. One that follows others is in doubt as they are,
    and as people differ in how it follows. A hinge that nothing measures stays where
    the glove says, or at zero, and its sigma is NaN.
    """
    factor, rest = glove.completion()
    follows = [r for r in glove.hand.rotations if glove.row(r).follows is not None]
    rule = [glove.hand.index(r) for r in follows]
    matrix = glove.hand.to_hinges(names)
    couple = matrix @ factor
    angles = np.tile(matrix @ rest, (len(mean), 1))
    sigma = np.full(angles.shape, np.nan)
    for d in np.flatnonzero(np.abs(couple).sum(axis=1) > 0.0):
        used = couple[d] != 0.0  # what is missing spoils only what needs it
        angles[:, d] += mean[:, used] @ couple[d, used]
        doubt = variance[:, used] @ couple[d, used] ** 2
        for r in rule:
            if matrix[d, r] != 0.0:
                followed = mean[:, used] @ factor[r, used]
                doubt += (_RULE * matrix[d, r] * followed) ** 2
        sigma[:, d] = np.sqrt(doubt)
    return angles, sigma


def sure(calibration: Calibration, variance: Floats, max_sigma: float) -> Bools:
    """(T,) frames in which every calibrated rotation is sure enough [rad]."""
    order = [row.rotation for row in calibration.glove.measured]
    own = [order.index(one.rotation) for one in calibration.fits]
    return np.asarray((variance[:, own] <= max_sigma**2).all(axis=1))


def foreign(calibration: Calibration, readings: Floats) -> Bools:
    """(T, S) whether a sensor reads what no sample came near."""
    readings = calibration.as_sampled(readings)
    size = calibration.high - calibration.low
    with np.errstate(invalid="ignore"):
        below = readings < calibration.low - _BEYOND * size
        out = below | (readings > calibration.high + _BEYOND * size)
    return np.asarray(out)
