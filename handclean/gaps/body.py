"""How a body moved as a whole, taken out of the places of its markers.

Each frame of some markers is laid onto a reference by the rotation and the shift that
fit best in least squares (`kernels.align`).
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats
from handclean.kernels.body_frames import lay_frames


class Motion(NamedTuple):
    """Rotations R and shifts t that take the body's motion out: R p + t.

    turn (N, 3, 3); shift (N, 3) [m].
    """

    turn: Floats
    shift: Floats

    def to_body(self, points: Floats) -> Floats:
        """(N, P, 3) [m] where points of each frame are in the reference."""
        turned = points @ np.swapaxes(self.turn, 1, 2)
        return np.asarray(turned + self.shift[:, None])

    def to_laboratory(self, places: Floats) -> Floats:
        """(N, 3) [m] where places in the reference were, one in each frame."""
        back = (places - self.shift)[:, None] @ self.turn
        return np.asarray(back[:, 0])


def motion_onto(
    points: Floats, reference: Floats, weight: Floats | None = None
) -> Motion:
    """Find what lays the points of each frame onto a reference.

    Parameters
    ----------
    points : (N, P, 3) [m], NaN where missing; reference : (P, 3) [m]
    weight : (P,) of the points; all alike by default.
    """
    turn, shift = (
        np.full((len(points), 3, 3), np.nan),
        np.full((len(points), 3), np.nan),
    )
    here, there = np.ascontiguousarray(points), np.ascontiguousarray(reference)
    weight = np.ones(len(reference)) if weight is None else weight
    lay_frames(here, there, weight, turn, shift)
    return Motion(turn=turn, shift=shift)
