"""Frame-by-frame inverse kinematics of a whole take, compiled.

Each frame starts where the last update points to (Maycock 2015 section III-B). Where
the markers leave a finger open, the layered scheme of Schroeder 2016 section 3.2
comes first: alpha in the posture subspace, then the full posture from there. Where
they decide everything, both end in the same optimum, and the layer is left out. While
refining, open fingers are held to the subspace's posture (without a prior: to the last
frame's) with the weight that prior keeps, so that noise cannot drive joints nobody
sees.
"""

import math

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.kernels.align import align
from handclean.kernels.gauss_newton import (
    Chain,
    Work,
    misfit,
    project,
    solve_full,
    solve_subspace,
    undecided,
)

LOOSE = 0.5
"""[rad] how far a joint strays, one sd, from what the subspace says."""


EAGER = 0.3
"""Share of the last update in the velocity; the whole of it would carry its noise."""


GLIDE = 0.1
"""[rad] how far an open finger follows the subspace's posture in one frame."""

BETTER = 0.98
"""What another start has to bring the RMS down to, to be believed."""

JUMP_STEP, JUMP_PRICE = 0.1, 9.0
"""[rad] motion of a joint from frame to frame, one sd, and what a jump of it costs at
most, in squared sd of the markers' noise."""

SOON, LATER = 10, 100
"""[frames] between two fresh starts: where a frame sticks out, where all are poor."""


@jit
def look(target: Floats, weight: Floats, out: Floats) -> tuple[int, bool]:
    """Write the weights of the markers that are there.

    Returns
    -------
    How many there are, and whether they are the ones ``out`` named before.
    """
    count, same = 0, True
    for m in range(weight.shape[0]):
        x = target[m, 0] + target[m, 1] + target[m, 2]
        w = weight[m] if math.isfinite(x) else 0.0
        same = same and (w > 0.0) == (out[m] > 0.0)
        out[m] = w
        count += 1 if w > 0.0 else 0
    return count, same


@jit
def settle(
    pose: Floats,
    target: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    basis: Floats,
    is_open: Bools,
    level: int,
    rest: Floats,
    anchor: Floats,
    numbers: tuple[float, float, float],
    iterations: int,
    most: float = math.inf,
) -> int:
    """Solve one frame from ``pose``, in place: the layer, if needed, then all angles.

    Parameters
    ----------
    is_open : (D,), level : as `undecided` says.
    rest, anchor : (D,) room; hold what open fingers were held to.
    numbers : damping, enough_m, prior_m.
    most : [rad] how far open fingers go from the start towards the subspace's
        posture, so that they glide where that jumps.

    Returns
    -------
    The number of steps.
    """
    damping, enough_m, prior_m = numbers
    if level > 0 and basis.shape[1] > 0:
        for d in range(rest.shape[0]):
            rest[d] = pose[7 + d]
        project(mean, basis, pose[7:], k)
        solve_subspace(
            pose, target, weight, tree, k, mean, basis, prior_m, damping,
            iterations, enough_m,
        )  # fmt: skip
        for d in range(rest.shape[0]):
            if is_open[d]:
                pose[7 + d] = rest[d] + min(max(pose[7 + d] - rest[d], -most), most)
    for d in range(anchor.shape[0]):
        rest[d] = pose[7 + d]
        anchor[d] = (prior_m / LOOSE) ** 2 if is_open[d] else 0.0
    return solve_full(
        pose, target, weight, tree, k, rest, anchor, damping, iterations, enough_m
    )[1]


@jit
def rms(weight: Floats, k: Work) -> float:
    """[m] root mean square of the errors `solve_full` left, each marker counting once.

    Markers of weight 0 are not there.
    """
    total, count = 0.0, 0
    for m in range(weight.shape[0]):
        if weight[m] > 0.0:
            for n in range(3):
                total += k.error[m, n] ** 2
            count += 1
    return math.sqrt(total / count)


@jit
def strain(one: Floats, two: Floats) -> float:
    """What it costs joints to go from one pose to another in a frame, see `mend`."""
    total = 0.0
    for n in range(7, one.shape[0]):
        step = (two[n] - one[n]) / JUMP_STEP
        total += min(step * step, JUMP_PRICE)
    return total


@jit
def start_afresh(
    pose: Floats,
    starts: Floats,
    target: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    basis: Floats,
    is_open: Bools,
    rest: Floats,
    anchor: Floats,
    numbers: tuple[float, float, float],
    lever_m: float,
    best: float,
) -> float:
    """Try several postures, each laid onto the markers; keep the best in ``pose``.

    Parameters
    ----------
    starts : (S, D) [rad] postures to try.
    best : [m] RMS that ``pose`` has now; it stays if none is better.

    Returns
    -------
    [m] RMS of ``pose`` afterwards.
    """
    attempt = np.zeros(pose.shape[0])
    for s in range(starts.shape[0]):
        attempt[:] = 0.0
        attempt[3] = 1.0
        attempt[7:] = starts[s]
        misfit(attempt, target, weight, tree, k)
        align(k.point, target, weight, attempt)
        level = undecided(
            attempt, target, weight, tree, k, numbers[0], lever_m, is_open
        )
        settle(
            attempt, target, weight, tree, k, mean, basis, is_open, level, rest,
            anchor, numbers, 40,
        )  # fmt: skip
        found = rms(weight, k)
        if found < best:
            best = found
            pose[:] = attempt
    return best


