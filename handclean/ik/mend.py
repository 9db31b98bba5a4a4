"""Jumps between postures that fit the same markers, taken out of a take; compiled.

A finger with two markers has an elbow up and an elbow down that fit almost as well, and
a frame by itself falls into either. So where hinges jump from one frame to the next,
the fingers that do are solved again, forwards from the posture before the jump and
backwards from the one after it, until they meet the take's own posture. With sigma the
noise of the markers per axis, that is kept which has the smaller ::

    sum_t [ sum_m |t_m - p_m|^2 / sigma^2 + sum_d min((dq_d / STEP)^2, COST) ]

The second term lets joints move by STEP = `frames.HINGE_STEP_SD_RAD` per frame, one sd,
or jump at a bounded cost, `frames.MAX_STEP_COST` (a truncated parabola, Blake and
Zisserman, Visual Reconstruction, 1987): markers outweigh it wherever they do tell.
Where neither direction leads back, the frames beside the jump are fitted once more with
the same term on both sides, and kept if their RMS stays within `SMOOTHED_RMS_RATIO` of
its optimum.

A finger that is open for a while follows the subspace, and jumps when its markers come
back. If that is soon, it is interpolated from one end to the other instead.

Measured, jumps of more than 20 degrees from frame to frame, before and after: dfki13
recording 53 and 18 (RMS 0.504 and 0.495 mm), six simulated takes with its markers 435
and 128 (angles off by 4.9 and 4.6 degrees on average).
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.ik.frames import (
    HINGE_STEP_SD_RAD,
    MIN_MARKERS,
    SUBSPACE_RESIDUAL_SD_RAD,
    PoseProblem,
    TakeFit,
    TakeMarkers,
    rms,
    step_cost,
    weigh_markers,
)
from handclean.kernels import jit
from handclean.kernels.gauss_newton import Anchor, Observations, Workspace, solve_full

JUMP_RAD = 0.3
"""[rad] from one frame to the next that counts as a jump. Chosen."""

MERGED_RAD = 0.02
"""[rad] largest difference of any hinge at which two paths have met. Chosen."""

MAX_PATH_FRAMES = 60
"""[frames] within which they should. Chosen."""

SMOOTHED_RMS_RATIO = 1.01
"""A smoothed frame's RMS over its optimum, at most. Chosen."""

GIVE_UP_COST = 20.0
"""By how much more a path may cost, in squared sd, before it is given up. Chosen."""


class JumpTask(NamedTuple):
    """What all parts of the search for jumps share.

    noise_m: [m] of the markers per axis; fit: the solved take, changed.
    """

    markers: TakeMarkers
    problem: PoseProblem
    noise_m: float
    fit: TakeFit
    k: Workspace


class Path(NamedTuple):
    """Poses (N, 7 + D) of frames in a row, and their RMS (N,) [m]."""

    poses: Floats
    residual: Floats


class Extension(NamedTuple):
    """How many frames a path is long, 0 for none, and how much less it costs."""

    frames: int
    gain: float


@jit
def share_any(one: Bools, two: Bools) -> bool:
    """Whether both are true anywhere."""
    found = False
    for d in range(one.shape[0]):
        found = found or (one[d] and two[d])
    return found


@jit
def has_jumps(poses: Floats) -> bool:
    """Whether any hinge jumps in a take of poses (T, 7 + D)."""
    for t in range(1, poses.shape[0]):
        for n in range(7, poses.shape[1]):
            if abs(poses[t, n] - poses[t - 1, n]) > JUMP_RAD:
                return True
    return False


@jit
def refit(
    pose: Floats, seen: Observations, anchor: Anchor, problem: PoseProblem, k: Workspace
) -> float:
    """Solve a frame from ``pose``, in place; return its RMS [m]."""
    solved = solve_full(pose, seen, anchor, problem.tree, problem.control, k)
    return rms(seen.weight, solved.error)


