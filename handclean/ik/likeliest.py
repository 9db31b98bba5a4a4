"""Postures that markers leave partly open, moved to the likeliest; compiled.

A frame-by-frame solve leaves hinges that few markers see anywhere among the postures
that fit. With noise s on the markers and the prior's mean m and precision P of the
angles q (see `decide`), the likeliest posture (maximum a posteriori, MAP) has the least

    E = sum_m w_m |t_m - p_m|^2 / s^2 + (q - m)^T P (q - m)

which is twice the negative logarithm of the posterior, up to a constant. Gauss-Newton
steps go there. They are ``C (J^T W e / s^2 + [0 P (m - q)])``, with
``C = (J^T W J / s^2 + [0 P])^-1`` the covariance that `decide` asks about.

E has several minima: elbow up, elbow down. So the steps start thrice, from the
solver's posture, from the prior's mean and from the frame before; of what they find,
the path through the take is kept that has the least sum of E and of `frames.step_cost`
from frame to frame, the cost of jumps in `mend` (Viterbi). Where it still jumps, for a
marker comes or goes, the frames around are smoothed: they minimise E and the squared
steps of hinges to both neighbours, over `HINGE_STEP_SD_RAD`, one sd, in turn.

Frames whose markers decide everything, `MIN_LIMB_MARKERS` of them on each limb, are
left as they are, to the bit. The n-th frame from one is held to the solver's posture,
which comes from there, as well: each hinge with n times `DRIFT_SD_RAD`, one sd.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.ik.frames import (
    HINGE_STEP_SD_RAD,
    MIN_MARKERS,
    TakeFit,
    TakeMarkers,
    rms,
    step_cost,
    weigh_markers,
)
from handclean.kernels import jit
from handclean.kernels.gauss_newton import (
    HELD_PRECISION,
    AnglePrior,
    Chain,
    MarkerFit,
    Observations,
    Workspace,
    advance,
    information,
    misfit,
    right_hand_side,
    stop_at_limits,
)
from handclean.kernels.linalg import solve

DRIFT_SD_RAD = 0.02
"""[rad] by which a hinge is off from what the solver makes of it, one sd, for each
frame to the nearest one that markers decide. With gaps of 5 to 60 frames in the fingers
of simulated takes, angles are off by 1.23 degrees on average (26 markers; 1.28 without
this pass) and 3.37 (13; 4.66); with 0.005 by 1.24 and 4.15, with 0.04 1.27 and 3.09."""

MAX_STEP_RAD = 0.5
"""[rad] that a hinge moves in one step at most. Chosen."""

CONVERGED_STEP_RAD = 0.01
"""[rad] largest step of a hinge that ends the search. Chosen."""

MAX_STEPS = 20
"""Steps at most. Chosen."""

BLOCK_FRAMES = 1000
"""[frames] of a path at most; the next goes on from where it ends. Chosen: bounds the
memory."""

MAX_RMS_RATIO = 1.05
"""The markers' RMS over the solver's, at most (and `MAX_RMS_EXTRA_M` more); else the
solver's posture stays. Chosen."""

MAX_RMS_EXTRA_M = 2e-4
"""[m] see `MAX_RMS_RATIO`. Chosen."""

MIN_LIMB_MARKERS = 3
"""Markers in sight on a limb, from which on it has one posture that fits. With two
there is an elbow up and an elbow down. Simulated takes with dfki13's markers, two on
each finger: angles are off by 1.4 degrees on average, by 2.8 if they are left as they
are where no hinge is open, and by 3.8 without this pass."""

SMOOTHED_STEP_RAD = 0.15
"""[rad] from one frame to the next, from which on the frames around are smoothed.
Chosen."""

SMOOTHED_WINDOW_FRAMES = 12
"""[frames] on each side of such a place. Chosen."""

SMOOTHING_SWEEPS = 3
"""How often they are smoothed, forwards and backwards. Chosen."""

STARTS = 3
"""Postures to start from: the solver's, the prior's mean, the frame before."""


