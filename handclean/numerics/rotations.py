"""Points turned by many rotations at once."""

import numpy as np

from handclean.arrays import Floats


def rotated(turns: Floats, points: Floats) -> Floats:
    """Turn each point by its own rotation.

    Parameters
    ----------
    turns : (..., 3, 3) rotation matrices.
    points : (..., 3)

    Returns
    -------
    (..., 3) in the unit of the points.
    """
    out: Floats = np.einsum("...ij,...j->...i", turns, points)
    return out


def rotated_back(turns: Floats, points: Floats) -> Floats:
    """Turn each point by the inverse of its own rotation.

    Parameters
    ----------
    turns : (..., 3, 3) rotation matrices.
    points : (..., 3)

    Returns
    -------
    (..., 3) in the unit of the points.
    """
    out: Floats = np.einsum("...ji,...j->...i", turns, points)
    return out