@jit
def continue_posture(
    start: int, way: int, moves: Bools, task: JumpTask, path: Path
) -> Extension:
    """Continue the posture of a frame into its neighbours until it meets theirs.

    Parameters
    ----------
    start : frame to start from; way : 1 forwards, -1 backwards.
    moves : (D,) hinges that are solved again.
    path : room for `MAX_PATH_FRAMES`, overwritten.

    Returns
    -------
    How many frames differ, 0 if none or if the paths do not meet.
    """
    fit, markers, k = task.fit, task.markers, task.k
    here, hinges = np.zeros(markers.weight.shape[0]), moves.shape[0]
    free = Anchor(np.zeros(hinges), np.zeros(hinges))
    last, attempt = fit.poses[start].copy(), np.zeros(fit.poses.shape[1])
    gain = 0.0
    for i in range(MAX_PATH_FRAMES):
        t = start + way * (i + 1)
        if t < 0 or t >= fit.poses.shape[0]:
            return Extension(i, gain)
        count = weigh_markers(markers.targets[t], markers.weight, here).markers
        if count < MIN_MARKERS:
            return Extension(0, 0.0)
        attempt[:] = fit.poses[t]
        for d in range(hinges):
            if moves[d]:
                if fit.opened[t, d]:
                    return Extension(i, gain)
                attempt[7 + d] = last[7 + d]
        seen = Observations(markers.targets[t], here)
        path.residual[i] = refit(attempt, seen, free, task.problem, k)
        apart = np.max(np.abs(attempt[7:] - fit.poses[t, 7:]))
        gain += step_cost(fit.poses[t - way], fit.poses[t]) - step_cost(last, attempt)
        if apart < MERGED_RAD:
            return Extension(i, gain)
        gain += count * (fit.residual[t] ** 2 - path.residual[i] ** 2) / task.noise_m**2
        if gain < -GIVE_UP_COST:
            break
        path.poses[i] = attempt
        last[:] = attempt
    return Extension(0, 0.0)


@jit
def smooth_frame(t: int, moves: Bools, task: JumpTask) -> None:
    """Fit a frame again, between its neighbours, and keep that if it is better.

    Parameters
    ----------
    moves : (D,) hinges that are drawn to their neighbours.
    """
    poses, residual = task.fit.poses, task.fit.residual
    markers, hinges = task.markers, moves.shape[0]
    if t < 1 or t + 1 >= poses.shape[0]:
        return
    here, attempt = np.zeros(markers.weight.shape[0]), poses[t].copy()
    anchor = Anchor(np.zeros(hinges), np.zeros(hinges))
    if weigh_markers(markers.targets[t], markers.weight, here).markers < MIN_MARKERS:
        return
    for d in range(hinges):
        if moves[d]:
            if task.fit.opened[t, d]:
                return
            anchor.rest[d] = 0.5 * (poses[t - 1, 7 + d] + poses[t + 1, 7 + d])
            attempt[7 + d] = anchor.rest[d]
            anchor.weight[d] = 2.0 * (task.noise_m / HINGE_STEP_SD_RAD) ** 2
    seen = Observations(markers.targets[t], here)
    found = refit(attempt, seen, anchor, task.problem, task.k)
    before = step_cost(poses[t - 1], poses[t]) + step_cost(poses[t], poses[t + 1])
    after = step_cost(poses[t - 1], attempt) + step_cost(attempt, poses[t + 1])
    if found < SMOOTHED_RMS_RATIO * residual[t] and after < before:
        poses[t], residual[t] = attempt, found


@jit
def bridge_finger(
    start: int, stop: int, moves: Bools, task: JumpTask, path: Path
) -> None:
    """Interpolate open hinges from the frame before ``start`` to that at ``stop``.

    If that is better, it is kept. The markers in sight still pull, as far as they do.

    Parameters
    ----------
    moves : (D,) the hinges.
    path : room for the frames, overwritten.
    """
    poses, residual, markers = task.fit.poses, task.fit.residual, task.markers
    here, hinges = np.zeros(markers.weight.shape[0]), moves.shape[0]
    anchor, gain = Anchor(np.zeros(hinges), np.zeros(hinges)), 0.0
    held = (task.problem.subspace.noise_m / SUBSPACE_RESIDUAL_SD_RAD) ** 2
    for t in range(start, stop):
        i = t - start
        count = weigh_markers(markers.targets[t], markers.weight, here).markers
        attempt, share = path.poses[i], (i + 1.0) / (stop - start + 1.0)
        attempt[:] = poses[t]
        for d in range(hinges):
            if moves[d]:
                ends = poses[start - 1, 7 + d], poses[stop, 7 + d]
                anchor.rest[d] = (1.0 - share) * ends[0] + share * ends[1]
                attempt[7 + d] = anchor.rest[d]
                anchor.weight[d] = held
        if count < MIN_MARKERS:
            return
        seen = Observations(markers.targets[t], here)
        path.residual[i] = refit(attempt, seen, anchor, task.problem, task.k)
        last = poses[t - 1] if t == start else path.poses[i - 1]
        gain += step_cost(poses[t - 1], poses[t]) - step_cost(last, attempt)
        gain += count * (residual[t] ** 2 - path.residual[i] ** 2) / task.noise_m**2
    gain += step_cost(poses[stop - 1], poses[stop])
    if gain > step_cost(path.poses[stop - start - 1], poses[stop]):
        poses[start:stop] = path.poses[: stop - start]
        residual[start:stop] = path.residual[: stop - start]


