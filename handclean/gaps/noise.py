"""Noise of one marker, measured from its own path."""

import numpy as np

from handclean.arrays import Floats

MIN_DIFFERENCES = 20
"""Third differences that tell a marker's noise; of fewer it is not known (chosen)."""

_NORMAL_MEDIAN = 0.6745
"""[-] median of the magnitude of a standard normal number."""


def noise_of(path: Floats) -> float:
    """[m] standard deviation of one marker's noise, per axis, by third differences.

    NaN where fewer than `MIN_DIFFERENCES` are known.

    Parameters
    ----------
    path : (T, 3) [m], NaN where it is not measured.
    """
    third = np.diff(path, n=3, axis=0)
    known = np.abs(third[np.isfinite(third).all(axis=1)])
    if len(known) < MIN_DIFFERENCES:
        return float("nan")
    return float(np.median(known) / _NORMAL_MEDIAN / np.sqrt(20.0))
