"""A stiff model aligned with points, from many orientations: iterative closest points.

In each round the points are assigned to the markers by the Hungarian method, within a
gate that shrinks, and the model is aligned with them in closed form.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.kernels.align import align
from handclean.kernels.rotations import matrix_from_quaternion
from handclean.labels.track.fit import gated_squares, observe_points
from handclean.numerics.assignment import assign_rows

ICP_ROUNDS, ICP_GATE_SHRINK = 5, 0.67
"""Rounds of `rigid_icp`, and the share of the gate that they take off. Chosen."""


class RigidFits(NamedTuple):
    """Rigid alignments from R orientations.

    poses (R, 7). scores (R,) [m^2] : mean squared distance, cut at the gate.
    """

    poses: Floats
    scores: Floats


@jit
def rigid_icp(
    shape: Floats, points: Floats, turns: Floats, centre: Floats, gate_m: float
) -> RigidFits:
    """Align a stiff model with points from many orientations (ICP by assignment).

    Parameters
    ----------
    shape : (M, 3) [m] markers of one posture, root unturned at the origin.
    points : (P, 3) [m]
    turns : (R, 3, 3) rotations to start from.
    centre : (3,) [m] where to put the mean of the markers.
    gate_m : [m] longest distance at the start; it shrinks to a third.
    """
    markers, count = shape.shape[0], points.shape[0]
    poses, scores = np.zeros((turns.shape[0], 7)), np.zeros(turns.shape[0])
    middle = np.zeros(3)
    for m in range(markers):
        for n in range(3):
            middle[n] += shape[m, n] / markers
    placed, observed = np.zeros((markers, 3)), np.zeros((markers, 3))
    weight, price = np.zeros(markers), np.zeros(markers)
    squares, chosen = np.zeros((markers, count)), np.zeros(markers, dtype=np.int64)
    pose, matrix = np.zeros(7), np.zeros((3, 3))
    for r in range(turns.shape[0]):
        pose[:] = 0.0
        pose[3] = 1.0
        matrix[:] = turns[r]
        for n in range(3):
            pose[n] = centre[n]
            for j in range(3):
                pose[n] -= matrix[n, j] * middle[j]
        for step in range(ICP_ROUNDS + 1):
            reach = gate_m * (1.0 - ICP_GATE_SHRINK * step / ICP_ROUNDS)
            for m in range(markers):
                for n in range(3):
                    placed[m, n] = pose[n]
                    for j in range(3):
                        placed[m, n] += matrix[n, j] * shape[m, j]
            price[:] = reach * reach
            gated_squares(placed, points, reach, squares)
            assign_rows(squares, price, chosen)
            total = 0.0
            for m in range(markers):
                total += price[m] if chosen[m] < 0 else squares[m, chosen[m]]
            scores[r] = total / markers
            last = step == ICP_ROUNDS
            if last or observe_points(points, chosen, observed, weight) < 3:
                break
            align(shape, observed, weight, pose)
            matrix_from_quaternion(pose[3:7], matrix)
        poses[r] = pose
    return RigidFits(poses, scores)