@jit
def amend(
    end: int,
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    basis: Floats,
    is_open: Bools,
    rest: Floats,
    anchor: Floats,
    numbers: tuple[float, float, float],
    lever_m: float,
    iterations: int,
    poses: Floats,
    residual: Floats,
    opened: Bools,
) -> None:
    """Solve the frames before ``end`` again, backwards from it, while that is better.

    For the frames that a fresh start at ``end`` shows to have been in a worse optimum.
    """
    pose, here = poses[end].copy(), np.zeros(weight.shape[0])
    for t in range(end - 1, -1, -1):
        count, _ = look(targets[t], weight, here)
        if count < 3:
            break
        level = undecided(pose, targets[t], here, tree, k, numbers[0], lever_m, is_open)
        settle(
            pose, targets[t], here, tree, k, mean, basis, is_open, level, rest,
            anchor, numbers, iterations,
        )  # fmt: skip
        found = rms(here, k)
        if not found < BETTER * residual[t]:
            break
        poses[t], residual[t], opened[t] = pose, found, is_open


@jit
def solve_frames(
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    basis: Floats,
    starts: Floats,
    numbers: tuple[float, float, float],
    lever_m: float,
    restart_m: float,
    iterations: int,
    poses: Floats,
    residual: Floats,
    opened: Bools,
    sure: Bools,
    steps: Ints,
) -> None:
    """Solve every frame of a take.

    Parameters
    ----------
    targets : (T, M, 3) [m], NaN where missing; weight : (M,).
    mean : (D,), basis : (D, K) posture prior; K = 0 for standard inverse kinematics.
    starts : (S, D) [rad] postures to start from where there is no frame before.
    numbers : damping, enough_m, prior_m.
    poses : (T, 7 + D), residual : (T,) [m], opened : (T, D), sure : (T,),
    steps : (T,), overwritten in full. With fewer than three markers a frame keeps the
        pose before it and is not sure; otherwise it is if markers decide the root.
    """
    size, hinges = poses.shape[1], mean.shape[0]
    pose, velocity, last = np.zeros(size), np.zeros(size), np.zeros(size)
    rest, anchor, here = np.zeros(hinges), np.zeros(hinges), np.zeros(weight.shape[0])
    is_open = np.ones(hinges, dtype=np.bool_)
    started, level, usual, lowest = False, 2, 0.0, math.inf
    soon, later = 0, 0
    pose[3] = 1.0
    pose[7:] = mean
    for t in range(targets.shape[0]):
        count, same = look(targets[t], weight, here)
        residual[t], steps[t] = math.nan, 0
        if count < 3:
            velocity[:] = 0.0
            level = 2
            is_open[:] = True
        elif not started:
            residual[t] = start_afresh(
                pose, starts, targets[t], here, tree, k, mean, basis, is_open, rest,
                anchor, numbers, lever_m, math.inf,
            )  # fmt: skip
            level = undecided(
                pose, targets[t], here, tree, k, numbers[0], lever_m, is_open
            )
            started, usual = True, residual[t]
        else:
            if not same or level == 2:
                level = undecided(
                    pose, targets[t], here, tree, k, numbers[0], lever_m, is_open
                )
            last[:] = pose
            norm = 0.0
            for n in range(size):
                if n < 7 or not is_open[n - 7]:
                    pose[n] += velocity[n]
                if 3 <= n < 7:
                    norm += pose[n] * pose[n]
            for n in range(3, 7):
                pose[n] /= math.sqrt(norm)
            steps[t] = settle(
                pose, targets[t], here, tree, k, mean, basis, is_open, level, rest,
                anchor, numbers, iterations, GLIDE,
            )  # fmt: skip
            residual[t] = rms(here, k)
            odd = t >= soon and residual[t] > 1.5 * usual + restart_m
            poor = t >= later and usual > 1.1 * lowest
            if odd or poor:
                soon, later, before = t + SOON, t + LATER, residual[t]
                poses[t] = pose
                residual[t] = start_afresh(
                    poses[t], starts, targets[t], here, tree, k, mean, basis, is_open,
                    rest, anchor, numbers, lever_m, BETTER * before,
                )  # fmt: skip
                if residual[t] < BETTER * before:
                    pose[:] = poses[t]
                    last[:] = pose
                    velocity[:] = 0.0
                    amend(
                        t, targets, weight, tree, k, mean, basis, is_open, rest,
                        anchor, numbers, lever_m, iterations, poses, residual, opened,
                    )  # fmt: skip
                else:
                    residual[t] = before
                level = undecided(
                    pose, targets[t], here, tree, k, numbers[0], lever_m, is_open
                )
            usual += 0.05 * (min(residual[t], 1.5 * usual + restart_m) - usual)
            lowest = min(lowest, usual)
            for n in range(size):
                velocity[n] += EAGER * (pose[n] - last[n] - velocity[n])
        poses[t] = pose
        opened[t] = is_open
        sure[t] = count >= 3 and level < 2
