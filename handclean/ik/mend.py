"""Jumps between postures that fit the same markers, taken out of a take; compiled.

A finger with two markers has an elbow up and an elbow down that fit almost as well, and
a frame by itself falls into either. So where hinges jump from one frame to the next,
the fingers that do are solved again, forwards from the posture before the jump and
backwards from the one after it, until they meet the take's own posture. With sigma the
noise of the markers per axis, that is kept which has the smaller ::

    sum_t [ sum_m |t_m - p_m|^2 / sigma^2 + sum_d min((dq_d / STEP)^2, PRICE) ]

The second term lets joints move by `frames.JUMP_STEP` per frame, one sd, or jump at a
bounded price (a truncated parabola, Blake and Zisserman, Visual Reconstruction, 1987):
markers outweigh it wherever they do tell. Where neither way leads back, the frames
beside the jump are fitted once more with the same term on both sides, and kept if their
RMS stays within `NEAR` of its optimum.

A finger that is open for a while follows the subspace, and jumps when its markers come
back. If that is soon, it is led straight from one end to the other instead.

Measured, jumps of more than 20 degrees from frame to frame, before and after: dfki13
recording 53 and 18 (RMS 0.504 and 0.495 mm), six simulated takes with its markers 435
and 128 (angles off by 4.9 and 4.6 degrees on average).
"""

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.ik.frames import JUMP_STEP, LOOSE, look, rms, strain
from handclean.kernels import jit
from handclean.kernels.gauss_newton import Chain, Work, solve_full

JUMP = 0.3
"""[rad] from one frame to the next that is looked into."""

MERGED = 0.02
"""[rad] largest difference of any hinge at which two ways have met."""

REACH = 60
"""[frames] within which they should."""

NEAR = 1.01
"""A softened frame's RMS over its optimum, at most."""

HOPELESS = 20.0
"""By how much a way may be worse before it is given up."""


@jit
def is_any(one: Bools, two: Bools) -> bool:
    """Whether both are true anywhere."""
    found = False
    for d in range(one.shape[0]):
        found = found or (one[d] and two[d])
    return found


@jit
def jumps(poses: Floats) -> bool:
    """Whether any hinge jumps in a take of poses (T, 7 + D)."""
    for t in range(1, poses.shape[0]):
        for n in range(7, poses.shape[1]):
            if abs(poses[t, n] - poses[t - 1, n]) > JUMP:
                return True
    return False


@jit
def solved_anew(
    pose: Floats,
    target: Floats,
    here: Floats,
    tree: Chain,
    k: Work,
    rest: Floats,
    anchor: Floats,
    numbers: tuple[float, float, float],
    iterations: int,
) -> float:
    """Solve a frame in place; return its RMS [m]."""
    solve_full(
        pose, target, here, tree, k, rest, anchor, numbers[0], iterations, numbers[1]
    )
    return rms(here, k)


@jit
def follow(
    start: int,
    way: int,
    moves: Bools,
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    numbers: tuple[float, float, float],
    iterations: int,
    noise: float,
    poses: Floats,
    residual: Floats,
    opened: Bools,
    path: Floats,
    found: Floats,
) -> tuple[int, float]:
    """Follow the posture of a frame into its neighbours until it meets theirs.

    Parameters
    ----------
    start : frame to start from; way : 1 forwards, -1 backwards.
    moves : (D,) hinges that are looked into.
    noise : [m] per axis.
    path, found : (REACH, 7 + D), (REACH,) [m] poses and their RMS, overwritten.

    Returns
    -------
    How many frames differ, 0 if none or if the ways do not meet, and by how much this
    way is better.
    """
    here, rest = np.zeros(weight.shape[0]), np.zeros(moves.shape[0])
    anchor, last = np.zeros(moves.shape[0]), poses[start].copy()
    attempt, better = np.zeros(poses.shape[1]), 0.0
    for i in range(REACH):
        t = start + way * (i + 1)
        if t < 0 or t >= poses.shape[0]:
            return i, better
        count, _ = look(targets[t], weight, here)
        if count < 3:
            return 0, 0.0
        attempt[:] = poses[t]
        for d in range(moves.shape[0]):
            if moves[d]:
                if opened[t, d]:
                    return i, better
                attempt[7 + d] = last[7 + d]
        found[i] = solved_anew(
            attempt, targets[t], here, tree, k, rest, anchor, numbers, iterations
        )
        apart = np.max(np.abs(attempt[7:] - poses[t, 7:]))
        better += strain(poses[t - way], poses[t]) - strain(last, attempt)
        if apart < MERGED:
            return i, better
        better += count * (residual[t] ** 2 - found[i] ** 2) / noise**2
        if better < -HOPELESS:
            break
        path[i] = attempt
        last[:] = attempt
    return 0, 0.0


@jit
def soften(
    t: int,
    moves: Bools,
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    numbers: tuple[float, float, float],
    iterations: int,
    noise: float,
    poses: Floats,
    residual: Floats,
    opened: Bools,
) -> None:
    """Fit a frame again, between its neighbours, and keep that if it is better."""
    if t < 1 or t + 1 >= poses.shape[0]:
        return
    here, rest = np.zeros(weight.shape[0]), np.zeros(moves.shape[0])
    anchor, attempt = np.zeros(moves.shape[0]), poses[t].copy()
    count, _ = look(targets[t], weight, here)
    if count < 3:
        return
    for d in range(moves.shape[0]):
        if moves[d]:
            if opened[t, d]:
                return
            rest[d] = 0.5 * (poses[t - 1, 7 + d] + poses[t + 1, 7 + d])
            attempt[7 + d] = rest[d]
            anchor[d] = 2.0 * (noise / JUMP_STEP) ** 2
    found = solved_anew(
        attempt, targets[t], here, tree, k, rest, anchor, numbers, iterations
    )
    before = strain(poses[t - 1], poses[t]) + strain(poses[t], poses[t + 1])
    after = strain(poses[t - 1], attempt) + strain(attempt, poses[t + 1])
    if found < NEAR * residual[t] and after < before:
        poses[t], residual[t] = attempt, found