class Posterior(NamedTuple):
    """E of a pose, and how the pose fits the markers."""

    cost: float
    fit: MarkerFit


class BoundedStep(NamedTuple):
    """A step (6 + D,) within the limits; none if not ``found``."""

    found: bool
    step: Floats


class MapFit(NamedTuple):
    """The likeliest pose found: its E, and the markers' errors (M, 3) [m]."""

    cost: float
    error: Floats


class Spectrum(NamedTuple):
    """Eigenvalues (D,) and eigenvectors (D, D) of the prior's precision."""

    values: Floats
    vectors: Floats


class SolvedFrame(NamedTuple):
    """What the solver has for a frame: pose (7 + D,), its RMS, and the largest allowed.

    residual_m, allowed_m : [m]
    """

    pose: Floats
    residual_m: float
    allowed_m: float


class Candidates(NamedTuple):
    """Postures for a frame: poses (3, 7 + D), their E (3,) and RMS (3,) [m]."""

    poses: Floats
    cost: Floats
    residual: Floats


class FrameRules(NamedTuple):
    """What holds for each frame of a take.

    stays (T,) frames that are left alone; anchors (T,) [1/rad^2] precision with which
    hinges are held to the solver's angles; allowed (T,) [m] largest RMS.
    """

    stays: Bools
    anchors: Floats
    allowed: Floats


class MapProblem(NamedTuple):
    """What is the same in all frames of a take."""

    markers: TakeMarkers
    tree: Chain
    prior: AnglePrior
    spectrum: Spectrum
    k: Workspace


@jit
def neg_log_posterior(
    pose: Floats, seen: Observations, prior: AnglePrior, tree: Chain, k: Workspace
) -> Posterior:
    """Return E of a pose (7 + D,)."""
    fit = misfit(pose, seen, tree, k)
    total = fit.cost / (prior.noise_m * prior.noise_m)
    mean, precision = prior.mean, prior.precision
    for d in range(mean.shape[0]):
        row = 0.0
        for e in range(mean.shape[0]):
            row += precision[d, e] * (pose[7 + e] - mean[e])
        total += row * (pose[7 + d] - mean[d])
    return Posterior(total, fit)


@jit
def half_descent(
    pose: Floats,
    fit: MarkerFit,
    weight: Floats,
    prior: AnglePrior,
    tree: Chain,
    k: Workspace,
) -> Floats:
    """Return half of E's negative gradient (6 + D,) at a pose."""
    gradient = right_hand_side(fit, weight, tree, k)
    mean, precision = prior.mean, prior.precision
    for n in range(gradient.shape[0]):
        gradient[n] /= prior.noise_m * prior.noise_m
    for d in range(mean.shape[0]):
        for e in range(mean.shape[0]):
            gradient[6 + d] += precision[d, e] * (mean[e] - pose[7 + e])
    return gradient


@jit
def bounded_step(
    pose: Floats,
    fit: MarkerFit,
    weight: Floats,
    prior: AnglePrior,
    tree: Chain,
    k: Workspace,
) -> BoundedStep:
    """Return the Gauss-Newton step of E from a pose, within the limits.

    A hinge that the step would take beyond a limit is taken to it instead, and the
    others, knowing that, are solved for again.
    """
    step, stop, limits = k.step, k.stop, tree.limits
    gradient = half_descent(pose, fit, weight, prior, tree, k)
    stop[:] = math.nan
    for d in range(limits.shape[0]):
        q, g = pose[7 + d], gradient[6 + d]
        if (q <= limits[d, 0] and g < 0.0) or (q >= limits[d, 1] and g > 0.0):
            stop[d] = 0.0
    for _ in range(4):
        matrix = information(fit, weight, prior, tree, k)
        for n in range(step.shape[0]):
            step[n] = gradient[n]
        for d in range(limits.shape[0]):
            if not math.isnan(stop[d]):
                matrix[6 + d, 6 + d] += HELD_PRECISION
                step[6 + d] = HELD_PRECISION * stop[d]
        if not solve(matrix, step):
            return BoundedStep(False, step)
        if not stop_at_limits(pose, step, stop, limits):
            break
    return BoundedStep(True, step)


