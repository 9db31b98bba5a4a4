"""From readings to one rotation: the models of a calibration, behind one interface.

``fit`` takes a kind by name, `KINDS`:

=================== ==========================================================
lmc-gpr             linear mean, linear plus squared exponential covariance, each
                    input with its own length (Wang & Neff 2013, section 6.1)
spgp                the same with pseudo-inputs (section 6.2)
MEAN-TERM+TERM...   any of the pairs of table 2, and with polynomials (section 8.1);
                    ``ml-lard+seard`` is lmc-gpr
linear              regression on all inputs
two-pose            a line of the first input through two poses
=================== ==========================================================

Means and terms are those of `handclean.numerics.gp`: ``m0 ml``, ``lard rbf seard poly2
poly3``. Inputs and targets are scaled inside, so that their units do not matter; what a
`Fitted` tells is in the targets' unit.

Everything a fitted model is stands in plain arrays (`Fitted.to_arrays`). What
prediction needs beyond them (the exact model's factor, N x N) is made when it is first
asked for, and does not travel when a model is pickled.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from handclean.arrays import Floats, expect_shape
from handclean.errors import HandcleanError, UnknownNameError
from handclean.numerics.gp.exact import posterior
from handclean.numerics.gp.kernels import Kernel
from handclean.numerics.gp.scaling import Scaling, scaling_of
from handclean.numerics.gp.settings import FitSettings
from handclean.numerics.gp.sparse import (
    SparseEvidence,
    SparsePosterior,
    sparse_posterior,
)
from handclean.numerics.gp.train import train_exact, train_sparse

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

KINDS = (*EXACT, "spgp", "linear", "two-pose")

BATCH = 512
"""Readings predicted at a time: memory does not grow with a stream's length."""

TINY = 1e-18
"""Least variance of scaled residuals."""

POSE_SHARE = 0.02
"""Samples this near to the ends of the targets' range are the two poses."""


@dataclass(frozen=True, kw_only=True)
class Figures:
    """How a fit went.

    Attributes
    ----------
    samples : N; duplicates : those whose inputs another sample has too.
    constant : (S,) whether an input never changed.
    evaluations : of the evidence, with all samples; subset_evaluations : with fewer.
    converged : False if it was stopped before.
    jitter : added to a covariance that was singular, as a share of the targets'
        variance; 0 as a rule.
    seconds : of training; not kept in `Fitted.to_arrays` (nan).
    """

    samples: int
    duplicates: int
    constant: tuple[bool, ...]
    evaluations: int
    subset_evaluations: int
    converged: bool
    jitter: float
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """A model of one rotation.

    Attributes
    ----------
    kind : one of `KINDS`.
    scaling : of inputs and targets.
    nlml : negative log marginal likelihood of the targets in their own unit, with the
        weights of the mean at their best.
    noise : standard deviation of the noise, in the targets' unit.
    figures : of the training.
    arrays : parameters of the scaled model, by name.
    """

    kind: str
    scaling: Scaling
    nlml: float
    noise: float
    figures: Figures
    arrays: Mapping[str, Floats]

    def predict(self, inputs: Floats, *, noise: bool = False) -> Prediction:
        """Predict mean and variance at readings.

        Parameters
        ----------
        inputs : (n, S), of any length; where one is nan the prediction is.
        noise : whether the variance is that of a measurement, with its noise, rather
            than of the rotation.

        Returns
        -------
        mean : (n,) in the targets' unit; variance : (n,), its square.

        Raises
        ------
        ShapeError
            If there are more or fewer inputs than the model was fitted to.
        """
        expect_shape("inputs", inputs, "n", len(self.scaling.center))
        mean, variance = np.zeros(len(inputs)), np.zeros(len(inputs))
        for begin in range(0, len(inputs), BATCH):
            rows = slice(begin, begin + BATCH)
            scaled = self.scaling.inputs(inputs[rows])
            mean[rows], variance[rows] = self._predictor(scaled)
        size = self.scaling.target_spread
        more = self.noise**2 if noise else 0.0
        return mean * size + self.scaling.target_center, variance * size**2 + more

    @cached_property
    def _predictor(self) -> Predictor:
        if self.kind == "spgp":
            return _sparse_predictor(self.arrays)
        if self.kind in EXACT:
            return _exact_predictor(self.kind, self.arrays)
        return _line_predictor(self.arrays)

    def __getstate__(self) -> dict[str, Any]:
        state = dict(self.__dict__)
        state.pop("_predictor", None)
        return state

    @property
    def hyperparameters(self) -> dict[str, float]:
        """Hyperparameters of the scaled covariance by name, the noise's variance last.

        Empty for the linear models.
        """
        if "logs" not in self.arrays:
            return {}
        names = _kernel(self.kind, len(self.scaling.center)).names
        values = np.exp(self.arrays["logs"])
        return dict(zip([*names, "noise"], values.tolist(), strict=True))

    def to_arrays(self) -> dict[str, Floats]:
        """All of it but the kind and the seconds, as arrays of numbers."""
        figures = self.figures
        counts = [
            figures.samples,
            figures.duplicates,
            figures.evaluations,
            figures.subset_evaluations,
            figures.converged,
            figures.jitter,
        ]
        scaling = self.scaling
        return {
            **self.arrays,
            "input_center": scaling.center,
            "input_spread": scaling.spread,
            "target_scale": np.array([scaling.target_center, scaling.target_spread]),
            "score": np.array([self.nlml, self.noise]),
            "figures": np.array(counts, dtype=float),
            "constant": np.array(figures.constant, dtype=float),
        }