@jit
def largest_step(poses: Floats, t: int, moves: Bools) -> float:
    """[rad] largest step of some hinges (D,) from the frame before ``t`` to it."""
    largest = 0.0
    for d in range(moves.shape[0]):
        if moves[d]:
            largest = max(largest, abs(poses[t, 7 + d] - poses[t - 1, 7 + d]))
    return largest


@jit
def bridge_open_fingers(limb: Ints, task: JumpTask) -> None:
    """Bridge fingers that are open for a while and jump when they no longer are.

    Parameters
    ----------
    limb : (D,) first hinge of the limb each hinge belongs to.
    """
    poses, opened, hinges = task.fit.poses, task.fit.opened, limb.shape[0]
    moves = np.zeros(hinges, dtype=np.bool_)
    path = Path(np.zeros((MAX_PATH_FRAMES, poses.shape[1])), np.zeros(MAX_PATH_FRAMES))
    for first in range(hinges):
        if limb[first] != first:
            continue
        for d in range(hinges):
            moves[d] = limb[d] == first
        start = 0
        for t in range(poses.shape[0]):
            if share_any(moves, opened[t]):
                continue
            if 0 < start < t and t - start <= MAX_PATH_FRAMES:
                jump = max(
                    largest_step(poses, start, moves), largest_step(poses, t, moves)
                )
                if jump > JUMP_RAD:
                    bridge_finger(start, t, moves, task, path)
            start = t + 1


@jit
def jumping_limbs(t: int, limb: Ints, fit: TakeFit, out: Bools) -> bool:
    """Write the hinges (D,) of limbs that jump between frames ``t - 1`` and ``t``.

    Hinges that markers leave open do not count.

    Returns
    -------
    Whether there are any.
    """
    out[:] = False
    for d in range(limb.shape[0]):
        jump = abs(fit.poses[t, 7 + d] - fit.poses[t - 1, 7 + d]) > JUMP_RAD
        if jump and not fit.opened[t, d] and not fit.opened[t - 1, d]:
            for e in range(limb.shape[0]):
                out[e] = out[e] or limb[e] == limb[d]
    return bool(out.any())


@jit
def remove_jumps(limb: Ints, task: JumpTask) -> None:
    """Take jumps out of a solved take, in place.

    Parameters
    ----------
    limb : (D,) first hinge of the limb each hinge belongs to.
    task : its ``fit`` is changed.
    """
    poses, residual = task.fit.poses, task.fit.residual
    size = poses.shape[1]
    moves = np.zeros(limb.shape[0], dtype=np.bool_)
    ahead = Path(np.zeros((MAX_PATH_FRAMES, size)), np.zeros(MAX_PATH_FRAMES))
    behind = Path(np.zeros((MAX_PATH_FRAMES, size)), np.zeros(MAX_PATH_FRAMES))
    for t in range(1, poses.shape[0]):
        if not jumping_limbs(t, limb, task.fit, moves):
            continue
        forwards = continue_posture(t - 1, 1, moves, task, ahead)
        backwards = continue_posture(t, -1, moves, task, behind)
        gain = 0.0
        if forwards.frames > 0:
            gain = max(forwards.gain, 0.0)
        if backwards.frames > 0 and backwards.gain > gain:
            for i in range(backwards.frames):
                poses[t - 1 - i] = behind.poses[i]
                residual[t - 1 - i] = behind.residual[i]
        elif gain > 0.0:
            for i in range(forwards.frames):
                poses[t + i], residual[t + i] = ahead.poses[i], ahead.residual[i]
        else:
            smooth_frame(t - 1, moves, task)
            smooth_frame(t, moves, task)
    bridge_open_fingers(limb, task)