@jit
def bridge(
    start: int,
    stop: int,
    moves: Bools,
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    numbers: tuple[float, float, float],
    iterations: int,
    noise: float,
    poses: Floats,
    residual: Floats,
    path: Floats,
    found: Floats,
) -> None:
    """Lead open hinges from the frame before ``start`` straight to that at ``stop``.

    If that is better, it is kept. The markers in sight still pull, as far as they do.
    """
    here, rest = np.zeros(weight.shape[0]), np.zeros(moves.shape[0])
    anchor, better = np.zeros(moves.shape[0]), 0.0
    for t in range(start, stop):
        count, _ = look(targets[t], weight, here)
        attempt, share = path[t - start], (t - start + 1.0) / (stop - start + 1.0)
        attempt[:] = poses[t]
        for d in range(moves.shape[0]):
            if moves[d]:
                ends = poses[start - 1, 7 + d], poses[stop, 7 + d]
                rest[d] = (1.0 - share) * ends[0] + share * ends[1]
                attempt[7 + d] = rest[d]
                anchor[d] = (numbers[2] / LOOSE) ** 2
        if count < 3:
            return
        found[t - start] = solved_anew(
            attempt, targets[t], here, tree, k, rest, anchor, numbers, iterations
        )
        last = poses[t - 1] if t == start else path[t - start - 1]
        better += strain(poses[t - 1], poses[t]) - strain(last, attempt)
        better += count * (residual[t] ** 2 - found[t - start] ** 2) / noise**2
    better += strain(poses[stop - 1], poses[stop])
    if better > strain(path[stop - start - 1], poses[stop]):
        poses[start:stop] = path[: stop - start]
        residual[start:stop] = found[: stop - start]


@jit
def mend_open(
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    limb: Ints,
    numbers: tuple[float, float, float],
    iterations: int,
    noise: float,
    poses: Floats,
    residual: Floats,
    opened: Bools,
) -> None:
    """Bridge fingers that are open for a while and jump when they no longer are."""
    hinges = limb.shape[0]
    moves = np.zeros(hinges, dtype=np.bool_)
    path, found = np.zeros((REACH, poses.shape[1])), np.zeros(REACH)
    for first in range(hinges):
        if limb[first] != first:
            continue
        for d in range(hinges):
            moves[d] = limb[d] == first
        start = 0
        for t in range(poses.shape[0]):
            if is_any(moves, opened[t]):
                continue
            if 0 < start < t and t - start <= REACH:
                jump = 0.0
                for s in (start, t):
                    for d in range(hinges):
                        if moves[d]:
                            step = abs(poses[s, 7 + d] - poses[s - 1, 7 + d])
                            jump = max(jump, step)
                if jump > JUMP:
                    bridge(
                        start, t, moves, targets, weight, tree, k, numbers, iterations,
                        noise, poses, residual, path, found,
                    )  # fmt: skip
            start = t + 1


@jit
def mend(
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    limb: Ints,
    numbers: tuple[float, float, float],
    iterations: int,
    noise: float,
    poses: Floats,
    residual: Floats,
    opened: Bools,
) -> None:
    """Take jumps out of a solved take, in place.

    Parameters
    ----------
    limb : (D,) number of the limb each hinge belongs to.
    numbers : damping, enough_m, prior_m.
    noise : [m] of the markers per axis.
    poses : (T, 7 + D), residual : (T,) [m], opened : (T, D) as `solve_frames` leaves
        them.
    """
    hinges, size = limb.shape[0], poses.shape[1]
    moves = np.zeros(hinges, dtype=np.bool_)
    paths, founds = np.zeros((2, REACH, size)), np.zeros((2, REACH))
    for t in range(1, poses.shape[0]):
        moves[:] = False
        for d in range(hinges):
            jump = abs(poses[t, 7 + d] - poses[t - 1, 7 + d]) > JUMP
            if jump and not opened[t, d] and not opened[t - 1, d]:
                for e in range(hinges):
                    moves[e] = moves[e] or limb[e] == limb[d]
        if not moves.any():
            continue
        best, way, frames = 0.0, 0, 0
        for n in range(2):
            count, better = follow(
                t - 1 + n, 1 - 2 * n, moves, targets, weight, tree, k, numbers,
                iterations, noise, poses, residual, opened, paths[n], founds[n],
            )  # fmt: skip
            if count > 0 and better > best:
                best, way, frames = better, n, count
        for i in range(frames):
            s = t + i if way == 0 else t - 1 - i
            poses[s], residual[s] = paths[way, i], founds[way, i]
        if frames == 0:
            for s in (t - 1, t):
                soften(
                    s, moves, targets, weight, tree, k, numbers, iterations, noise,
                    poses, residual, opened,
                )  # fmt: skip
    mend_open(
        targets, weight, tree, k, limb, numbers, iterations, noise, poses, residual,
        opened,
    )  # fmt: skip
