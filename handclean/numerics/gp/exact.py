"""The exact Gaussian process: evidence, its derivatives, prediction.

With the covariance C = K + sigma^2 I of N samples, residuals r = y - H alpha and
a = C^-1 r, the negative logarithm of the evidence (Wang & Neff 2013, equation 11) and
its derivative by a hyperparameter h (12) are

    f      =  1/2 r^T a + 1/2 log |C| + N/2 log 2 pi
    df/dh  =  1/2 sum_ij G_ij dC_ij/dh,   G = C^-1 - a a^T

C is symmetric: only the half below the diagonal is ever computed, factorised (dpotrf)
and inverted (dpotri), and G is met with the kernel's derivative a block of rows at a
time, while both are in the processor's cache. C itself and half of each term of the
kernel are all the memory there is.

A matrix that is singular in spite of the noise has ``jitter`` added to its diagonal, as
little as will do.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dpotrf, dpotri, dpotrs

from handclean.arrays import Floats
from handclean.numerics.gp.kernels import Kernel, total
from handclean.numerics.gp.means import basis, weights

BLOCK_ROWS = 512
"""Rows of a matrix that are handled at a time (chosen: they stay in the cache)."""

JITTER_SHARES = (0.0, 1e-10, 1e-8, 1e-6, 1e-4)
"""Shares of the largest variance that are added to the diagonal, in turn (chosen)."""


class Evidence:
    """Negative log evidence of hyperparameters, the noise's variance the last of them.

    Parameters
    ----------
    kernel, mean : the model.
    inputs : (N, S); targets : (N,), both scaled.

    Attributes
    ----------
    jitter : the most that had to be added to the diagonal, as a share of the largest
        variance.
    evaluations : how many there were.
    """

    def __init__(
        self, kernel: Kernel, mean: str, inputs: Floats, targets: Floats
    ) -> None:
        self.kernel = kernel
        self.inputs, self.targets = inputs, targets
        self.columns = basis(mean, inputs)
        self.jitter = 0.0
        self.evaluations = 0
        self._matrix = np.zeros((len(inputs), len(inputs)))
        self._grams = [
            [
                np.zeros((rows.stop - rows.start, beyond.stop - beyond.start))
                for _ in kernel.terms
            ]
            for rows, beyond in self._blocks()
        ]

    def __call__(self, logs: Floats) -> tuple[float, Floats]:
        """Value and derivatives; infinite where there is no factorisation."""
        self.evaluations += 1
        kernel_logs, noise = logs[:-1], float(np.exp(logs[-1]))
        factor, grams = self._factorised(kernel_logs, noise)
        if factor is None:
            return np.inf, np.zeros(len(logs))
        value, _, solved = fitted_mean(factor, self.columns, self.targets)
        inverse, info = dpotri(factor, lower=1, overwrite_c=1)
        assert info == 0
        gradient = np.zeros(len(logs))
        diagonal = np.diagonal(inverse) - solved**2
        gradient[-1] = 0.5 * noise * diagonal.sum()
        for (rows, beyond), parts in zip(self._blocks(), grams, strict=True):
            up = inverse.T[rows, beyond] - np.outer(solved[rows], solved[beyond])
            _halve(up)
            pulled, _ = self.kernel.pull(
                kernel_logs, self.inputs[rows], self.inputs[beyond], parts, up
            )
            gradient[:-1] += pulled
        return value, gradient

    def factor(self, logs: Floats) -> Floats | None:
        """Lower factor L of C = L L^T, or None."""
        return self._factorised(logs[:-1], float(np.exp(logs[-1])))[0]

    def _blocks(self) -> list[tuple[slice, slice]]:
        count = len(self.inputs)
        starts = range(0, count, BLOCK_ROWS)
        return [(slice(i, min(i + BLOCK_ROWS, count)), slice(i, count)) for i in starts]

    def _factorised(
        self, logs: Floats, noise: float
    ) -> tuple[Floats | None, list[list[Floats]]]:
        """Factor, and the kernel's terms block by block."""
        blocks = self._blocks()
        grams = [
            self.kernel.grams(logs, self.inputs[rows], self.inputs[beyond], out)
            for (rows, beyond), out in zip(blocks, self._grams, strict=True)
        ]
        largest = noise + float(self.kernel.diagonal(logs, self.inputs).max())
        matrix = self._matrix
        for jitter in JITTER_SHARES:
            for (rows, beyond), parts in zip(blocks, grams, strict=True):
                matrix[rows, beyond] = total(parts)
            matrix.flat[:: len(matrix) + 1] += noise + jitter * largest
            self.jitter = max(self.jitter, jitter)
            factor, info = dpotrf(matrix.T, lower=1, overwrite_a=1, clean=0)
            if info == 0:
                return factor, grams
        return None, grams


def _halve(up: Floats) -> None:
    """Keep each pair of samples once: those before the diagonal go, it counts half."""
    size = len(up)
    up[:, :size] = np.triu(up[:, :size])
    up[np.arange(size), np.arange(size)] *= 0.5


def fitted_mean(
    factor: Floats, columns: Floats, targets: Floats
) -> tuple[float, Floats, Floats]:
    """Negative log evidence, weights of the mean, and C^-1 (y - H alpha)."""
    both, _ = dpotrs(factor, np.column_stack([columns, targets]), lower=1)
    alpha = weights(columns.T @ both[:, :-1], columns.T @ both[:, -1])
    solved: Floats = both[:, -1] - both[:, :-1] @ alpha
    left = targets - columns @ alpha
    value = 0.5 * left @ solved + np.log(np.diagonal(factor)).sum()
    return float(value) + 0.5 * len(targets) * np.log(2.0 * np.pi), alpha, solved


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """What prediction needs.

    Attributes
    ----------
    factor : (N, N) lower factor of C.
    alpha : weights of the mean; solved : (N,) C^-1 (y - H alpha).
    """

    kernel: Kernel
    mean: str
    logs: Floats
    inputs: Floats
    factor: Floats
    alpha: Floats
    solved: Floats

    def predict(self, inputs: Floats) -> tuple[Floats, Floats]:
        """Mean and variance without noise at inputs (n, S), scaled (equation 14)."""
        logs = self.logs[:-1]
        across = self.kernel.gram(logs, inputs, self.inputs)
        mean = basis(self.mean, inputs) @ self.alpha + across @ self.solved
        # across is row-major, so its transpose is what BLAS wants, without a copy.
        half = dtrsm(1.0, self.factor, across.T, lower=1, overwrite_b=1)
        variance = self.kernel.diagonal(logs, inputs)
        variance -= np.einsum("ij,ij->j", half, half)
        return mean, np.maximum(variance, 0.0)


def posterior(
    kernel: Kernel, mean: str, logs: Floats, inputs: Floats, targets: Floats
) -> Posterior:
    """Prepare to predict.

    Parameters
    ----------
    logs : hyperparameters, the noise's variance last.
    inputs : (N, S); targets : (N,), both scaled.
    """
    evidence = Evidence(kernel, mean, inputs, targets)
    factor = evidence.factor(logs)
    assert factor is not None, "hyperparameters that were evaluated before"
    _, alpha, solved = fitted_mean(factor, evidence.columns, targets)
    return Posterior(
        kernel=kernel,
        mean=mean,
        logs=logs,
        inputs=inputs,
        factor=factor,
        alpha=alpha,
        solved=solved,
    )
