"""The mean function: zero, or linear with an intercept, in closed form.

For a covariance C the weights that maximise the evidence are those of generalised
least squares, alpha = (H^T C^-1 H)^-1 H^T C^-1 y with H = [X, 1]: so the evidence is
a function of the covariance's hyperparameters alone, and its derivatives by them are
those at fixed alpha. The result is the same as with alpha among the hyperparameters
(equation 7 with its intercept, 12), found sooner. As there, alpha counts as known
afterwards: its uncertainty is not in the prediction's variance.
"""

import numpy as np

from handclean.arrays import Floats
from handclean.errors import UnknownNameError

MEANS = ("m0", "ml")
"""Zero and linear with an intercept; zero is the mean of the scaled targets."""


def basis(mean: str, inputs: Floats) -> Floats:
    """(N, 0) or (N, S + 1): what the mean is a combination of, at inputs (N, S)."""
    if mean == "m0":
        return np.zeros((len(inputs), 0))
    if mean == "ml":
        return np.hstack([inputs, np.ones((len(inputs), 1))])
    raise UnknownNameError("mean", "mean function", mean, MEANS)


def weights(normal: Floats, right: Floats) -> Floats:
    """Weights alpha of the mean by generalised least squares.

    Of columns that are combinations of others (a constant channel beside the intercept)
    the smallest weights are taken.

    Parameters
    ----------
    normal : (R, R), H^T C^-1 H; right : (R,), H^T C^-1 y.
    """
    if not len(normal):
        return np.zeros(0)
    size = np.sqrt(np.maximum(np.diagonal(normal), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    scaled = normal / np.outer(size, size)
    alpha: Floats = np.linalg.lstsq(scaled, right / size, rcond=1e-12)[0] / size
    return alpha