def from_arrays(kind: str, arrays: Mapping[str, Floats]) -> Fitted:
    """Make the model again that `Fitted.to_arrays` took apart.

    Raises
    ------
    HandcleanError
        If the kind is unknown or an array is missing.
    """
    _expect_kind(kind)
    left = dict(arrays)
    names = ("target_scale", "score", "figures", "constant")
    for name in ("input_center", "input_spread", *names):
        if name not in left:
            raise HandcleanError(f"model '{kind}': it has no '{name}'")
    target, score, counts, constant = (left.pop(name) for name in names)
    return Fitted(
        kind=kind,
        scaling=Scaling(
            center=left.pop("input_center"),
            spread=left.pop("input_spread"),
            target_center=float(target[0]),
            target_spread=float(target[1]),
        ),
        nlml=float(score[0]),
        noise=float(score[1]),
        figures=Figures(
            samples=int(counts[0]),
            duplicates=int(counts[1]),
            evaluations=int(counts[2]),
            subset_evaluations=int(counts[3]),
            converged=bool(counts[4]),
            jitter=float(counts[5]),
            constant=tuple(bool(value) for value in constant),
            seconds=float("nan"),
        ),
        arrays=left,
    )


def fit(
    kind: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> Fitted:
    """Fit a model of one rotation to samples.

    Parameters
    ----------
    kind : one of `KINDS`.
    inputs : (N, S) readings, the measuring sensor's first, then the affecting ones'.
    targets : (N,) rotations, in any unit.
    rng : draws subsets and starting points; nothing else is random.

    Raises
    ------
    HandcleanError
        If the kind is unknown, samples are not finite or too few, all targets are the
        same, or there are too many samples for a full model.
    """
    _expect_kind(kind)
    expect_shape("inputs", inputs, "N", "S")
    expect_shape("targets", targets, len(inputs))
    _expect_samples(kind, inputs, targets, settings)
    scaling = scaling_of(inputs, targets)
    begin = time.perf_counter()
    made = _FITS.get(kind, _fit_exact)(
        kind, scaling.inputs(inputs), scaling.targets(targets), settings, rng
    )
    seconds = time.perf_counter() - begin
    return Fitted(
        kind=kind,
        scaling=scaling,
        nlml=made.nlml + len(targets) * float(np.log(scaling.target_spread)),
        noise=made.noise * scaling.target_spread,
        figures=Figures(
            samples=len(inputs),
            duplicates=len(inputs) - len(np.unique(inputs, axis=0)),
            constant=tuple(bool(flat) for flat in np.ptp(inputs, axis=0) == 0.0),
            evaluations=made.evaluations,
            subset_evaluations=made.subset_evaluations,
            converged=made.converged,
            jitter=made.jitter,
            seconds=seconds,
        ),
        arrays=made.arrays,
    )


def _expect_kind(kind: str) -> None:
    if kind not in KINDS:
        raise UnknownNameError("model", "kind of model", kind, KINDS)


def _expect_samples(
    kind: str, inputs: Floats, targets: Floats, settings: FitSettings
) -> None:
    good = np.isfinite(inputs).all(axis=1) & np.isfinite(targets)
    if not good.all():
        raise HandcleanError(
            f"samples: {len(good) - good.sum()} of {len(good)} are not finite; "
            "they should be left out"
        )
    least = 2 if kind == "two-pose" else inputs.shape[1] + 3
    if len(inputs) < least:
        raise HandcleanError(
            f"samples: there are {len(inputs)}; model '{kind}' with {inputs.shape[1]} "
            f"sensors needs at least {least}"
        )
    if not np.ptp(targets) > 0.0:
        raise HandcleanError(
            f"samples: the rotation is {targets[0]:.6g} in all; it should vary"
        )
    if kind in EXACT and len(inputs) > settings.max_samples:
        raise HandcleanError(
            f"samples: {len(inputs)} are too many for model '{kind}' (max_samples "
            f"{settings.max_samples}); spgp takes them, or fewer should be given"
        )


@dataclass(frozen=True, kw_only=True)
class _Made:
    """A scaled model."""

    arrays: dict[str, Floats]
    nlml: float
    noise: float
    evaluations: int = 1
    subset_evaluations: int = 0
    converged: bool = True
    jitter: float = 0.0


def _kernel(kind: str, inputs: int) -> Kernel:
    return Kernel(EXACT.get(kind, LMC)[1], inputs)


def _fit_exact(
    kind: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> _Made:
    kernel = _kernel(kind, inputs.shape[1])
    trained = train_exact(kernel, EXACT[kind][0], inputs, targets, settings, rng)
    return _Made(
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
        _kernel(kind, inputs.shape[1]),
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
) -> _Made:
    mean, kernel = LMC[0], _kernel(kind, inputs.shape[1])
    trained = train_sparse(kernel, mean, inputs, targets, settings, rng)
    evidence = SparseEvidence(kernel, mean, inputs, targets, len(trained.pseudo))
    ready = sparse_posterior(evidence, trained.logs, trained.pseudo)
    return _Made(
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
    kernel = _kernel("spgp", arrays["pseudo"].shape[1])
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
) -> _Made:
    """Least squares; the variance is that of the weights (m(s) = h^T w, h = [s, 1])."""
    columns = np.column_stack([inputs, np.ones(len(inputs))])
    inverse = np.linalg.pinv(columns.T @ columns, rcond=1e-12, hermitian=True)
    line = inverse @ (columns.T @ targets)
    left = targets - columns @ line
    freedom = len(targets) - columns.shape[1]
    variance = max(float(left @ left) / freedom, TINY)
    arrays = {"line": line, "covariance": variance * inverse}
    return _Made(arrays=arrays, nlml=_nlml(left), noise=float(np.sqrt(variance)))


def _fit_two_pose(
    kind: str,
    inputs: Floats,
    targets: Floats,
    settings: FitSettings,
    rng: np.random.Generator,
) -> _Made:
    """A line through two poses: what gloves' own calibration does.

    The poses are the samples at the two ends of the targets' range, within
    ``POSE_SHARE`` of it; only the first input counts. How far the line is from the
    truth between them nobody knows: the variance, that of all samples about the line,
    stands for both.
    """
    low, high = targets.min(), targets.max()
    near = POSE_SHARE * (high - low)
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
    covariance[-1, -1] = max(float(left @ left) / len(left), TINY)
    arrays = {"line": line, "covariance": covariance}
    return _Made(
        arrays=arrays, nlml=_nlml(left), noise=float(np.sqrt(covariance[-1, -1]))
    )


def _nlml(left: Floats) -> float:
    """Negative log likelihood of residuals with the variance that makes it least."""
    variance = max(float(left @ left) / len(left), TINY)
    return 0.5 * len(left) * (float(np.log(2.0 * np.pi * variance)) + 1.0)


def _line_predictor(arrays: Mapping[str, Floats]) -> Predictor:
    line, covariance = arrays["line"], arrays["covariance"]

    def predict(inputs: Floats) -> Prediction:
        columns = np.column_stack([inputs, np.ones(len(inputs))])
        return columns @ line, np.einsum("ni,ij,nj->n", columns, covariance, columns)

    return predict


_FITS = {"spgp": _fit_sparse, "linear": _fit_linear, "two-pose": _fit_two_pose}
