"""Postures that markers leave partly open, moved to the likeliest; compiled.

A frame-by-frame solve leaves hinges that few markers see anywhere among the postures
that fit. With noise s on the markers and the prior's mean m and precision P of the
angles q (see `decide`), the likeliest posture has the least ::

    E = sum_m w_m |t_m - p_m|^2 / s^2 + (q - m)^T P (q - m)

Gauss-Newton steps go there. They are
``C (J^T W e / s^2 + [0 P (m - q)])``, with ``C = (J^T W J / s^2 + [0 P])^-1`` the
covariance that `decide` asks about.

E has several valleys: elbow up, elbow down. So the steps start thrice, from the
solver's posture, from the prior's mean and from the frame before; of what they find,
the way through the take is kept that has the least sum of E and of `frames.strain` from
frame to frame, what `mend` asks of jumps (Viterbi). Where it still jumps, for a marker
comes or goes, the frames around are drawn together: they descend E and the squared
steps of hinges to both neighbours, over `JUMP_STEP`, one sd, in turn.

Frames whose markers decide everything, `UNIQUE` of them on each limb, are left as they
are, to the bit. The n-th frame from one is held to the solver's posture, which comes
from there, as well: each hinge with n times `DRIFT`, one sd.
"""

import math

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.ik.frames import JUMP_STEP, look, rms, strain
from handclean.kernels import jit
from handclean.kernels.cholesky import backward, factor
from handclean.kernels.gauss_newton import (
    HELD,
    Chain,
    Work,
    advance,
    information,
    misfit,
    pull,
)

DRIFT = 0.02
"""[rad] by which a hinge strays from what the solver makes of it, one sd, for each
frame to the nearest one that markers decide. With gaps of 5 to 60 frames in the fingers
of simulated takes, angles are off by 1.23 degrees on average (26 markers; 1.28 without
this pass) and 3.37 (13; 4.66); with 0.005 by 1.24 and 4.15, with 0.04 1.27 and 3.09."""

FARTHEST = 0.5
"""[rad] that a hinge moves in one step."""

SETTLED = 0.01
"""[rad] largest step of a hinge that ends the search."""

STEPS = 20
"""Steps at most."""

BLOCK = 1000
"""[frames] of a way at most; the next goes on from where it ends."""

WORSE = 1.05, 2e-4
"""Share, and [m], by which the markers' RMS may grow; else the solver's stays."""

UNIQUE = 3
"""Markers in sight on a limb, from which on it has one posture that fits. With two
there is an elbow up and an elbow down. Simulated takes with dfki13's markers, two on
each finger: angles are off by 1.4 degrees on average, by 2.8 if they are left as they
are where no hinge is open, and by 3.8 without this pass."""

APART = 0.15
"""[rad] from one frame to the next that draws the frames around together."""

AROUND, SWEEPS = 12, 3
"""[frames] on each side of such a place; how often, forwards and backwards."""


@jit
def improbability(
    pose: Floats,
    target: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    precision: Floats,
    noise: float,
) -> float:
    """Return E of a pose (7 + D,); fills points and errors as `misfit` does."""
    total = misfit(pose, target, weight, tree, k) / (noise * noise)
    for d in range(mean.shape[0]):
        row = 0.0
        for e in range(mean.shape[0]):
            row += precision[d, e] * (pose[7 + e] - mean[e])
        total += row * (pose[7 + d] - mean[d])
    return total


@jit
def uphill(
    pose: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    precision: Floats,
    noise: float,
) -> None:
    """Write half of E's negative gradient, after `improbability`, to ``k.gradient``."""
    pull(weight, tree, k)
    for n in range(k.gradient.shape[0]):
        k.gradient[n] /= noise * noise
    for d in range(mean.shape[0]):
        for e in range(mean.shape[0]):
            k.gradient[6 + d] += precision[d, e] * (mean[e] - pose[7 + e])


