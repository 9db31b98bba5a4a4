"""Frame-by-frame inverse kinematics of a whole take, compiled.

Each frame starts where the last update points to (Maycock 2015 section III-B). Where
the markers leave a finger open, the layered scheme of Schroeder 2016 section 3.2
comes first: alpha in the posture subspace, then the full posture from there. Where
they decide everything, both end in the same optimum, and the layer is left out. While
refining, open fingers are held to the subspace's posture (without a prior: to the last
frame's) with the weight that prior keeps, so that noise does not drive joints without
markers.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.kernels.align import align
from handclean.kernels.gauss_newton import (
    ALL_DECIDED,
    ROOT_OPEN,
    Anchor,
    Chain,
    Observations,
    Openness,
    PoseFit,
    StepControl,
    Subspace,
    Workspace,
    find_open_hinges,
    misfit,
    nearest_alpha,
    solve_full,
    solve_subspace,
)

SUBSPACE_RESIDUAL_SD_RAD = 0.5
"""[rad] how far a joint is from what the subspace says, one sd. Chosen."""

VELOCITY_GAIN = 0.3
"""Share of the last update in the velocity; the whole of it would carry its noise.
Chosen."""

MAX_OPEN_STEP_RAD = 0.1
"""[rad] how far an open hinge follows the subspace's posture in one frame. Chosen."""

RESTART_RMS_RATIO = 0.98
"""The RMS of another start over that of the solved frame, at most, for it to be taken.
Chosen."""

HINGE_STEP_SD_RAD = 0.1
"""[rad] motion of a joint from frame to frame, one sd. Chosen."""

MAX_STEP_COST = 9.0
"""What a jump of a joint costs at most, in squared sd of the markers' noise. Chosen."""

RESTART_WAIT_FRAMES = 10
"""[frames] between two restarts where single frames fit poorly. Chosen."""

POOR_RESTART_WAIT_FRAMES = 100
"""[frames] between two restarts where all frames fit poorly. Chosen."""

ODD_RMS_RATIO = 1.5
"""RMS of a frame over the usual one, from which on (and ``restart_m`` more) it is
solved from other starts. Chosen."""

POOR_RMS_RATIO = 1.1
"""The usual RMS over the lowest there was, from which on all frames count as poor.
Chosen."""

USUAL_RMS_GAIN = 0.05
"""Share of a frame's RMS in the running mean. Chosen."""

RESTART_ITERATIONS = 40
"""Gauss-Newton steps from another start, at most. Chosen: twice the default."""

MIN_MARKERS = 3
"""Markers in sight without which a frame keeps the pose before it: three points are
what a root needs."""


class PoseProblem(NamedTuple):
    """What is the same in all frames of a take.

    tree: the hand with its markers; subspace: the posture prior, K = 0 for standard
    inverse kinematics; control: of the steps; lever_m: see `find_open_hinges`.
    """

    tree: Chain
    subspace: Subspace
    control: StepControl
    lever_m: float


class TakeMarkers(NamedTuple):
    """The markers of a take: targets (T, M, 3) [m], NaN where missing; weight (M,)."""

    targets: Floats
    weight: Floats


class TakeFit(NamedTuple):
    """What is found for each frame of a take.

    poses (T, 7 + D); residual (T,) [m] RMS over the markers in sight, NaN where there
    are too few; opened (T, D) hinges that the markers leave open; decided (T,) whether
    they decide the root, or, after `decide`, whether they and a prior decide the
    posture; steps (T,) Gauss-Newton steps taken.
    """

    poses: Floats
    residual: Floats
    opened: Bools
    decided: Bools
    steps: Ints


class InSight(NamedTuple):
    """How many markers a frame has, and whether they are those of the frame before."""

    markers: int
    unchanged: bool


def empty_fit(frames: int, hinges: int) -> TakeFit:
    """Room for the frames of a take."""
    return TakeFit(
        poses=np.zeros((frames, 7 + hinges)),
        residual=np.full(frames, np.nan),
        opened=np.ones((frames, hinges), dtype=bool),
        decided=np.zeros(frames, dtype=bool),
        steps=np.zeros(frames, dtype=np.int64),
    )


@jit
def weigh_markers(target: Floats, weight: Floats, out: Floats) -> InSight:
    """Write the weights of the markers in sight, 0 for the others.

    Parameters
    ----------
    target : (M, 3) [m], NaN where missing; weight : (M,)
    out : (M,) weights of the frame before, overwritten.
    """
    count, unchanged = 0, True
    for m in range(weight.shape[0]):
        x = target[m, 0] + target[m, 1] + target[m, 2]
        w = weight[m] if math.isfinite(x) else 0.0
        unchanged = unchanged and (w > 0.0) == (out[m] > 0.0)
        out[m] = w
        count += 1 if w > 0.0 else 0
    return InSight(count, unchanged)


