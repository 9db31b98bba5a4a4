"""Turning a laboratory so that another axis points up, by whole quarters of a turn."""

import numpy as np

from handclean.arrays import Floats

_TO_Y = {
    "+x": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "-x": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    "+y": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-y": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "+z": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "-z": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
}
"""Rotations that bring an axis to y; where a half turn does, the one about x."""

AXES = tuple(_TO_Y)
"""Axes that may point up."""


def upright(up_axis: str, wanted: str) -> Floats:
    """(3, 3) rotation of a laboratory that brings the axis that is up to another.

    Parameters
    ----------
    up_axis, wanted : one of `AXES`.

    Examples
    --------
    >>> upright("+z", "+y") @ [1.0, 2.0, 3.0]
    array([ 1.,  3., -2.])
    """
    there, back = (np.array(_TO_Y[axis], dtype=float) for axis in (up_axis, wanted))
    turn: Floats = back.T @ there
    return turn
