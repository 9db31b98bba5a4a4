"""How noisy markers are, from what a solved posture leaves of them."""

import numpy as np

from handclean.arrays import Floats
from handclean.hand.model import Model, marker_positions
from handclean.ik.solve import Solution

MIN_NOISE_M = 2e-5
"""[m] noise of a marker per axis is not taken to be less. Chosen: about what a good
optical system has."""

UNDETERMINED_NOISE_M = 3e-4
"""[m] the least where postures have more unknowns than markers have numbers, so that
residuals say nothing. Chosen."""

MAX_ABSORPTION = 2.5
"""Noise is not taken to be more than so many times the residuals. Chosen."""


def marker_noise(
    model: Model, positions: Floats, solution: Solution, known: Floats
) -> Floats:
    """(M,) [m] standard deviation of each marker per axis.

    From the residuals of the solved posture, which are smaller than the noise, since
    every frame's root and angles were fitted to it.

    Parameters
    ----------
    known : (M,) [m] RMS residuals from a calibration, NaN where there are none; the
        larger of the two counts.
    """
    decided = solution.decided | ~solution.decided.any()
    away = positions - marker_positions(model, solution.poses)
    away[~decided] = np.nan
    square = np.sum(away * away, axis=2)
    count = np.isfinite(square).sum(axis=0)
    rms = np.sqrt(np.nansum(square, axis=0) / np.maximum(count, 1))
    rms[count == 0] = np.median(rms[count > 0]) if np.any(count > 0) else 0.0
    numbers = 3 * int(count.sum())
    left = numbers - int(decided.sum()) * model.tree.dofs
    least = MIN_NOISE_M if left > 0 else UNDETERMINED_NOISE_M
    absorbed = np.sqrt(max(numbers, 1) / max(left, numbers / MAX_ABSORPTION**2, 1))
    noise = absorbed * np.fmax(rms, known) / np.sqrt(3.0)
    return np.asarray(np.maximum(noise, least))