@jit
def step_within(
    pose: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    precision: Floats,
    noise: float,
    bounds: Floats,
    matrix: Floats,
) -> bool:
    """Write the step from ``k.gradient`` to ``k.step``; return whether there is one.

    A hinge that the step would take beyond its bounds is taken to them instead, and the
    others, knowing that, are solved for again.

    Parameters
    ----------
    bounds : (D, 2) [rad]; matrix : (6 + D, 6 + D) room.
    """
    k.stop[:] = math.nan
    for d in range(bounds.shape[0]):
        q, g = pose[7 + d], k.gradient[6 + d]
        if (q <= bounds[d, 0] and g < 0.0) or (q >= bounds[d, 1] and g > 0.0):
            k.stop[d] = 0.0
    for _ in range(4):
        information(weight, tree, k, precision, noise, matrix)
        for n in range(k.step.shape[0]):
            k.step[n] = k.gradient[n]
        for d in range(bounds.shape[0]):
            if not math.isnan(k.stop[d]):
                matrix[6 + d, 6 + d] += HELD
                k.step[6 + d] = HELD * k.stop[d]
        if not factor(matrix):
            return False
        for a in range(k.step.shape[0]):
            for n in range(a):
                k.step[a] -= matrix[a, n] * k.step[n]
            k.step[a] /= matrix[a, a]
        backward(matrix, k.step)
        found = False
        for d in range(bounds.shape[0]):
            q, to = pose[7 + d], pose[7 + d] + k.step[6 + d]
            out = not bounds[d, 0] <= to <= bounds[d, 1]
            if math.isnan(k.stop[d]) and out:
                k.stop[d] = (bounds[d, 0] if to < q else bounds[d, 1]) - q
                found = True
        if not found:
            break
    return True


@jit
def climb(
    pose: Floats,
    target: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    precision: Floats,
    noise: float,
    bounds: Floats,
    matrix: Floats,
) -> float:
    """Move a pose to where E is least, within bounds (D, 2), in place; return E.

    E does not grow. ``k`` holds points and errors of the result.
    """
    cost = improbability(pose, target, weight, tree, k, mean, precision, noise)
    for _ in range(STEPS):
        uphill(pose, weight, tree, k, mean, precision, noise)
        if not step_within(pose, weight, tree, k, precision, noise, bounds, matrix):
            return cost
        longest = 0.0
        for d in range(bounds.shape[0]):
            longest = max(longest, abs(k.step[6 + d]))
        scale = min(1.0, FARTHEST / max(longest, 1e-12))
        while True:
            advance(pose, scale, tree, k, k.trial)
            after = improbability(
                k.trial, target, weight, tree, k, mean, precision, noise
            )
            if after <= cost:
                break
            scale *= 0.5
            if scale * longest < 0.1 * SETTLED:
                misfit(pose, target, weight, tree, k)
                return cost
        for n in range(pose.shape[0]):
            pose[n] = k.trial[n]
        cost = after
        if longest < SETTLED:
            return cost
    return cost


@jit
def distances(stays: Bools) -> Ints:
    """(T,) [frames] to the nearest frame that stays, T if there is none."""
    frames = stays.shape[0]
    out = np.full(frames, frames)
    for t in range(frames):
        out[t] = 0 if stays[t] else frames if t == 0 else min(out[t - 1] + 1, frames)
    for t in range(frames - 2, -1, -1):
        out[t] = min(out[t], out[t + 1] + 1)
    return out


@jit
def pulled(
    angles: Floats,
    anchor: float,
    mean: Floats,
    precision: Floats,
    values: Floats,
    vectors: Floats,
    rest: Floats,
    tight: Floats,
) -> None:
    """Write the mean and precision of a prior times one about some angles.

    Parameters
    ----------
    angles : (D,) [rad]; anchor : [1/rad^2] precision of each about them.
    values, vectors : (D,), (D, D) eigenvalues and -vectors of ``precision``.
    rest, tight : (D,) [rad], (D, D) [1/rad^2] overwritten.
    """
    rest[:] = mean
    tight[:] = precision
    if anchor == 0.0:
        return
    for a in range(values.shape[0]):
        along = 0.0
        for d in range(values.shape[0]):
            along += vectors[d, a] * (angles[d] - mean[d])
        along *= anchor / (anchor + values[a])
        for d in range(values.shape[0]):
            rest[d] += vectors[d, a] * along
        tight[a, a] += anchor


