"""The models behind `handclean.glove.models`, on scaled inputs and targets.

Each kind has a function from samples to plain arrays (`Made`), and one from these to a
predictor of mean and variance.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.errors import HandcleanError
from handclean.numerics.gp.exact import posterior
from handclean.numerics.gp.kernels import Kernel
from handclean.numerics.gp.settings import FitSettings
from handclean.numerics.gp.sparse import (
    SparseEvidence,
    SparsePosterior,
    sparse_posterior,
)
from handclean.numerics.gp.train import train_exact
from handclean.numerics.gp.train_sparse import train_sparse

Prediction = tuple[Floats, Floats]
Predictor = Callable[[Floats], Prediction]

LMC = ("ml", ("lard", "seard"))
TABLE_2 = {
    f"{mean}-{'+'.join(terms)}": (mean, terms)
    for mean in ("m0", "ml")
    for terms in (("rbf",), ("lard",), ("seard", "seard"), ("lard", "seard"))
}
SINGLE = {f"{mean}-seard": (mean, ("seard",)) for mean in ("m0", "ml")}
POLYNOMIAL = {
    f"{mean}-{'+'.join(terms)}": (mean, terms)
    for mean in ("m0", "ml")
    for terms in (("poly2",), ("poly3",), ("poly2", "seard"), ("poly3", "seard"))
}
EXACT: dict[str, tuple[str, tuple[str, ...]]] = {
    "lmc-gpr": LMC,
    **TABLE_2,
    **SINGLE,
    **POLYNOMIAL,
}
"""Mean and covariance terms of each full model."""

LEAST_VARIANCE = 1e-18
"""[-] least variance of scaled residuals (chosen)."""

POSE_RANGE_SHARE = 0.02
"""[-] share of the targets' range at whose ends samples are the two poses (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Made:
    """A scaled model: its arrays, score and figures (`handclean.glove.models`)."""

    arrays: dict[str, Floats]
    nlml: float
    noise: float
    evaluations: int = 1
    subset_evaluations: int = 0
    converged: bool = True
    jitter: float = 0.0


def kernel_of(kind: str, inputs: int) -> Kernel:
    """Covariance function of a kind, with so many inputs."""
    return Kernel(EXACT.get(kind, LMC)[1], inputs)


def fit_exact(
    kind: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> Made:
    """Train a full model on inputs (N, S) and targets (N,)."""
    kernel = kernel_of(kind, inputs.shape[1])
    trained = train_exact(kernel, EXACT[kind][0], inputs, targets, settings, rng)
    return Made(
        arrays={"logs": trained.logs, "inputs": inputs, "targets": targets},
        nlml=trained.value,
        noise=float(np.exp(0.5 * trained.logs[-1])),
        evaluations=trained.evaluations,
        subset_evaluations=trained.subset_evaluations,
        converged=trained.converged,
        jitter=trained.jitter,
    )


def _exact_predictor(kind: str, arrays: Mapping[str, Floats]) -> Predictor:
    inputs = arrays["inputs"]
    return posterior(
        kernel_of(kind, inputs.shape[1]),
        EXACT[kind][0],
        arrays["logs"],
        inputs,
        arrays["targets"],
    ).predict


def _fit_sparse(
    kind: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> Made:
    mean, kernel = LMC[0], kernel_of(kind, inputs.shape[1])
    trained = train_sparse(kernel, mean, inputs, targets, settings, rng)
    evidence = SparseEvidence(kernel, mean, inputs, targets, len(trained.pseudo))
    ready = sparse_posterior(evidence, trained.logs, trained.pseudo)
    return Made(
        arrays={
            "logs": ready.logs,
            "pseudo": ready.pseudo,
            "alpha": ready.alpha,
            "weight": ready.weight,
            "root": ready.root,
        },
        nlml=trained.value,
        noise=float(np.exp(0.5 * trained.logs[-1])),
        evaluations=trained.evaluations,
        subset_evaluations=trained.subset_evaluations,
        converged=trained.converged,
        jitter=trained.jitter,
    )


def _sparse_predictor(arrays: Mapping[str, Floats]) -> Predictor:
    kernel = kernel_of("spgp", arrays["pseudo"].shape[1])
    return SparsePosterior(
        kernel=kernel,
        mean=LMC[0],
        logs=arrays["logs"],
        pseudo=arrays["pseudo"],
        alpha=arrays["alpha"],
        weight=arrays["weight"],
        root=np.asfortranarray(arrays["root"]),
    ).predict


def _fit_linear(
    kind: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> Made:
    """Least squares; the variance is that of the weights (m(s) = h^T w, h = [s, 1])."""
    columns = np.column_stack([inputs, np.ones(len(inputs))])
    inverse = np.linalg.pinv(columns.T @ columns, rcond=1e-12, hermitian=True)
    line = inverse @ (columns.T @ targets)
    left = targets - columns @ line
    freedom = len(targets) - columns.shape[1]
    variance = max(float(left @ left) / freedom, LEAST_VARIANCE)
    arrays = {"line": line, "covariance": variance * inverse}
    return Made(arrays=arrays, nlml=_nlml(left), noise=float(np.sqrt(variance)))


def _fit_two_pose(
    kind: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> Made:
    """A line through two poses: what gloves' own calibration does.

    The poses are the samples at the two ends of the targets' range, within
    `POSE_RANGE_SHARE` of it; only the first input counts. How far the line is from the
    truth between them is not known: the variance, that of all samples about the line,
    stands for both.
    """
    low, high = targets.min(), targets.max()
    near = POSE_RANGE_SHARE * (high - low)
    ends = [targets <= low + near, targets >= high - near]
    (s0, t0), (s1, t1) = [(inputs[at, 0].mean(), targets[at].mean()) for at in ends]
    if not abs(s1 - s0) > 1e-9:
        raise HandcleanError(
            "samples: the sensor reads the same in the two poses; they should differ"
        )
    line = np.zeros(inputs.shape[1] + 1)
    line[0] = (t1 - t0) / (s1 - s0)
    line[-1] = t0 - line[0] * s0
    left = targets - inputs @ line[:-1] - line[-1]
    covariance = np.zeros((len(line), len(line)))
    covariance[-1, -1] = max(float(left @ left) / len(left), LEAST_VARIANCE)
    arrays = {"line": line, "covariance": covariance}
    return Made(
        arrays=arrays, nlml=_nlml(left), noise=float(np.sqrt(covariance[-1, -1]))
    )


def _nlml(left: Floats) -> float:
    """Negative log likelihood of residuals with the variance that makes it least."""
    variance = max(float(left @ left) / len(left), LEAST_VARIANCE)
    return 0.5 * len(left) * (float(np.log(2.0 * np.pi * variance)) + 1.0)


def _line_predictor(arrays: Mapping[str, Floats]) -> Predictor:
    line, covariance = arrays["line"], arrays["covariance"]

    def predict(inputs: Floats) -> Prediction:
        columns = np.column_stack([inputs, np.ones(len(inputs))])
        return columns @ line, np.einsum("ni,ij,nj->n", columns, covariance, columns)

    return predict


FITS = {"spgp": _fit_sparse, "linear": _fit_linear, "two-pose": _fit_two_pose}


def predictor(kind: str, arrays: Mapping[str, Floats]) -> Predictor:
    """What predicts mean and variance at scaled inputs (n, S)."""
    if kind == "spgp":
        return _sparse_predictor(arrays)
    if kind in EXACT:
        return _exact_predictor(kind, arrays)
    return _line_predictor(arrays)
