"""Rotations as unit quaternions (w, x, y, z) and 3 x 3 matrices.

A rotation vector v turns by |v| radians about v; exp and log go between it and the
quaternion. Near zero both use the series, so they are smooth through it.
"""

import math
from typing import Any

from handclean.arrays import Floats
from handclean.kernels import jit


@jit
def matrix_from_quaternion(q: Floats, out: Floats) -> None:
    """Write the rotation matrix of a unit quaternion.

    Parameters
    ----------
    q : (4,) w, x, y, z, of length 1.
    out : (3, 3), overwritten in full.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    out[0, 1] = 2.0 * (x * y - w * z)
    out[0, 2] = 2.0 * (x * z + w * y)
    out[1, 0] = 2.0 * (x * y + w * z)
    out[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    out[1, 2] = 2.0 * (y * z - w * x)
    out[2, 0] = 2.0 * (x * z - w * y)
    out[2, 1] = 2.0 * (y * z + w * x)
    out[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@jit
def quaternion_from_matrix(r: Floats, out: Floats) -> None:
    """Write the unit quaternion (w >= 0) of a rotation matrix (Shepperd's method).

    Parameters
    ----------
    r : (3, 3) rotation matrix.
    out : (4,) w, x, y, z, overwritten in full.
    """
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    if trace >= r[0, 0] and trace >= r[1, 1] and trace >= r[2, 2]:
        out[0] = 1.0 + trace
        out[1] = r[2, 1] - r[1, 2]
        out[2] = r[0, 2] - r[2, 0]
        out[3] = r[1, 0] - r[0, 1]
    else:
        i = 0
        if r[1, 1] > r[0, 0]:
            i = 1
        if r[2, 2] > r[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        out[0] = r[k, j] - r[j, k]
        out[1 + i] = 1.0 + r[i, i] - r[j, j] - r[k, k]
        out[1 + j] = r[i, j] + r[j, i]
        out[1 + k] = r[i, k] + r[k, i]
    size = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    if out[0] < 0.0:
        size = -size
    for n in range(4):
        out[n] /= size


@jit
def exponential(v: Floats, out: Floats) -> None:
    """Write the quaternion of a rotation vector.

    Parameters
    ----------
    v : (3,) [rad] rotation vector.
    out : (4,) w, x, y, z, overwritten in full.
    """
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square < 1e-8:
        out[0] = 1.0 - square / 8.0
        half_sinc = 0.5 - square / 48.0
    else:
        angle = math.sqrt(square)
        out[0] = math.cos(0.5 * angle)
        half_sinc = math.sin(0.5 * angle) / angle
    for n in range(3):
        out[1 + n] = half_sinc * v[n]


@jit
def logarithm(q: Floats, out: Floats) -> None:
    """Write the rotation vector, of length at most pi, of a unit quaternion.

    Parameters
    ----------
    q : (4,) w, x, y, z, of length 1; q and -q give the same rotation.
    out : (3,) [rad], overwritten in full.
    """
    size = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    sign = 1.0 if q[0] >= 0.0 else -1.0
    if size < 1e-7:
        scale = 2.0 * sign
    else:
        scale = 2.0 * sign * math.atan2(size, sign * q[0]) / size
    for n in range(3):
        out[n] = scale * q[1 + n]


def product(a: Floats, b: Floats) -> tuple[Any, Any, Any, Any]:
    """Return the quaternion of "first b, then a": Hamilton's product.

    Parameters
    ----------
    a, b : (4,) w, x, y, z; (4, ...) for many quaternions at once.

    Returns
    -------
    w, x, y, z : numbers, or arrays of many.
    """
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    return w, x, y, z


_product = jit(product)


@jit
def compose(a: Floats, b: Floats, out: Floats) -> None:
    """Write the quaternion of "first b, then a"; ``out`` may be ``a`` or ``b``.

    Parameters
    ----------
    a, b : (4,) w, x, y, z, of length 1.
    out : (4,) of length 1, renormalised against drift; overwritten in full.
    """
    w, x, y, z = _product(a, b)
    size = math.sqrt(w * w + x * x + y * y + z * z)
    out[0], out[1], out[2], out[3] = w / size, x / size, y / size, z / size
