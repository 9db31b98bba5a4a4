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
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from handclean.arrays import Floats, expect_shape
from handclean.errors import HandcleanError, UnknownNameError
from handclean.glove.scaled import (
    EXACT,
    FITS,
    Prediction,
    Predictor,
    fit_exact,
    kernel_of,
    predictor,
)
from handclean.numerics.gp.scaling import Scaling, scaling_of
from handclean.numerics.gp.settings import FitSettings

KINDS = (*EXACT, "spgp", "linear", "two-pose")

BATCH_READINGS = 512
"""Readings predicted at a time; memory does not grow with a stream (chosen)."""


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
        for begin in range(0, len(inputs), BATCH_READINGS):
            rows = slice(begin, begin + BATCH_READINGS)
            scaled = self.scaling.inputs(inputs[rows])
            mean[rows], variance[rows] = self._predictor(scaled)
        size = self.scaling.target_spread
        more = self.noise**2 if noise else 0.0
        return mean * size + self.scaling.target_center, variance * size**2 + more

    @cached_property
    def _predictor(self) -> Predictor:
        return predictor(self.kind, self.arrays)

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
        names = kernel_of(self.kind, len(self.scaling.center)).names
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

    Parameters
    ----------
    kind : of the model; arrays : by their names.

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
    scaled = replace(settings, least_noise=settings.least_noise / scaling.target_spread)
    made = FITS.get(kind, fit_exact)(
        kind, scaling.inputs(inputs), scaling.targets(targets), scaled, rng
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
