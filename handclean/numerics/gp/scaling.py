"""Inputs and targets of mean 0 and deviation 1, and back.

A constant channel is only shifted: after scaling it is zero everywhere.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats


@dataclass(frozen=True, kw_only=True)
class Scaling:
    """Shift and size of inputs and targets.

    Attributes
    ----------
    center, spread : (S,) of the inputs, in their unit.
    target_center, target_spread : of the targets, in their unit.
    """

    center: Floats
    spread: Floats
    target_center: float
    target_spread: float

    def inputs(self, inputs: Floats) -> Floats:
        """(N, S) inputs, scaled."""
        scaled: Floats = (inputs - self.center) / self.spread
        return scaled

    def targets(self, targets: Floats) -> Floats:
        """(N,) targets, scaled."""
        scaled: Floats = (targets - self.target_center) / self.target_spread
        return scaled


def _spread(values: Floats) -> Floats:
    """Deviation of each column, 1 where it is nothing but rounding."""
    size = np.abs(values).max(axis=0)
    deviation: Floats = values.std(axis=0)
    return np.where(deviation > 1e-12 * size, deviation, 1.0)


def scaling_of(inputs: Floats, targets: Floats) -> Scaling:
    """Find the shift and the size of samples, by which they are scaled.

    Parameters
    ----------
    inputs : (N, S); targets : (N,).
    """
    return Scaling(
        center=inputs.mean(axis=0),
        spread=_spread(inputs),
        target_center=float(targets.mean()),
        target_spread=float(_spread(targets[:, None])[0]),
    )