@jit
def open_hinges_of(
    pose: Floats, seen: Observations, problem: PoseProblem, k: Workspace, out: Bools
) -> Openness:
    """Find what the markers of a frame leave open, see `find_open_hinges`."""
    return find_open_hinges(
        pose, seen, problem.tree, problem.control.damping, problem.lever_m, k, out
    )


@jit
def solve_frame(
    pose: Floats,
    seen: Observations,
    open_now: Openness,
    problem: PoseProblem,
    k: Workspace,
    max_open_step: float,
) -> PoseFit:
    """Solve one frame from ``pose``, in place.

    Where hinges are open, alpha in the subspace comes first, then all angles.

    Parameters
    ----------
    open_now : what the markers leave open.
    max_open_step : [rad] how far open hinges go from the start towards the subspace's
        posture, so that they follow smoothly where that jumps.
    """
    subspace, rest, weight = problem.subspace, k.rest, k.anchor
    if open_now.level > ALL_DECIDED and subspace.basis.shape[1] > 0:
        for d in range(rest.shape[0]):
            rest[d] = pose[7 + d]
        alpha = nearest_alpha(subspace, pose[7:], k)
        solve_subspace(pose, alpha, seen, subspace, problem.tree, problem.control, k)
        for d in range(rest.shape[0]):
            if open_now.hinges[d]:
                way = min(max(pose[7 + d] - rest[d], -max_open_step), max_open_step)
                pose[7 + d] = rest[d] + way
    for d in range(rest.shape[0]):
        rest[d] = pose[7 + d]
        weight[d] = 0.0
        if open_now.hinges[d]:
            weight[d] = (subspace.noise_m / SUBSPACE_RESIDUAL_SD_RAD) ** 2
    return solve_full(
        pose, seen, Anchor(rest, weight), problem.tree, problem.control, k
    )


@jit
def rms(weight: Floats, error: Floats) -> float:
    """[m] root mean square of errors (M, 3), each marker counting once.

    Markers of weight 0 are not there.
    """
    total, count = 0.0, 0
    for m in range(weight.shape[0]):
        if weight[m] > 0.0:
            for n in range(3):
                total += error[m, n] ** 2
            count += 1
    return math.sqrt(total / count)


@jit
def step_cost(one: Floats, two: Floats) -> float:
    """Cost of going from one pose to another in a frame, see `mend`."""
    total = 0.0
    for n in range(7, one.shape[0]):
        step = (two[n] - one[n]) / HINGE_STEP_SD_RAD
        total += min(step * step, MAX_STEP_COST)
    return total


@jit
def multi_start(
    pose: Floats,
    best_m: float,
    starts: Floats,
    seen: Observations,
    problem: PoseProblem,
    k: Workspace,
) -> float:
    """Try several postures, each laid onto the markers; keep the best in ``pose``.

    Parameters
    ----------
    best_m : [m] RMS that a posture must be below to be taken.
    starts : (S, D) [rad] postures to try.

    Returns
    -------
    [m] RMS of the best, ``best_m`` if none is taken.
    """
    control = problem.control
    thorough = PoseProblem(
        problem.tree,
        problem.subspace,
        StepControl(control.damping, control.enough_m, RESTART_ITERATIONS),
        problem.lever_m,
    )
    attempt = np.zeros(pose.shape[0])
    hinges = np.zeros(starts.shape[1], dtype=np.bool_)
    for s in range(starts.shape[0]):
        attempt[:] = 0.0
        attempt[3] = 1.0
        attempt[7:] = starts[s]
        fit = misfit(attempt, seen, problem.tree, k)
        align(fit.point, seen.target, seen.weight, attempt)
        open_now = open_hinges_of(attempt, seen, problem, k, hinges)
        solved = solve_frame(attempt, seen, open_now, thorough, k, math.inf)
        found = rms(seen.weight, solved.error)
        if found < best_m:
            best_m = found
            pose[:] = attempt
    return best_m


@jit
def resolve_backwards(
    end: int, markers: TakeMarkers, problem: PoseProblem, k: Workspace, fit: TakeFit
) -> None:
    """Solve the frames before ``end`` again, backwards from it, while that is better.

    For the frames that a restart at ``end`` shows to have been in a worse optimum.

    Parameters
    ----------
    fit : of all frames up to ``end``, changed.
    """
    pose, here = fit.poses[end].copy(), np.zeros(markers.weight.shape[0])
    hinges = np.zeros(fit.opened.shape[1], dtype=np.bool_)
    for t in range(end - 1, -1, -1):
        if (
            weigh_markers(markers.targets[t], markers.weight, here).markers
            < MIN_MARKERS
        ):
            break
        seen = Observations(markers.targets[t], here)
        open_now = open_hinges_of(pose, seen, problem, k, hinges)
        solved = solve_frame(pose, seen, open_now, problem, k, math.inf)
        found = rms(here, solved.error)
        if not found < RESTART_RMS_RATIO * fit.residual[t]:
            break
        fit.poses[t], fit.residual[t], fit.opened[t] = pose, found, hinges


