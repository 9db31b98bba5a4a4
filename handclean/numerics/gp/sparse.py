"""The sparse Gaussian process with pseudo-inputs (SPGP, Snelson & Ghahramani 2006).

M pseudo-inputs Z stand for N samples X. With K_MM = L L^T, V = L^-1 K_MN and

    Q = V^T V,   D = diag(K_NN - Q) + sigma^2 I,   C = Q + D

the evidence is that of y ~ N(H alpha, C) (Wang & Neff 2013, equation 17). C is never
formed: with A = I + V D^-1 V^T = L_A L_A^T and U = L_A^-1 V,

    |C| = |D| |A|,    C^-1 = D^-1 - D^-1 U^T U D^-1

Pseudo-inputs and hyperparameters are found together, so f is needed with derivatives by
both. With a = C^-1 (y - H alpha), G = C^-1 - a a^T and p its diagonal,

    df = 1/2 sum_n p_n d(k_nn + sigma^2) + <G_MN, dK_MN> + <G_MM, dK_MM>
    G_MN = L^-T (L_A^-T U D^-1 - (V a) a^T - V diag(p)),   G_MM = -1/2 G_MN B^T

where B = L^-T V. All sums over samples are taken a few at a time: time is O(M^2 N),
memory V and the kernel's terms, M x N each, beside a few of M x M.

Prediction (18, 19, with the mean that the paper's 19 lacks) at s, k = K(Z, s):

    m(s) + k^T w,   k(s, s) - |R k|^2,   w = L^-T L_A^-T (U D^-1 (y - H alpha))

where R^T R = K_MM^-1 - (K_MM + K_MN D^-1 K_NM)^-1 = L^-T (I - A^-1) L^-1 is triangular.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dger, dsyrk, dtrmm, dtrsm
from scipy.linalg.lapack import dpotrf, dtrtri

from handclean.arrays import Floats
from handclean.numerics.gp.kernels import Kernel, total
from handclean.numerics.gp.means import basis, weights

BLOCK_ENTRIES = 32768
"""Entries of a matrix of pseudo-inputs by samples that are handled at a time: so many
stay in the processor's cache, and in memory that need not be asked for anew
(chosen)."""

JITTER_VARIANCES = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
"""Added to the diagonal of K_MM (targets have deviation 1), in turn (chosen)."""


@dataclass(frozen=True, kw_only=True)
class _Solved:
    """The factors of one evaluation, in the letters above.

    Attributes
    ----------
    value : f.
    lower, lower_a : (M, M) L and L_A.
    diagonal : (N,) of D.
    alpha : weights of the mean; left : (N,) y - H alpha.
    summary : (M,) U D^-1 (y - H alpha).
    """

    value: float
    lower: Floats
    lower_a: Floats
    diagonal: Floats
    alpha: Floats
    summary: Floats
    left: Floats


class SparseEvidence:
    """Negative log evidence of hyperparameters and pseudo-inputs, in one vector.

    The vector has the kernel's logarithms, that of the noise's variance, then the
    pseudo-inputs row by row.

    Parameters
    ----------
    kernel, mean : the model.
    inputs : (N, S); targets : (N,), both scaled.
    count : M.

    Attributes
    ----------
    jitter : added to the diagonal of K_MM; never lowered, so that the function that is
        minimised does not change to and fro.
    """

    def __init__(
        self, kernel: Kernel, mean: str, inputs: Floats, targets: Floats, count: int
    ) -> None:
        self.kernel, self.mean = kernel, mean
        self.inputs, self.targets = inputs, targets
        self.columns = basis(mean, inputs)
        self.count = count
        self.jitter = JITTER_VARIANCES[0]
        self._v = np.zeros((len(inputs), count))
        self._grams = [np.zeros((len(inputs), count)) for _ in kernel.terms]

    def split(self, vector: Floats) -> tuple[Floats, float, Floats]:
        """Kernel's logarithms, noise's variance, pseudo-inputs (M, S)."""
        size = self.kernel.size
        pseudo = vector[size + 1 :].reshape(self.count, -1)
        return vector[:size], float(np.exp(vector[size])), pseudo

    def __call__(self, vector: Floats) -> tuple[float, Floats]:
        """Value and derivatives; infinite where there is no factorisation."""
        logs, noise, pseudo = self.split(vector)
        solved = self.solve(vector)
        if solved is None:
            return np.inf, np.zeros(len(vector))
        by_logs, by_pseudo, by_noise = self._gradient(logs, pseudo, solved)
        return solved.value, np.concatenate(
            [by_logs, [noise * by_noise], by_pseudo.ravel()]
        )

    def _chunks(self) -> list[slice]:
        count = len(self.inputs)
        rows = int(np.clip(BLOCK_ENTRIES // self.count, 128, 1024))
        return [slice(i, min(i + rows, count)) for i in range(0, count, rows)]

    def factor(self, logs: Floats, pseudo: Floats) -> Floats | None:
        """Lower factor of K_MM, or None."""
        gram = self.kernel.gram(logs, pseudo, pseudo)
        for jitter in JITTER_VARIANCES:
            if jitter < self.jitter:
                continue
            self.jitter = jitter
            matrix = np.array(gram, order="F")
            matrix.flat[:: self.count + 1] += jitter
            lower: Floats
            lower, info = dpotrf(matrix, lower=1, overwrite_a=1, clean=1)
            if info == 0:
                return lower
        return None

    def solve(self, vector: Floats) -> _Solved | None:
        """Value and factors."""
        logs, noise, pseudo = self.split(vector)
        lower = self.factor(logs, pseudo)
        if lower is None:
            return None
        variances = self.kernel.diagonal(logs, self.inputs) + noise
        diagonal = np.zeros(len(variances))
        a = np.eye(self.count, order="F")
        both = np.column_stack([self.columns, self.targets])
        sums = np.zeros((self.count, both.shape[1]))
        inverse, _ = dtrtri(lower, lower=1)
        for rows in self._chunks():
            out = [matrix[rows] for matrix in self._grams]
            parts = self.kernel.grams(logs, self.inputs[rows], pseudo, out)
            across = np.array(total(parts)).T
            v = dtrmm(1.0, inverse, across, lower=1, overwrite_b=1)
            self._v[rows] = v.T
            squares = np.einsum("ij,ij->j", v, v)
            diagonal[rows] = np.maximum(variances[rows] - squares, noise)
            weighted = v * (1.0 / np.sqrt(diagonal[rows]))
            a = dsyrk(1.0, weighted, beta=1.0, c=a, lower=1, overwrite_c=1)
            sums += v @ (both[rows] / diagonal[rows, None])
        lower_a, info = dpotrf(a, lower=1, overwrite_a=1, clean=1)
        assert info == 0, "unit matrix plus squares"
        return self._with_mean(lower, lower_a, diagonal, both, sums)

    def _with_mean(
        self,
        lower: Floats,
        lower_a: Floats,
        diagonal: Floats,
        both: Floats,
        sums: Floats,
    ) -> _Solved:
        """Solve for the mean's weights and put f together."""
        summary = dtrsm(1.0, lower_a, np.asfortranarray(sums), lower=1)
        # [H y]^T C^-1 [H y], all that generalised least squares asks for
        crossed = both.T @ (both / diagonal[:, None]) - summary.T @ summary
        alpha = weights(crossed[:-1, :-1], crossed[:-1, -1])
        away = np.append(-alpha, 1.0)
        fit = summary @ away
        left = both @ away
        square = float((left * left / diagonal).sum() - fit @ fit)
        logarithms = float(
            np.log(diagonal).sum() + 2.0 * np.log(np.diagonal(lower_a)).sum()
        )
        value = 0.5 * (square + logarithms + len(both) * np.log(2.0 * np.pi))
        return _Solved(
            value=value,
            lower=lower,
            lower_a=lower_a,
            diagonal=diagonal,
            alpha=alpha,
            summary=fit,
            left=left,
        )

    def _gradient(
        self, logs: Floats, pseudo: Floats, solved: _Solved
    ) -> tuple[Floats, Floats, float]:
        """Derivatives by logarithms, pseudo-inputs, and the noise's variance."""
        inverse, _ = dtrtri(solved.lower, lower=1)
        inverse_a, _ = dtrtri(solved.lower_a, lower=1)
        back = solved.summary @ inverse_a
        by_logs, by_pseudo = np.zeros(len(logs)), np.zeros(pseudo.shape)
        up_mm, by_noise = np.zeros((self.count, self.count)), 0.0
        for rows in self._chunks():
            parts = [matrix[rows] for matrix in self._grams]
            v, d = self._v[rows].T, solved.diagonal[rows]
            u = dtrmm(1.0, inverse_a, v, lower=1)
            a = (solved.left[rows] - back @ v) / d
            p = (1.0 - np.einsum("ij,ij->j", u, u) / d) / d - a * a
            inner = dtrmm(1.0, inverse_a, u, lower=1, trans_a=1, overwrite_b=1)
            inner *= 1.0 / d
            inner = dger(-1.0, back, a, a=inner, overwrite_a=1)
            inner -= v * p
            up = dtrmm(1.0, inverse, inner, lower=1, trans_a=1, overwrite_b=1)
            up_mm -= 0.5 * (up @ v.T)
            inputs = self.inputs[rows]
            more, moved = self.kernel.pull(logs, inputs, pseudo, parts, up.T)
            by_logs += more + 0.5 * self.kernel.pull_diagonal(logs, inputs, p)
            by_pseudo += moved
            by_noise += 0.5 * float(p.sum())
        up_mm = up_mm @ inverse
        up_mm = 0.5 * (up_mm + up_mm.T)
        parts = self.kernel.grams(logs, pseudo, pseudo)
        more, moved = self.kernel.pull(logs, pseudo, pseudo, parts, up_mm)
        return by_logs + more, by_pseudo + 2.0 * moved, by_noise


