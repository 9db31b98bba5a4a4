"""Stacks of rotations between the forms that files hold: Euler angles, quaternions.

Euler angles are about axes that are carried along: order ``"zxy"`` with angles a, b, c
is the matrix ``Rz(a) @ Rx(b) @ Ry(c)``.
"""

import numpy as np

from handclean.arrays import Floats, expect_shape

ORDERS = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")


def about(axis: int, angle: Floats) -> Floats:
    """(T, 3, 3) rotations by (T,) [rad] about a coordinate axis, 0, 1 or 2."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out = np.zeros((*angle.shape, 3, 3))
    out[..., axis, axis] = 1.0
    out[..., i, i] = out[..., j, j] = np.cos(angle)
    out[..., j, i] = np.sin(angle)
    out[..., i, j] = -np.sin(angle)
    return out


def about_line(axis: Floats, angle: Floats) -> Floats:
    """(T, 3, 3) rotations by (T,) [rad] about the unit vector ``axis`` (3,)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    out: Floats = np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)
    return out


def matrix_from_euler(angles: Floats, order: str) -> Floats:
    """(T, 3, 3) rotations from (T, len(order)) [rad] angles about carried axes."""
    out: Floats = np.tile(np.eye(3), (len(angles), 1, 1))
    for column, letter in enumerate(order.lower()):
        out = out @ about("xyz".index(letter), angles[:, column])
    return out


def euler_from_matrix(matrix: Floats, order: str) -> Floats:
    """(T, 3) [rad] angles about carried axes; three different axes in ``order``.

    The middle angle lies between -90 and 90 degrees; where it reaches them only the
    sum or difference of the outer two is defined, and the last one is set to 0.
    """
    expect_shape("matrix", matrix, "T", 3, 3)
    i, j, k = ("xyz".index(letter) for letter in order.lower())
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    sine = np.clip(sign * matrix[:, i, k], -1.0, 1.0)
    cosine = np.hypot(matrix[:, i, i], matrix[:, i, j])
    out = np.zeros((len(matrix), 3))
    out[:, 1] = np.arctan2(sine, cosine)
    free = cosine > 1e-9
    first = np.arctan2(-sign * matrix[:, j, k], matrix[:, k, k])
    last = np.arctan2(-sign * matrix[:, i, j], matrix[:, i, i])
    locked = np.arctan2(sign * matrix[:, k, j], matrix[:, j, j])
    out[:, 0] = np.where(free, first, locked)
    out[:, 2] = np.where(free, last, 0.0)
    return out


def matrix_from_quaternion(quaternion: Floats) -> Floats:
    """(T, 3, 3) rotations from (T, 4) unit quaternions w, x, y, z."""
    expect_shape("quaternion", quaternion, "T", 4)
    w, x, y, z = quaternion.T
    out = np.stack(
        [
            1 - 2 * (y * y + z * z),
            2 * (x * y - w * z),
            2 * (x * z + w * y),
            2 * (x * y + w * z),
            1 - 2 * (x * x + z * z),
            2 * (y * z - w * x),
            2 * (x * z - w * y),
            2 * (y * z + w * x),
            1 - 2 * (x * x + y * y),
        ],
        axis=1,
    )
    return out.reshape(-1, 3, 3)


def quaternion_from_matrix(matrix: Floats) -> Floats:
    """(T, 4) unit quaternions w, x, y, z, continuous in sign along T.

    Each is the column of largest diagonal of the matrix ``4 q q^T``, whose entries are
    sums and differences of the rotation's; NaN rows stay NaN.
    """
    expect_shape("matrix", matrix, "T", 3, 3)
    m = matrix
    four = np.zeros((len(m), 4, 4))
    four[:, 0, 0] = 1 + m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        four[:, i + 1, i + 1] = 1 + m[:, i, i] - m[:, j, j] - m[:, k, k]
        four[:, 0, i + 1] = four[:, i + 1, 0] = m[:, k, j] - m[:, j, k]
        four[:, i + 1, j + 1] = four[:, j + 1, i + 1] = m[:, i, j] + m[:, j, i]
    diagonal = np.einsum("tii->ti", four)
    best = np.argmax(diagonal, axis=1)
    out: Floats = four[np.arange(len(m)), best]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    first = np.where(out[:1, 0] < 0, -1.0, 1.0)
    turns = np.where(np.sum(out[1:] * out[:-1], axis=1) < 0, -1.0, 1.0)
    out *= np.cumprod(np.concatenate([first, turns]))[:, None]
    return out


def rotation_angle(matrix: Floats) -> Floats:
    """(T,) [rad] by how much (T, 3, 3) rotations turn, accurate near 0 too."""
    m = matrix
    sine = np.stack(
        [m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]]
    )
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    angle: Floats = np.arctan2(np.linalg.norm(sine, axis=0), trace - 1.0)
    return angle