@jit
def find_map_pose(
    pose: Floats, seen: Observations, prior: AnglePrior, tree: Chain, k: Workspace
) -> MapFit:
    """Move a pose within the limits to a minimum of E, in place; E does not grow."""
    trial = k.trial
    now = neg_log_posterior(pose, seen, prior, tree, k)
    cost, fit = now.cost, now.fit
    for _ in range(MAX_STEPS):
        made = bounded_step(pose, fit, seen.weight, prior, tree, k)
        if not made.found:
            break
        longest = 0.0
        for d in range(tree.limits.shape[0]):
            longest = max(longest, abs(made.step[6 + d]))
        scale = min(1.0, MAX_STEP_RAD / max(longest, 1e-12))
        while True:
            advance(pose, made.step, scale, tree, k, trial)
            now = neg_log_posterior(trial, seen, prior, tree, k)
            if now.cost <= cost:
                break
            scale *= 0.5
            if scale * longest < 0.1 * CONVERGED_STEP_RAD:
                return MapFit(cost, misfit(pose, seen, tree, k).error)
        for n in range(pose.shape[0]):
            pose[n] = trial[n]
        cost, fit = now.cost, now.fit
        if longest < CONVERGED_STEP_RAD:
            break
    return MapFit(cost, fit.error)


@jit
def frames_to_nearest(stays: Bools) -> Ints:
    """(T,) [frames] to the nearest frame that stays, T if there is none."""
    frames = stays.shape[0]
    out = np.full(frames, frames)
    for t in range(frames):
        out[t] = 0 if stays[t] else frames if t == 0 else min(out[t - 1] + 1, frames)
    for t in range(frames - 2, -1, -1):
        out[t] = min(out[t], out[t + 1] + 1)
    return out


@jit
def combine_priors(
    angles: Floats,
    anchor: float,
    prior: AnglePrior,
    spectrum: Spectrum,
    out: AnglePrior,
) -> None:
    """Write the product of a prior and one about some angles.

    Parameters
    ----------
    angles : (D,) [rad]; anchor : [1/rad^2] precision of each about them.
    spectrum : of the prior's precision.
    out : its mean and precision are overwritten.
    """
    values, vectors = spectrum.values, spectrum.vectors
    out.mean[:] = prior.mean
    out.precision[:] = prior.precision
    if anchor == 0.0:
        return
    for a in range(values.shape[0]):
        along = 0.0
        for d in range(values.shape[0]):
            along += vectors[d, a] * (angles[d] - prior.mean[d])
        along *= anchor / (anchor + values[a])
        for d in range(values.shape[0]):
            out.mean[d] += vectors[d, a] * along
        out.precision[a, a] += anchor


@jit
def find_candidates(
    before: Floats,
    solved: SolvedFrame,
    seen: Observations,
    prior: AnglePrior,
    tree: Chain,
    k: Workspace,
    out: Candidates,
) -> None:
    """Write the postures found for a frame from three starts.

    Parameters
    ----------
    before : (7 + D,) pose of the frame before.
    out : overwritten. A posture that fits the markers worse than it may costs
        infinitely much; the first is then the solver's.
    """
    for n in range(STARTS):
        pose = out.poses[n]
        pose[:] = before if n == 2 else solved.pose
        for d in range(tree.limits.shape[0]):
            q = prior.mean[d] if n == 1 else pose[7 + d]
            pose[7 + d] = min(max(q, tree.limits[d, 0]), tree.limits[d, 1])
        found = find_map_pose(pose, seen, prior, tree, k)
        out.cost[n], out.residual[n] = found.cost, rms(seen.weight, found.error)
        if out.residual[n] > solved.allowed_m:
            out.cost[n] = math.inf
            if n == 0:
                pose[:] = solved.pose
                out.residual[0] = solved.residual_m
                out.cost[0] = neg_log_posterior(pose, seen, prior, tree, k).cost


