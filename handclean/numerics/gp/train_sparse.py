"""From samples to hyperparameters and pseudo-inputs of the sparse model.

All are found together by L-BFGS, pseudo-inputs measured in the kernel's lengths: that,
and where they start, decides how far so many evaluations get.
"""

import numpy as np
from scipy.optimize import minimize

from handclean.arrays import Floats
from handclean.numerics.gp.kernels import Kernel
from handclean.numerics.gp.settings import FitSettings
from handclean.numerics.gp.sparse import JITTER_VARIANCES, SparseEvidence
from handclean.numerics.gp.train import (
    SUBSET_GROWTH_FACTOR,
    Trained,
    bounds,
    train_exact,
)

PSEUDO_INPUT_CANDIDATES = 2048
"""Samples among which pseudo-inputs are sought, or four times their number (chosen)."""


def train_sparse(
    kernel: Kernel,
    mean: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> Trained:
    """Maximise the sparse model's evidence by pseudo-inputs and hyperparameters.

    The hyperparameters start from the exact model's of a subset, the pseudo-inputs from
    samples so spread out that none of the rest is far from all of them.

    This evidence may be higher than the exact model's: it is that of another model,
    whose variance between the pseudo-inputs takes over from the noise (Bauer et al.
    2016). The longer it is maximised, the less noise remains; the prediction's variance
    with noise stays right, that without it gets too large.

    Parameters
    ----------
    inputs : (N, S); targets : (N,), both scaled.
    """
    order = rng.permutation(len(inputs))
    few = np.sort(order[: SUBSET_GROWTH_FACTOR * settings.subset])
    first = train_exact(kernel, mean, inputs[few], targets[few], settings, rng)
    count = min(settings.pseudo_inputs, len(inputs))
    candidates = inputs[np.sort(order[: max(PSEUDO_INPUT_CANDIDATES, 4 * count)])]
    pseudo = spread_out(kernel, first.logs[:-1], candidates, count)
    evidence = SparseEvidence(kernel, mean, inputs, targets, count)
    lower, upper = bounds(kernel, settings.least_noise)
    units = np.concatenate(
        [
            np.ones(len(lower)),
            np.tile(1.5 * _lengths(kernel, first.logs), count),
        ]
    )
    free = np.full(pseudo.size, np.inf)

    def scaled(vector: Floats) -> tuple[float, Floats]:
        value, gradient = evidence(vector * units)
        return value, gradient * units

    found = minimize(
        scaled,
        np.concatenate([first.logs, pseudo.ravel()]) / units,
        jac=True,
        method="L-BFGS-B",
        bounds=np.column_stack(
            [
                np.concatenate([lower, -free]) / units,
                np.concatenate([upper, free]) / units,
            ]
        ),
        options={
            "maxfun": settings.evaluations,
            "maxiter": settings.evaluations,
            "maxcor": 20,
            "ftol": 1e-9,
        },
    )
    vector = found.x * units
    return Trained(
        logs=vector[: kernel.size + 1],
        value=float(found.fun),
        jitter=0.0 if evidence.jitter == JITTER_VARIANCES[0] else evidence.jitter,
        pseudo=evidence.split(vector)[2],
        evaluations=int(found.nfev),
        subset_evaluations=first.evaluations + first.subset_evaluations,
        converged=bool(found.success),
    )


def _lengths(kernel: Kernel, logs: Floats) -> Floats:
    """(S,) shortest length of each input, in which pseudo-inputs are measured."""
    lengths = np.ones(kernel.inputs)
    for name, log in zip(kernel.names, logs, strict=False):
        if "gamma" in name:
            _, _, which = name.partition("gamma_")
            at = slice(int(which) - 1, int(which)) if which else slice(None)
            lengths[at] = np.minimum(lengths[at], np.exp(-0.5 * log))
    return np.maximum(lengths, 0.1)


def spread_out(kernel: Kernel, logs: Floats, inputs: Floats, count: int) -> Floats:
    """(M, S) those of inputs (N, S) that leave none far from all: pivoted Cholesky.

    Each is the one whose variance, given those before, is largest.
    """
    left = kernel.diagonal(logs, inputs)
    rows = np.zeros((count, len(inputs)))
    chosen = np.zeros(count, dtype=np.int64)
    for place in range(count):
        best = int(left.argmax())
        chosen[place] = best
        row = kernel.gram(logs, inputs[best : best + 1], inputs)[0]
        row -= rows[:place, best] @ rows[:place]
        rows[place] = row / np.sqrt(max(left[best], 1e-12))
        left -= rows[place] ** 2
        left[best] = -np.inf
    return inputs[np.sort(chosen)]
