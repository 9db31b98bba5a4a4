"""The rigid motion that best lays weighted points onto others (Horn 1987).

The rotation is the eigenvector, of the largest eigenvalue, of a symmetric 4 x 4 matrix
made from the cross-covariance; Jacobi rotations find it.
"""

import math

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.kernels.rotations import matrix_from_quaternion


@jit
def largest_eigenvector(n: Floats, out: Floats) -> None:
    """Write the unit eigenvector of the largest eigenvalue of a symmetric 4 x 4.

    ``n`` is overwritten; its scale does not matter.
    """
    vectors = np.eye(4)
    for _ in range(12):
        off = 0.0
        for p in range(3):
            for q in range(p + 1, 4):
                off += abs(n[p, q])
        size = abs(n[0, 0]) + abs(n[1, 1]) + abs(n[2, 2]) + abs(n[3, 3])
        if off <= 1e-15 * size:
            break
        for p in range(3):
            for q in range(p + 1, 4):
                if n[p, q] == 0.0:
                    continue
                ratio = (n[q, q] - n[p, p]) / (2.0 * n[p, q])
                t = 1.0 / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
                if ratio < 0.0:
                    t = -t
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = t * c
                for r in range(4):
                    x, y = n[r, p], n[r, q]
                    n[r, p], n[r, q] = c * x - s * y, s * x + c * y
                for r in range(4):
                    x, y = n[p, r], n[q, r]
                    n[p, r], n[q, r] = c * x - s * y, s * x + c * y
                for r in range(4):
                    x, y = vectors[r, p], vectors[r, q]
                    vectors[r, p], vectors[r, q] = c * x - s * y, s * x + c * y
    best = 0
    for p in range(1, 4):
        if n[p, p] > n[best, best]:
            best = p
    for r in range(4):
        out[r] = vectors[r, best]


@jit
def align(source: Floats, target: Floats, weight: Floats, pose: Floats) -> None:
    """Write the root that moves ``source`` onto ``target`` best, in least squares.

    Parameters
    ----------
    source, target : (M, 3) [m]
    weight : (M,); points of weight 0 do not count and may be NaN.
    pose : its first seven numbers, translation and quaternion, are overwritten. With
        no weight at all they are left alone.
    """
    total = 0.0
    a, b = np.zeros(3), np.zeros(3)
    for m in range(weight.shape[0]):
        w = weight[m]
        if w > 0.0:
            total += w
            for i in range(3):
                a[i] += w * source[m, i]
                b[i] += w * target[m, i]
    if total <= 0.0:
        return
    for i in range(3):
        a[i] /= total
        b[i] /= total
    s = np.zeros((3, 3))
    for m in range(weight.shape[0]):
        w = weight[m]
        if w > 0.0:
            for i in range(3):
                for j in range(3):
                    s[i, j] += w * (source[m, i] - a[i]) * (target[m, j] - b[j])
    n = np.zeros((4, 4))
    n[0, 0] = s[0, 0] + s[1, 1] + s[2, 2]
    n[1, 1] = s[0, 0] - s[1, 1] - s[2, 2]
    n[2, 2] = -s[0, 0] + s[1, 1] - s[2, 2]
    n[3, 3] = -s[0, 0] - s[1, 1] + s[2, 2]
    n[0, 1] = n[1, 0] = s[1, 2] - s[2, 1]
    n[0, 2] = n[2, 0] = s[2, 0] - s[0, 2]
    n[0, 3] = n[3, 0] = s[0, 1] - s[1, 0]
    n[1, 2] = n[2, 1] = s[0, 1] + s[1, 0]
    n[1, 3] = n[3, 1] = s[2, 0] + s[0, 2]
    n[2, 3] = n[3, 2] = s[1, 2] + s[2, 1]
    largest_eigenvector(n, pose[3:7])
    r = np.zeros((3, 3))
    matrix_from_quaternion(pose[3:7], r)
    for i in range(3):
        pose[i] = b[i] - r[i, 0] * a[0] - r[i, 1] * a[1] - r[i, 2] * a[2]