@jit
def add_cheapest_steps(
    total: Floats, before: Floats, after: Floats, cost: Floats, origin: Ints
) -> None:
    """Add the cost of the cheapest path that leads to each candidate of a frame.

    Parameters
    ----------
    total : (3,) cost of the cheapest path to each candidate of the frame before.
    before, after : (3, 7 + D) candidates of that frame and of this one.
    cost : (3,) of the candidates, added to.
    origin : (3,) which candidate before each comes from, overwritten.
    """
    for n in range(STARTS):
        least = math.inf
        for m in range(STARTS):
            way = total[m] + step_cost(before[m], after[n])
            if way < least:
                least, origin[n] = way, m
        cost[n] += least


@jit
def viterbi_path(
    start: int, tied: bool, rules: FrameRules, problem: MapProblem, fit: TakeFit
) -> int:
    """Find the likeliest path through the frames from ``start`` on, in place.

    Parameters
    ----------
    tied : whether the path goes on from the frame before ``start``.
    fit : the solved take, changed.

    Returns
    -------
    How many frames it has, at most `BLOCK_FRAMES`: up to one that is left alone, or has
    fewer than three markers.
    """
    poses, residual, stays = fit.poses, fit.residual, rules.stays
    markers, prior, tree, k = problem.markers, problem.prior, problem.tree, problem.k
    size, hinges = poses.shape[1], prior.mean.shape[0]
    tried = np.zeros((BLOCK_FRAMES, STARTS, size))
    found = np.zeros((BLOCK_FRAMES, STARTS))
    origin = np.zeros((BLOCK_FRAMES, STARTS), dtype=np.int64)
    total, cost = np.zeros(STARTS), np.zeros(STARTS)
    held = AnglePrior(np.zeros(hinges), np.zeros((hinges, hinges)), prior.noise_m)
    here, frames, best = np.zeros(markers.weight.shape[0]), 0, 0
    for i in range(min(BLOCK_FRAMES, poses.shape[0] - start)):
        t = start + i
        count = weigh_markers(markers.targets[t], markers.weight, here).markers
        if stays[t] or count < MIN_MARKERS:
            break
        before = tried[i - 1, best] if i > 0 else poses[t - 1] if tied else poses[t]
        combine_priors(poses[t, 7:], rules.anchors[t], prior, problem.spectrum, held)
        find_candidates(
            before,
            SolvedFrame(poses[t], residual[t], rules.allowed[t]),
            Observations(markers.targets[t], here),
            held,
            tree,
            k,
            Candidates(tried[i], cost, found[i]),
        )
        if i > 0:
            add_cheapest_steps(total, tried[i - 1], tried[i], cost, origin[i])
        elif tied:
            for n in range(STARTS):
                cost[n] += step_cost(poses[t - 1], tried[i, n])
        total[:] = cost
        best = int(np.argmin(total))
        frames = i + 1
    end = start + frames
    if end < poses.shape[0] and stays[end]:
        for n in range(STARTS):
            total[n] += step_cost(tried[frames - 1, n], poses[end])
        best = int(np.argmin(total))
    for i in range(frames - 1, -1, -1):
        poses[start + i], residual[start + i] = tried[i, best], found[i, best]
        best = int(origin[i, best])
    return frames


@jit
def frames_to_smooth(stays: Bools, fit: TakeFit) -> Bools:
    """(T,) frames around steps of more than `SMOOTHED_STEP_RAD`, with a pose."""
    poses, frames = fit.poses, fit.poses.shape[0]
    moves = np.zeros(frames, dtype=np.bool_)
    for t in range(1, frames):
        for n in range(7, poses.shape[1]):
            if abs(poses[t, n] - poses[t - 1, n]) > SMOOTHED_STEP_RAD:
                first = max(t - SMOOTHED_WINDOW_FRAMES, 0)
                moves[first : t + SMOOTHED_WINDOW_FRAMES] = True
    for t in range(frames):
        moves[t] = moves[t] and not stays[t] and math.isfinite(fit.residual[t])
    return moves


