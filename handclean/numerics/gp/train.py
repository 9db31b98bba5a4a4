"""From samples to hyperparameters, with few dear evaluations.

Starting points are compared, and the best brought to its minimum, on a random subset
of the samples; from there a larger subset and then all samples need only a few steps of
`descend`, because the Hessian at the smaller subset's minimum, by differences of
gradients and times the ratio of the numbers of samples, is nearly the right one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.numerics.gp.descent import Descent, Function, descend
from handclean.numerics.gp.exact import Evidence
from handclean.numerics.gp.kernels import Kernel
from handclean.numerics.gp.settings import FitSettings

Start = tuple[Floats, Floats | None]
"""A point, and the Hessian there if it is known."""

START_LOG_NOISE_VARIANCE = np.log(0.1)
"""Logarithm of the noise's variance at the start; targets have variance 1 (chosen)."""

SUBSET_GROWTH_FACTOR = 4
"""How many times larger each subset of the samples is than the one before (chosen)."""

MOST_RIVAL_SAMPLES = 1024
"""Samples of a subset up to which several starting points are compared (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Trained:
    """Hyperparameters that explain the samples best.

    Attributes
    ----------
    logs : the kernel's and, last, the noise's variance; logarithms.
    pseudo : (M, S) pseudo-inputs, none for the exact model.
    evaluations : with all samples; subset_evaluations : with fewer.
    converged : False if it was stopped.
    value : negative log evidence of the scaled targets.
    jitter : the most that a singular covariance needed on its diagonal.
    """

    logs: Floats
    pseudo: Floats
    value: float
    jitter: float
    evaluations: int
    subset_evaluations: int
    converged: bool


def bounds(kernel: Kernel, least_noise: float = 0.0) -> tuple[Floats, Floats]:
    """Lowest and highest logarithms, the noise's last.

    Inputs and targets have deviation 1: a variance below 1e-8 does nothing, and a
    length outside 1/100 to 1000 deviations is one between samples or none at all.
    Without a least noise, samples with the same target draw a function that is flat
    at them and anything between: its evidence has no limit.
    """
    lower = [-14.0 if "gamma" in name else -18.5 for name in kernel.names]
    noise = float(
        np.clip(2.0 * np.log(max(least_noise, 1e-9)), -18.5, START_LOG_NOISE_VARIANCE)
    )
    return np.array([*lower, noise]), np.array([9.0] * kernel.size + [2.0])


def start(kernel: Kernel, which: int, rng: np.random.Generator) -> Floats:
    """A starting point: the first one plain, others about it.

    Every further squared exponential of a sum starts shorter and smaller than the one
    before, or they would stay the same.
    """
    logs, seen = np.zeros(kernel.size + 1), 0
    logs[-1] = START_LOG_NOISE_VARIANCE
    for place, name in enumerate(kernel.names):
        if name.endswith("eta"):
            seen += 1
            logs[place] = -2.0 * (seen - 1)
        elif "gamma" in name:
            logs[place] = 2.0 * (seen - 1)
    if which:
        logs += rng.normal(0.0, 1.5, len(logs))
    return logs


def hessian(function: Function, found: Descent, step: float = 3e-3) -> Floats:
    """Positive definite Hessian where a descent ended, by differences of gradients."""
    rows = [
        (function(found.point + move)[1] - found.gradient) / step
        for move in step * np.eye(len(found.point))
    ]
    matrix = np.array(rows)
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    values = np.maximum(np.abs(values), 1e-3 * np.abs(values).max())
    positive: Floats = (vectors * values) @ vectors.T
    return positive


def train_exact(
    kernel: Kernel,
    mean: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> Trained:
    """Maximise the exact model's evidence.

    Parameters
    ----------
    inputs : (N, S); targets : (N,), both scaled.
    rng : draws subsets and starting points.
    """
    order = rng.permutation(len(inputs))
    rivals = [start(kernel, which, rng) for which in range(settings.starts)]
    lower, upper = bounds(kernel, settings.least_noise)
    cheap = 0
    found: Descent | None = None
    matrix: Floats | None = None
    shorter: list[Start] = []
    for size, following in _ladder(settings.subset, len(inputs)):
        chosen = np.sort(order[:size])
        evidence = Evidence(kernel, mean, inputs[chosen], targets[chosen])
        if found is None:
            descents = _tried(evidence, rivals, lower, upper)
            rivals += [descent.point for descent in descents]
            found = descents[0]
        else:
            most = settings.evaluations if following is None else 40
            begin, matrix = _better(evidence, [(found.point, matrix), *shorter])
            found = descend(
                evidence, begin, lower, upper, hessian=matrix, evaluations=most
            )
            if size <= MOST_RIVAL_SAMPLES:
                found = _rivalled(evidence, found, rivals, lower, upper)
        if following is not None:
            growth = following / size
            matrix = hessian(evidence, found) * growth
            shorter = [_shorter(kernel, evidence, found, lower, upper, growth)]
            cheap += evidence.evaluations
    assert found is not None
    return Trained(
        logs=found.point,
        value=found.value,
        jitter=evidence.jitter,
        pseudo=np.zeros((0, inputs.shape[1])),
        evaluations=evidence.evaluations,
        subset_evaluations=cheap,
        converged=found.converged,
    )


def _ladder(subset: int, count: int) -> list[tuple[int, int | None]]:
    """Numbers of samples to train with in turn, each with the next."""
    sizes = [count]
    while sizes[0] > 1.5 * subset:
        sizes.insert(0, max(sizes[0] // SUBSET_GROWTH_FACTOR, subset))
    return list(zip(sizes, [*sizes[1:], None], strict=True))


def _tried(
    evidence: Function, starts: Sequence[Floats], lower: Floats, upper: Floats
) -> list[Descent]:
    """Descents from starting points, the deepest first: it alone went to its end."""
    tried = [descend(evidence, point, lower, upper, evaluations=30) for point in starts]
    tried.sort(key=lambda descent: descent.value)
    best = tried[0]
    tried[0] = descend(evidence, best.point, lower, upper, hessian=best.hessian)
    return tried


def _shorter(
    kernel: Kernel,
    evidence: Function,
    found: Descent,
    lower: Floats,
    upper: Floats,
    growth: float,
) -> Start:
    """Where a descent ends that begins with shorter lengths and less noise.

    What few samples can only take for noise, more of them may follow.
    """
    gamma = np.array(["gamma" in name for name in kernel.names])
    eta = np.array([name.endswith("eta") for name in kernel.names])
    begin = found.point.copy()
    begin[:-1][eta] = np.maximum(begin[:-1][eta], -1.0)
    begin[:-1][gamma] = np.maximum(begin[:-1][gamma], 0.0) + 2.0
    begin[-1] -= 2.0
    other = descend(evidence, begin, lower, upper, evaluations=30)
    return other.point, hessian(evidence, other) * growth


def _better(evidence: Function, starts: Sequence[Start]) -> Start:
    """The starting point of least value, with its Hessian."""
    if len(starts) == 1:
        return starts[0]
    values = [evidence(point)[0] for point, _ in starts]
    return starts[int(np.argmin(values))]


def _rivalled(
    evidence: Function,
    found: Descent,
    rivals: Sequence[Floats],
    lower: Floats,
    upper: Floats,
) -> Descent:
    """What was found, or a deeper place from a point that few samples thought worse.

    Few samples may see nothing but noise where more see a bent response.
    """
    values = [evidence(point)[0] for point in rivals]
    best = int(np.argmin(values))
    if not values[best] < found.value:
        return found
    other = descend(evidence, rivals[best], lower, upper, evaluations=80)
    return other if other.value < found.value else found