@jit
def restart(
    t: int,
    pose: Floats,
    starts: Floats,
    seen: Observations,
    markers: TakeMarkers,
    problem: PoseProblem,
    k: Workspace,
    fit: TakeFit,
) -> bool:
    """Solve a frame from other starts, and if that is better, those before it, too.

    Parameters
    ----------
    t : number of the frame; seen : its markers.
    pose : (7 + D,) as solved, with the RMS ``fit.residual[t]``; changed if another is
        better.

    Returns
    -------
    Whether another start is better.
    """
    least = RESTART_RMS_RATIO * fit.residual[t]
    found = multi_start(pose, least, starts, seen, problem, k)
    if not found < least:
        return False
    fit.poses[t], fit.residual[t] = pose, found
    resolve_backwards(t, markers, problem, k, fit)
    return True


@jit
def extrapolate(pose: Floats, velocity: Floats, is_open: Bools) -> None:
    """Move a pose by a velocity (7 + D,) per frame, in place; open hinges stay."""
    norm = 0.0
    for n in range(pose.shape[0]):
        if n < 7 or not is_open[n - 7]:
            pose[n] += velocity[n]
        if 3 <= n < 7:
            norm += pose[n] * pose[n]
    for n in range(3, 7):
        pose[n] /= math.sqrt(norm)


@jit
def solve_frames(
    markers: TakeMarkers,
    problem: PoseProblem,
    starts: Floats,
    restart_m: float,
    k: Workspace,
    fit: TakeFit,
) -> None:
    """Solve every frame of a take.

    Parameters
    ----------
    starts : (S, D) [rad] postures to start from where there is no frame before.
    restart_m : [m] see `SolveConfig`.
    fit : overwritten in full. With fewer than three markers a frame keeps the pose
        before it and is not decided; otherwise it is if markers decide the root.
    """
    size, hinges = fit.poses.shape[1], starts.shape[1]
    pose, velocity, last = np.zeros(size), np.zeros(size), np.zeros(size)
    here, is_open = np.zeros(markers.weight.shape[0]), np.ones(hinges, dtype=np.bool_)
    open_now = Openness(ROOT_OPEN, is_open)
    started, usual, lowest, soon, later = False, 0.0, math.inf, 0, 0
    pose[3] = 1.0
    pose[7:] = problem.subspace.mean
    for t in range(markers.targets.shape[0]):
        in_sight = weigh_markers(markers.targets[t], markers.weight, here)
        seen = Observations(markers.targets[t], here)
        fit.residual[t], fit.steps[t] = math.nan, 0
        if in_sight.markers < MIN_MARKERS:
            velocity[:] = 0.0
            is_open[:] = True
            open_now = Openness(ROOT_OPEN, is_open)
        elif not started:
            usual = multi_start(pose, math.inf, starts, seen, problem, k)
            open_now = open_hinges_of(pose, seen, problem, k, is_open)
            started, fit.residual[t] = True, usual
        else:
            if not in_sight.unchanged or open_now.level == ROOT_OPEN:
                open_now = open_hinges_of(pose, seen, problem, k, is_open)
            last[:] = pose
            extrapolate(pose, velocity, is_open)
            solved = solve_frame(pose, seen, open_now, problem, k, MAX_OPEN_STEP_RAD)
            fit.steps[t], fit.residual[t] = solved.steps, rms(here, solved.error)
            odd = t >= soon and fit.residual[t] > ODD_RMS_RATIO * usual + restart_m
            poor = t >= later and usual > POOR_RMS_RATIO * lowest
            if odd or poor:
                soon, later = t + RESTART_WAIT_FRAMES, t + POOR_RESTART_WAIT_FRAMES
                if restart(t, pose, starts, seen, markers, problem, k, fit):
                    last[:] = pose
                    velocity[:] = 0.0
                open_now = open_hinges_of(pose, seen, problem, k, is_open)
            most = ODD_RMS_RATIO * usual + restart_m
            usual += USUAL_RMS_GAIN * (min(fit.residual[t], most) - usual)
            lowest = min(lowest, usual)
            for n in range(size):
                velocity[n] += VELOCITY_GAIN * (pose[n] - last[n] - velocity[n])
        fit.poses[t] = pose
        fit.opened[t] = is_open
        fit.decided[t] = in_sight.markers >= MIN_MARKERS and open_now.level < ROOT_OPEN
