"""Orientations to start an alignment from: principal axes, and an even spread.

The axes of a model and of a cluster of points are laid onto each other with every
combination of signs (Maycock 2015 eq. 1). Of the eight, four mirror the hand, which no
hand can do; four are rotations.
"""

import math

import numpy as np

from handclean.arrays import Floats


def principal_axes(points: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the mean, the principal axes and the extents of points.

    Returns
    -------
    Mean (3,), right-handed axes (3, 3) as columns, the longest first, and extents (3,)
    along them.
    """
    middle = points.mean(axis=0)
    axes = np.linalg.eigh((points - middle).T @ (points - middle))[1][:, ::-1].copy()
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    along = (points - middle) @ axes
    return middle, axes, np.ptp(along, axis=0)


def sign_combinations(source: Floats, target: Floats) -> Floats:
    """(4, 3, 3) rotations of right-handed axes onto others, columns (eq. 1)."""
    signs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    return np.array([(target * sign) @ source.T for sign in signs])


def spread_rotations(count: int) -> Floats:
    """(count, 3, 3) rotations spread evenly over all orientations.

    The super-Fibonacci spiral of Alexa, Super-Fibonacci Spirals: Fast, Low-Discrepancy
    Sampling of SO(3), CVPR 2022.
    """
    phi, psi = math.sqrt(2.0), 1.533751168755204288118041
    s = np.arange(count) + 0.5
    t, d = s / count, 2.0 * math.pi * s
    r, big = np.sqrt(t), np.sqrt(1.0 - t)
    q = np.stack(
        [
            r * np.sin(d / phi),
            r * np.cos(d / phi),
            big * np.sin(d / psi),
            big * np.cos(d / psi),
        ],
        axis=1,
    )
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.ascontiguousarray(np.moveaxis(np.array(rows), 2, 0))
