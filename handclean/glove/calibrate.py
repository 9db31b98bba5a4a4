"""Learn a calibration: a model per measured rotation, from samples.

The entry of ``calibrate-glove fit``. What a rotation's model takes is its measuring
sensor and those that affect it; the linear calibrations, which know nothing of
coupling, take the measuring sensor alone. How far the models' variance can be believed,
`handclean.glove.held_out` finds by holding recordings out; what another donning
changes, which no single donning shows, is added.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError
from handclean.glove.calibration import Calibration, RotationFit
from handclean.glove.gloves import Correspondence, Glove
from handclean.glove.held_out import count_angles, fit_variance
from handclean.glove.models import fit
from handclean.glove.samples import FK, IK, Samples, spread
from handclean.glove.settings import GloveFitConfig
from handclean.numerics.gp.settings import FitSettings
from handclean.remarks import Remark, remark

LINEAR = ("linear", "two-pose")
"""Models of one sensor."""

_LEAST_ANGLES = 3
"""Angles at which a rotation is known, below which its curve between them is not
(chosen)."""

_LEAST_TURN_RAD = 1e-6
"""[rad] a rotation that turns less in all samples is constant (chosen)."""


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


def fit_tasks(
    glove: Glove, samples: Samples, settings: GloveFitConfig, seed: int
) -> tuple[list[FitTask], tuple[Remark, ...]]:
    """List the fits of a calibration, and what should be known of them.

    Parameters
    ----------
    samples : N readings with the rotations that are known of them.
    seed : task k draws from ``seed + k``.

    Returns
    -------
    a task for each rotation that is measured and known, and remarks on the others and
    on rotations known at few angles

    Raises
    ------
    HandcleanError
        If no rotation can be learnt, or a sensor never changed.
    """
    if settings.use != "all":
        samples = samples.chosen(samples.kind == {"fk": FK, "ik": IK}[settings.use])
    tasks: list[FitTask] = []
    remarks: list[Remark] = []
    for number, row in enumerate(glove.measured):
        task, why = _task(glove, row, samples, settings, seed + number)
        if task is None:
            remarks.append(
                remark(
                    "unobserved",
                    f"{row.rotation} is not calibrated: {why}",
                    rotation=row.rotation,
                )
            )
            continue
        tasks.append(task)
        if (count := count_angles(task.targets, task.group)) < _LEAST_ANGLES:
            remarks.append(
                remark(
                    "few",
                    f"{row.rotation} is known at {count} angles; what lies between is "
                    f"a guess, {_LEAST_ANGLES} or more would tell",
                    rotation=row.rotation,
                )
            )
    if not tasks:
        raise HandcleanError(
            "samples: tell no rotation" + (f" ({remarks[0].text})" if remarks else "")
        )
    return tasks, tuple(remarks)


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
    if why := _untold(row, inputs[known], targets[known]):
        return None, why
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
            settings=_fit_settings(settings, len(rows)),
            seed=seed,
        ),
        "",
    )


def _untold(row: Correspondence, inputs: Floats, targets: Floats) -> str:
    """Say why (N, C) readings and (N,) [rad] angles tell nothing of a rotation, or "".

    Raises
    ------
    HandcleanError
        If the measuring sensor never changed although the rotation did.
    """
    count, sensors = inputs.shape
    if count < sensors + 3:
        return f"{count} samples know it"
    if np.ptp(targets) < _LEAST_TURN_RAD:
        angle = np.degrees(targets[0])
        return f"it is {angle:.4g} degrees in all its {count} samples"
    if np.ptp(inputs[:, 0]) <= 1e-9 * np.abs(inputs[:, 0]).max():
        raise HandcleanError(
            f"samples: {row.measured_by} reads {inputs[0, 0]:g} in all "
            f"{count} samples of {row.rotation}; a sensor that works changes"
        )
    return ""


def _fit_settings(settings: GloveFitConfig, samples: int) -> FitSettings:
    """Settings of one rotation's fit, with fewer pseudo-inputs than samples."""
    return FitSettings(
        starts=settings.starts,
        pseudo_inputs=max(min(settings.pseudo_inputs, samples - 1), 1),
        evaluations=settings.evaluations,
        least_noise=float(np.radians(settings.noise_deg)),
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

    Returns
    -------
    the model with the scale and the floor [rad] of its errors, see `held_out`

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
    scale, floor = fit_variance(
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
    """Put the models of all rotations together.

    Parameters
    ----------
    samples : what they were fitted to.
    fits : one for each rotation, in any order.
    """
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
