"""Frames of a take laid onto one posture, and what moves then: compiled."""

import math

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.align import align
from handclean.kernels.rotations import matrix_from_quaternion


@jit
def lay_frames(
    points: Floats, reference: Floats, weight: Floats, turn: Floats, shift: Floats
) -> None:
    """Find the rigid motions that lay the points of each frame onto a reference.

    Point p goes to ``turn @ p + shift``. A point that is NaN in a frame does not count
    there; a frame without any keeps NaN.

    Parameters
    ----------
    points : (T, N, 3); reference : (N, 3); weight : (N,)
    turn : (T, 3, 3), shift : (T, 3); overwritten.
    """
    pose, used = np.zeros(7), np.zeros(weight.shape[0])
    for t in range(points.shape[0]):
        total = 0.0
        for m in range(weight.shape[0]):
            used[m] = 0.0 if math.isnan(points[t, m, 0]) else weight[m]
            total += used[m]
        if total <= 0.0:
            turn[t] = np.nan
            shift[t] = np.nan
            continue
        align(points[t], reference, used, pose)
        matrix_from_quaternion(pose[3:7], turn[t])
        shift[t] = pose[:3]


@jit
def weighted_means(series: Floats, rows: Ints, taps: Floats, out: Floats) -> None:
    """Write means of rows around given rows of (T, C) series.

    Beyond its ends a series stays as it is at them.

    Parameters
    ----------
    rows : (N,); taps : (2 R + 1,) weights of the rows from R before to R behind.
    out : (N, C) overwritten.
    """
    reach = taps.shape[0] // 2
    for n in range(rows.shape[0]):
        out[n] = 0.0
        for k in range(taps.shape[0]):
            t = min(max(rows[n] + k - reach, 0), series.shape[0] - 1)
            for c in range(series.shape[1]):
                out[n, c] += taps[k] * series[t, c]


@jit
def smooth_present(points: Floats, taps: Floats, out: Floats) -> None:
    """Write weighted means in time of points (T, N, 3), of those that are there.

    A point that is NaN stays so; the weights of those beside it that are there, (2 R +
    1,) ``taps``, are scaled to sum to 1.
    """
    reach = taps.shape[0] // 2
    for t in range(points.shape[0]):
        first, stop = max(t - reach, 0), min(t + reach + 1, points.shape[0])
        for m in range(points.shape[1]):
            out[t, m] = np.nan
            if math.isnan(points[t, m, 0]):
                continue
            total, x, y, z = 0.0, 0.0, 0.0, 0.0
            for s in range(first, stop):
                if not math.isnan(points[s, m, 0]):
                    tap = taps[s - t + reach]
                    total += tap
                    x += tap * points[s, m, 0]
                    y += tap * points[s, m, 1]
                    z += tap * points[s, m, 2]
            out[t, m, 0], out[t, m, 1], out[t, m, 2] = x / total, y / total, z / total
