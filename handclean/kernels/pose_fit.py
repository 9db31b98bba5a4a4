"""Poses of single frames with a hand that stays as it is (see ``kernels.bundle``)."""

import math

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.kernels.bundle import (
    DIAGONAL_ADDED,
    Body,
    Room,
    frame_cost,
    pose_equations,
)
from handclean.kernels.linalg import backward, factor, forward, forward_vector
from handclean.kernels.pose_step import move


@jit
def fit_poses(
    poses: Floats,
    targets: Floats,
    weights: Floats,
    soft: float,
    iterations: int,
    body: Body,
    room: Room,
    out: Floats,
) -> None:
    """Fit every frame's pose with the hand as it is (Levenberg and Marquardt).

    Parameters
    ----------
    poses : (T, 7 + D) starts, overwritten by the results.
    targets : (T, M, 3); weights : (T, M)
    out : (T,) final costs, overwritten.
    """
    size = poses.shape[1] - 1
    square, lower = np.zeros((size, size)), np.zeros((size, size))
    slope, step = np.zeros(size), np.zeros(size)
    trial = np.zeros(size + 1)
    for f in range(poses.shape[0]):
        damping = 1e-3
        cost = frame_cost(poses[f], targets[f], weights[f], soft, body, room)
        stale = True
        for _ in range(iterations):
            if stale:
                pose_equations(poses[f], body, room, square, slope)
                stale = False
            lower[:] = square
            for a in range(size):
                lower[a, a] += damping * square[a, a] + DIAGONAL_ADDED
                step[a] = slope[a]
            factor(lower)
            forward_vector(lower, step, 0)
            promise = 0.0
            for a in range(size):
                promise += step[a] * step[a]
            backward(lower, step)
            move(poses[f], step, trial)
            after = frame_cost(trial, targets[f], weights[f], soft, body, room)
            if after <= cost:
                poses[f] = trial
                cost = after
                stale = True
                damping = max(0.2 * damping, 1e-9)
            else:
                damping *= 6.0
                if damping > 1e8:
                    break
            if promise < 1e-9 * (cost + 1e-12):
                break
        out[f] = cost


@jit
def pose_sigmas(
    poses: Floats,
    targets: Floats,
    weights: Floats,
    soft: float,
    body: Body,
    room: Room,
    out: Floats,
) -> None:
    """Write the standard deviation of every pose number, the hand taken as known.

    Parameters
    ----------
    poses : (T, 7 + D); targets : (T, M, 3); weights : (T, M) [1/m^2]
    out : (T, P) [m, rad], the square roots of the diagonals of inv(H); overwritten.
    """
    size = out.shape[1]
    lower, line = np.zeros((size, size)), np.zeros(size)
    inverse = np.zeros((size, size))
    for f in range(poses.shape[0]):
        frame_cost(poses[f], targets[f], weights[f], soft, body, room)
        pose_equations(poses[f], body, room, lower, line)
        inverse[:] = 0.0
        for a in range(size):
            lower[a, a] += DIAGONAL_ADDED
            inverse[a, a] = 1.0
        factor(lower)
        forward(lower, inverse)
        for a in range(size):
            total = 0.0
            for b in range(size):
                total += inverse[b, a] * inverse[b, a]
            out[f, a] = math.sqrt(total)