@jit
def propose(
    before: Floats,
    pose: Floats,
    residual: float,
    allowed: float,
    target: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    precision: Floats,
    noise: float,
    matrix: Floats,
    tried: Floats,
    cost: Floats,
    found: Floats,
) -> None:
    """Write what is found for a frame from three starts.

    Parameters
    ----------
    before : (7 + D,) what the frame before has; pose : (7 + D,) what the solver has.
    residual : [m] of the solver's; allowed : [m] largest.
    matrix : (6 + D, 6 + D) room.
    tried : (3, 7 + D), cost : (3,) E, found : (3,) [m] RMS; overwritten. What fits the
        markers worse than it may costs infinitely much; the first is then the solver's.
    """
    for n in range(3):
        tried[n] = before if n == 2 else pose
        for d in range(mean.shape[0]):
            q = mean[d] if n == 1 else tried[n, 7 + d]
            tried[n, 7 + d] = min(max(q, tree.limits[d, 0]), tree.limits[d, 1])
        cost[n] = climb(
            tried[n], target, weight, tree, k, mean, precision, noise, tree.limits,
            matrix,
        )  # fmt: skip
        found[n] = rms(weight, k)
        if found[n] > allowed:
            cost[n] = math.inf
            if n == 0:
                tried[0], found[0] = pose, residual
                cost[0] = improbability(
                    pose, target, weight, tree, k, mean, precision, noise
                )


@jit
def lead_through(
    start: int,
    tied: bool,
    stays: Bools,
    anchors: Floats,
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    precision: Floats,
    values: Floats,
    vectors: Floats,
    noise: float,
    allowed: Floats,
    poses: Floats,
    residual: Floats,
) -> int:
    """Find the least improbable way through the frames from ``start`` on, in place.

    Parameters
    ----------
    tied : whether the way goes on from the frame before ``start``.
    stays : (T,) frames that are left alone.
    anchors : (T,) [1/rad^2] that hold to the solver's angles.
    values, vectors : see `pulled`.
    allowed : (T,) [m] largest RMS.

    Returns
    -------
    How many frames it has, at most `BLOCK`: up to one that is left alone, or has fewer
    than three markers.
    """
    size, hinges = poses.shape[1], mean.shape[0]
    tried, found = np.zeros((BLOCK, 3, size)), np.zeros((BLOCK, 3))
    origin, total = np.zeros((BLOCK, 3), dtype=np.int64), np.zeros(3)
    rest, tight = np.zeros(hinges), np.zeros((hinges, hinges))
    matrix = np.zeros((6 + hinges, 6 + hinges))
    cost, here, frames, best = np.zeros(3), np.zeros(weight.shape[0]), 0, 0
    for i in range(min(BLOCK, poses.shape[0] - start)):
        t = start + i
        count, _ = look(targets[t], weight, here)
        if stays[t] or count < 3:
            break
        before = tried[i - 1, best] if i > 0 else poses[t - 1] if tied else poses[t]
        pulled(poses[t, 7:], anchors[t], mean, precision, values, vectors, rest, tight)
        propose(
            before, poses[t], residual[t], allowed[t], targets[t], here, tree, k, rest,
            tight, noise, matrix, tried[i], cost, found[i],
        )  # fmt: skip
        for n in range(3):
            if i == 0:
                cost[n] += strain(poses[t - 1], tried[i, n]) if tied else 0.0
                continue
            least = math.inf
            for m in range(3):
                way = total[m] + strain(tried[i - 1, m], tried[i, n])
                if way < least:
                    least, origin[i, n] = way, m
            cost[n] += least
        total[:] = cost
        best = int(np.argmin(total))
        frames = i + 1
    end = start + frames
    if end < poses.shape[0] and stays[end]:
        for n in range(3):
            total[n] += strain(tried[frames - 1, n], poses[end])
        best = int(np.argmin(total))
    for i in range(frames - 1, -1, -1):
        poses[start + i], residual[start + i] = tried[i, best], found[i, best]
        best = int(origin[i, best])
    return frames


