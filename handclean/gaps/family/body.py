"""How a body moved as a whole, taken out of the places of its markers.

Each frame of some markers is laid onto a reference by the rotation and the shift that
fit best (Kabsch): with the centroids a, b of the frame and of the reference and the
covariance C = (P - a)^T (Q - b) = U S V^T, points p go to p R + t, where ::

    R = U diag(1, 1, det(U V^T)) V^T,    t = b - a R .
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats


class Motion(NamedTuple):
    """Rotations (N, 3, 3) and shifts (N, 1, 3) [m] that take the body's motion out."""

    turn: Floats
    shift: Floats

    def to_body(self, points: Floats) -> Floats:
        """(N, P, 3) [m] where points of each frame are in the reference."""
        return np.asarray(points @ self.turn + self.shift)

    def to_laboratory(self, places: Floats) -> Floats:
        """(N, 3) [m] where places in the reference were, one in each frame."""
        back = (places[:, None] - self.shift) @ np.swapaxes(self.turn, 1, 2)
        return np.asarray(back[:, 0])


def motion_onto(points: Floats, reference: Floats) -> Motion:
    """Find what lays the points of each frame onto a reference.

    Parameters
    ----------
    points : (N, P, 3) [m]; reference : (P, 3) [m]
    """
    here, there = points.mean(axis=1, keepdims=True), reference.mean(axis=0)
    covariance = np.swapaxes(points - here, 1, 2) @ (reference - there)
    left, _, right = np.linalg.svd(covariance)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    turn = left @ right
    return Motion(turn=turn, shift=there - here @ turn)