@dataclass(frozen=True, kw_only=True)
class SparsePosterior:
    """What prediction needs.

    Attributes
    ----------
    alpha : weights of the mean; weight : (M,) w; root : (M, M) R, upper triangular.
    """

    kernel: Kernel
    mean: str
    logs: Floats
    pseudo: Floats
    alpha: Floats
    weight: Floats
    root: Floats

    def predict(self, inputs: Floats) -> tuple[Floats, Floats]:
        """Mean and variance without noise at inputs (n, S), scaled."""
        logs = self.logs[:-1]
        across = self.kernel.gram(logs, inputs, self.pseudo)
        mean = basis(self.mean, inputs) @ self.alpha + across @ self.weight
        half = dtrmm(1.0, self.root, across.T, overwrite_b=1)
        variance = self.kernel.diagonal(logs, inputs)
        variance -= np.einsum("ij,ij->j", half, half)
        return mean, np.maximum(variance, 0.0)


def sparse_posterior(
    evidence: SparseEvidence, logs: Floats, pseudo: Floats
) -> SparsePosterior:
    """Prepare to predict with hyperparameters and pseudo-inputs.

    Parameters
    ----------
    evidence : of the samples, which has evaluated these hyperparameters before.
    logs : logarithms of the hyperparameters; pseudo : (M, S) pseudo-inputs.

    References
    ----------
    Wang & Neff (2013), equations 18 and 19.
    """
    solved = evidence.solve(np.concatenate([logs, pseudo.ravel()]))
    assert solved is not None, "a vector that was evaluated before"
    summary = solved.summary[:, None]
    weight = dtrsm(1.0, solved.lower_a, summary, lower=1, trans_a=1)
    weight = dtrsm(1.0, solved.lower, weight, lower=1, trans_a=1)[:, 0]
    return SparsePosterior(
        kernel=evidence.kernel,
        mean=evidence.mean,
        logs=logs,
        pseudo=pseudo,
        alpha=solved.alpha,
        weight=weight,
        root=_root(solved.lower, solved.lower_a),
    )


def _root(lower: Floats, lower_a: Floats) -> Floats:
    """R, from A = W diag(a) W^T: R^T R = L^-T W diag(1 - 1 / a) W^T L^-1."""
    values, vectors = np.linalg.eigh(lower_a @ lower_a.T)
    share = np.sqrt(np.maximum(1.0 - 1.0 / np.maximum(values, 1.0), 0.0))
    half = dtrsm(1.0, lower, np.asfortranarray(vectors * share), lower=1, trans_a=1)
    triangle: Floats = np.asfortranarray(np.linalg.qr(half.T, mode="r"))
    return triangle