@jit
def draw_together(
    stays: Bools,
    anchors: Floats,
    solved: Floats,
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    precision: Floats,
    values: Floats,
    vectors: Floats,
    noise: float,
    allowed: Floats,
    poses: Floats,
    residual: Floats,
) -> None:
    """Let hinges of neighbouring frames pull at each other where they are far apart.

    Parameters
    ----------
    stays : (T,) frames that are left alone; allowed : (T,) [m] largest RMS.
    anchors, solved : (T,) [1/rad^2], (T, 7 + D) what holds to the solver's angles.
    values, vectors : see `pulled`.
    poses : (T, 7 + D), residual : (T,) [m], changed.
    """
    frames, hinges = poses.shape[0], mean.shape[0]
    moves = np.zeros(frames, dtype=np.bool_)
    for t in range(1, frames):
        for d in range(hinges):
            if abs(poses[t, 7 + d] - poses[t - 1, 7 + d]) > APART:
                moves[max(t - AROUND, 0) : t + AROUND] = True
    for t in range(frames):
        moves[t] = moves[t] and not stays[t] and math.isfinite(residual[t])
    if not moves.any():
        return
    tie = 2.0 / JUMP_STEP**2
    middle, tight = np.zeros(hinges), np.zeros((hinges, hinges))
    here, pose, rest = np.zeros(weight.shape[0]), poses[0].copy(), np.zeros(hinges)
    matrix = np.zeros((6 + hinges, 6 + hinges))
    for sweep in range(2 * SWEEPS):
        for i in range(frames):
            t = i if sweep % 2 == 0 else frames - 1 - i
            if not moves[t]:
                continue
            look(targets[t], weight, here)
            one, two = max(t - 1, 0), min(t + 1, frames - 1)
            one = one if math.isfinite(residual[one]) else t
            two = two if math.isfinite(residual[two]) else t
            anchor = tie + anchors[t]
            for d in range(hinges):
                middle[d] = 0.5 * tie * (poses[one, 7 + d] + poses[two, 7 + d])
                middle[d] += anchors[t] * solved[t, 7 + d]
                middle[d] /= anchor
            pulled(middle, anchor, mean, precision, values, vectors, rest, tight)
            pose[:] = poses[t]
            climb(
                pose, targets[t], here, tree, k, rest, tight, noise, tree.limits, matrix
            )
            found = rms(here, k)
            if found <= allowed[t]:
                poses[t], residual[t] = pose, found


@jit
def no_elbows(target: Floats, tree: Chain, limb: Ints) -> bool:
    """Whether each limb has `UNIQUE` markers in sight."""
    for first in range(limb.shape[0]):
        count = 0
        for m in range(target.shape[0]):
            of = tree.link[m] - 1
            if of >= 0 and limb[of] == first and math.isfinite(target[m, 0]):
                count += 1
        if limb[first] == first and count < UNIQUE:
            return False
    return True


@jit
def make_likeliest(
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    precision: Floats,
    noise: float,
    poses: Floats,
    residual: Floats,
    opened: Bools,
    sure: Bools,
    limb: Ints,
) -> None:
    """Move postures that markers leave partly open to the likeliest ones, in place.

    Parameters
    ----------
    targets : (T, M, 3) [m], NaN where missing; weight : (M,).
    mean, precision : (D,) [rad], (D, D) [1/rad^2] of the angles under the prior.
    noise : [m] of the markers per axis.
    poses : (T, 7 + D), residual : (T,) [m] changed; opened : (T, D)
    sure : (T,) whether the markers decide the root.
    limb : (D,) number of the limb each hinge belongs to.
    """
    frames = poses.shape[0]
    stays = np.zeros(frames, dtype=np.bool_)
    for t in range(frames):
        stays[t] = sure[t] and not opened[t].any() and no_elbows(targets[t], tree, limb)
    if stays.all():
        return
    allowed = WORSE[0] * residual + WORSE[1]
    away, t = distances(stays), 0
    anchors = np.zeros(frames)
    if stays.any():
        anchors[:] = 1.0 / (DRIFT * np.maximum(away, 1)) ** 2
    values, vectors = np.linalg.eigh(precision)
    solved = poses.copy()
    while t < frames:
        if stays[t]:
            t += 1
            continue
        tied = t > 0 and math.isfinite(residual[t - 1])
        done = lead_through(
            t, tied, stays, anchors, targets, weight, tree, k, mean, precision, values,
            vectors, noise, allowed, poses, residual,
        )  # fmt: skip
        if done == 0 and t > 0 and not stays[t - 1]:
            poses[t] = poses[t - 1]
        t += max(done, 1)
    draw_together(
        stays, anchors, solved, targets, weight, tree, k, mean, precision, values,
        vectors, noise, allowed, poses, residual,
    )  # fmt: skip