@jit
def smooth_neighbours(
    solved: Floats, rules: FrameRules, problem: MapProblem, fit: TakeFit
) -> None:
    """Draw hinges of neighbouring frames together where they are far apart.

    Parameters
    ----------
    solved : (T, 7 + D) the solver's poses, to which ``rules.anchors`` hold.
    fit : changed.
    """
    poses, residual, anchors = fit.poses, fit.residual, rules.anchors
    markers, prior, k = problem.markers, problem.prior, problem.k
    frames, hinges = poses.shape[0], prior.mean.shape[0]
    moves = frames_to_smooth(rules.stays, fit)
    if not moves.any():
        return
    tie = 2.0 / HINGE_STEP_SD_RAD**2
    middle, here = np.zeros(hinges), np.zeros(markers.weight.shape[0])
    held = AnglePrior(np.zeros(hinges), np.zeros((hinges, hinges)), prior.noise_m)
    pose = poses[0].copy()
    for sweep in range(2 * SMOOTHING_SWEEPS):
        for i in range(frames):
            t = i if sweep % 2 == 0 else frames - 1 - i
            if not moves[t]:
                continue
            weigh_markers(markers.targets[t], markers.weight, here)
            one, two = max(t - 1, 0), min(t + 1, frames - 1)
            one = one if math.isfinite(residual[one]) else t
            two = two if math.isfinite(residual[two]) else t
            anchor = tie + anchors[t]
            for d in range(hinges):
                middle[d] = 0.5 * tie * (poses[one, 7 + d] + poses[two, 7 + d])
                middle[d] += anchors[t] * solved[t, 7 + d]
                middle[d] /= anchor
            combine_priors(middle, anchor, prior, problem.spectrum, held)
            pose[:] = poses[t]
            seen = Observations(markers.targets[t], here)
            found = rms(here, find_map_pose(pose, seen, held, problem.tree, k).error)
            if found <= rules.allowed[t]:
                poses[t], residual[t] = pose, found


@jit
def is_unique(target: Floats, tree: Chain, limb: Ints) -> bool:
    """Whether each limb has `MIN_LIMB_MARKERS` markers in sight."""
    for first in range(limb.shape[0]):
        count = 0
        for m in range(target.shape[0]):
            of = tree.link[m] - 1
            if of >= 0 and limb[of] == first and math.isfinite(target[m, 0]):
                count += 1
        if limb[first] == first and count < MIN_LIMB_MARKERS:
            return False
    return True


@jit
def find_map_poses(
    markers: TakeMarkers,
    limb: Ints,
    tree: Chain,
    prior: AnglePrior,
    k: Workspace,
    fit: TakeFit,
) -> None:
    """Move postures that markers leave partly open to the likeliest ones, in place.

    Parameters
    ----------
    limb : (D,) first hinge of the limb each hinge belongs to.
    fit : the solved take, its poses and residuals are changed.
    """
    frames, poses = fit.poses.shape[0], fit.poses
    stays = np.zeros(frames, dtype=np.bool_)
    for t in range(frames):
        whole = fit.decided[t] and not fit.opened[t].any()
        stays[t] = whole and is_unique(markers.targets[t], tree, limb)
    if stays.all():
        return
    anchors = np.zeros(frames)
    if stays.any():
        away = frames_to_nearest(stays)
        anchors[:] = 1.0 / (DRIFT_SD_RAD * np.maximum(away, 1)) ** 2
    allowed = MAX_RMS_RATIO * fit.residual + MAX_RMS_EXTRA_M
    rules = FrameRules(stays, anchors, allowed)
    values, vectors = np.linalg.eigh(prior.precision)
    problem = MapProblem(markers, tree, prior, Spectrum(values, vectors), k)
    solved, t = poses.copy(), 0
    while t < frames:
        if stays[t]:
            t += 1
            continue
        tied = t > 0 and math.isfinite(fit.residual[t - 1])
        done = viterbi_path(t, tied, rules, problem, fit)
        if done == 0 and t > 0 and not stays[t - 1]:
            poses[t] = poses[t - 1]
        t += max(done, 1)
    smooth_neighbours(solved, rules, problem, fit)
