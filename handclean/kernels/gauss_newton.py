"""Gauss-Newton inverse kinematics of a joint tree with point markers, frame by frame.

Minimises the weighted squared distance of markers p_m to targets t_m::

    C = sum_m w_m |t_m - p_m|^2

by steps s that solve (J^T W J + D) s = J^T W e (Maycock 2015 eq. 5, Schroeder 2016
eq. 2; the entries of D are squared weights, since the printed objective's D^T D and
the printed system's D do not agree).

**The normal matrix is an inertia.** J^T W J is the joint-space inertia matrix of point
masses w_m at the markers, so it is computed as robotics computes that one
(Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 6, composite rigid bodies).
Each link carries the mass, first and second moment of its own markers and of all links
beyond it::

    mass = sum w      c = sum w p      A = sum w p p^T

(p from the root's origin, laboratory orientation). Turning hinge d = (a, v) at unit
rate moves them with momentum f and angular momentum n::

    f = a x c + mass v          n = (tr(A) 1 - A) a + c x v

and the entry with any hinge e between d and the root is ``a_e . n + v_e . f``; with
the root's own six columns it is simply (f, n). Likewise the right-hand side is a
wrench: (sum w e, sum w p x e), summed from the fingertips inwards. The cost grows with
markers plus hinges times depth, not with markers times hinges squared.

**It has the sparsity of the tree.** Two hinges on different fingers meet only in the
root. Factorising from the leaves inwards (L^T D L, Featherstone section 6.5) fills in
nothing: a block arrow for a hand, the right thing for any tree.

**Limits.** A hinge that stands at a limit and is pushed outwards is held (its entry of
D is infinite); one that a step would take beyond is taken to the limit, and the step
solved again for the others; near a limit, and moving towards it, D grows as in Chan and
Dubey (1995), whom Schroeder et al. cite for it.

**The subspace** (Schroeder 2016 section 3.2): angles = mean + components alpha, so
that J_PC = J M (eq. 4). alpha counts in standard deviations and is held towards 0 with
the weight of ``noise_m`` metres of marker noise squared, without which the markers of a
reduced set could not decide it.

**Where results are.** Functions return what they find. Arrays they return lie in the
`Workspace` they were given, so they hold until the next call with the same one.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.kernels.chain import place_links
from handclean.kernels.linalg import backward_by_rows, factor, forward_vector
from handclean.kernels.rotations import compose, exponential

HELD_PRECISION = 1e30
"""[m^2/rad^2] What is added to the diagonal for a hinge that must not move. Chosen: so
large that a step times it loses no digit."""

ALL_DECIDED, HINGES_OPEN, ROOT_OPEN = 0, 1, 2
"""What the markers of a frame leave open, see `find_open_hinges`."""


class Chain(NamedTuple):
    """A joint tree with markers, as the kernels want it (see `chain`).

    parent (L,), offset (L, 3), axis (L, 3), link (M,), at (M, 3), limits (D, 2),
    with L = D + 1 links.
    """

    parent: Ints
    offset: Floats
    axis: Floats
    link: Ints
    at: Floats
    limits: Floats


class Observations(NamedTuple):
    """The markers of one frame.

    target (M, 3) [m], anything where the weight is 0; weight (M,), not negative.
    """

    target: Floats
    weight: Floats


class Anchor(NamedTuple):
    """What holds hinges where they are: sum_d weight_d (q_d - rest_d)^2.

    rest (D,) [rad]; weight (D,) [m^2/rad^2], 0 for a hinge that is free.
    """

    rest: Floats
    weight: Floats


class Subspace(NamedTuple):
    """Postures mean + basis alpha.

    mean (D,) [rad]; basis (D, K) [rad], columns one standard deviation long; noise_m
    [m] marker noise that weighs as much as one standard deviation of alpha.
    """

    mean: Floats
    basis: Floats
    noise_m: float


class AnglePrior(NamedTuple):
    """A Gaussian prior of all angles.

    mean (D,) [rad]; precision (D, D) [1/rad^2], symmetric; noise_m [m] of the markers
    per axis, with which they weigh against it.
    """

    mean: Floats
    precision: Floats
    noise_m: float


class StepControl(NamedTuple):
    """How steps are damped, and when they end.

    damping [m^2/rad^2]; enough_m [m] RMS below which a further decrease is not worth a
    step; iterations: steps at most.
    """

    damping: float
    enough_m: float
    iterations: int


class MarkerFit(NamedTuple):
    """How a pose fits the markers of a frame.

    cost: C; point (M, 3) [m] from the root's origin, error (M, 3) [m], both valid where
    the weight is not 0; column (L, 6) of each hinge, see `chain`.
    """

    cost: float
    point: Floats
    error: Floats
    column: Floats


class PoseFit(NamedTuple):
    """A solved pose: the minimised cost, Gauss-Newton steps taken, error (M, 3) [m]."""

    cost: float
    steps: int
    error: Floats


class NewtonStep(NamedTuple):
    """A step (6 + D,), the decrease it promises, and the factors it was solved with."""

    step: Floats
    promise: float
    factors: Floats


class ReducedEquations(NamedTuple):
    """Equations of root and alpha: matrix (6 + K, 6 + K), right (6 + K,)."""

    matrix: Floats
    right: Floats


class Openness(NamedTuple):
    """What markers leave open: `ALL_DECIDED` ... `ROOT_OPEN`, and hinges (D,)."""

    level: int
    hinges: Bools


class Factor(NamedTuple):
    """Cholesky factor, a lower triangle; not to be used if not ``positive``."""

    positive: bool
    lower: Floats


class SpreadLimits(NamedTuple):
    """[rad] largest standard deviations of the root's rotation and of a hinge."""

    root_rad: float
    hinge_rad: float


class Workspace(NamedTuple):
    """Room for the calculations of one frame.

    Nobody reads it but by what a function returns.
    """

    turn: Floats  # (L, 3, 3)
    origin: Floats  # (L, 3)
    column: Floats  # (L, 6)
    point: Floats  # (M, 3)
    error: Floats  # (M, 3)
    moment: Floats  # (L, 10) mass, c, A as xx xy xz yy yz zz
    wrench: Floats  # (L, 6)
    normal: Floats  # (6 + D, 6 + D) lower triangle along the tree
    gradient: Floats  # (6 + D,)
    step: Floats  # (6 + D,)
    trial: Floats  # (7 + D,)
    reduced_matrix: Floats  # (6 + K, 6 + K)
    image: Floats  # (D, K)
    reduced_right: Floats  # (6 + K,)
    reduced_step: Floats  # (6 + K,)
    alpha: Floats  # (K,)
    right: Floats  # (6 + D,) gradient before stops
    stop: Floats  # (D,) [rad] step that ends at a limit, or NaN
    information: Floats  # (6 + D, 6 + D)
    row: Floats  # (6 + D,)
    rest: Floats  # (D,)
    anchor: Floats  # (D,)


def make_workspace(hinges: int, markers: int, directions: int = 0) -> Workspace:
    """Room for trees of ``hinges`` hinges with ``markers`` markers.

    Parameters
    ----------
    directions : K of the posture subspace; it may be more than the tree has hinges.
    """
    links, dofs, small = hinges + 1, hinges + 6, directions + 6
    return Workspace(
        turn=np.zeros((links, 3, 3)),
        origin=np.zeros((links, 3)),
        column=np.zeros((links, 6)),
        point=np.zeros((markers, 3)),
        error=np.zeros((markers, 3)),
        moment=np.zeros((links, 10)),
        wrench=np.zeros((links, 6)),
        normal=np.zeros((dofs, dofs)),
        gradient=np.zeros(dofs),
        step=np.zeros(dofs),
        trial=np.zeros(dofs + 1),
        reduced_matrix=np.zeros((small, small)),
        image=np.zeros((hinges, directions)),
        reduced_right=np.zeros(small),
        reduced_step=np.zeros(small),
        alpha=np.zeros(directions),
        right=np.zeros(dofs),
        stop=np.zeros(hinges),
        information=np.zeros((dofs, dofs)),
        row=np.zeros(dofs),
        rest=np.zeros(hinges),
        anchor=np.zeros(hinges),
    )


@jit
def misfit(pose: Floats, seen: Observations, tree: Chain, k: Workspace) -> MarkerFit:
    """Place the markers and compare them with where they were seen.

    Parameters
    ----------
    pose : (7 + D,)
    """
    target, weight = seen.target, seen.weight
    place_links(pose, tree.parent, tree.offset, tree.axis, k.turn, k.origin, k.column)
    cost = 0.0
    for m in range(target.shape[0]):
        if weight[m] <= 0.0:
            continue
        i = tree.link[m]
        r = k.turn[i]
        x, y, z = tree.at[m, 0], tree.at[m, 1], tree.at[m, 2]
        px = k.origin[i, 0] + r[0, 0] * x + r[0, 1] * y + r[0, 2] * z
        py = k.origin[i, 1] + r[1, 0] * x + r[1, 1] * y + r[1, 2] * z
        pz = k.origin[i, 2] + r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
        ex = target[m, 0] - pose[0] - px
        ey = target[m, 1] - pose[1] - py
        ez = target[m, 2] - pose[2] - pz
        k.point[m, 0], k.point[m, 1], k.point[m, 2] = px, py, pz
        k.error[m, 0], k.error[m, 1], k.error[m, 2] = ex, ey, ez
        cost += weight[m] * (ex * ex + ey * ey + ez * ez)
    return MarkerFit(cost, k.point, k.error, k.column)


@jit
def right_hand_side(
    fit: MarkerFit, weight: Floats, tree: Chain, k: Workspace
) -> Floats:
    """Return the right-hand side J^T W e (6 + D,)."""
    point, error, column = fit.point, fit.error, fit.column
    wrench, gradient = k.wrench, k.gradient
    wrench[:] = 0.0
    for m in range(weight.shape[0]):
        w = weight[m]
        if w <= 0.0:
            continue
        row = wrench[tree.link[m]]
        x, y, z = point[m, 0], point[m, 1], point[m, 2]
        ex, ey, ez = w * error[m, 0], w * error[m, 1], w * error[m, 2]
        row[0] += ex
        row[1] += ey
        row[2] += ez
        row[3] += y * ez - z * ey
        row[4] += z * ex - x * ez
        row[5] += x * ey - y * ex
    for i in range(wrench.shape[0] - 1, 0, -1):
        up = wrench[tree.parent[i]]
        total = 0.0
        for n in range(3):
            total += column[i, n] * wrench[i, 3 + n] + column[i, 3 + n] * wrench[i, n]
            up[n] += wrench[i, n]
            up[3 + n] += wrench[i, 3 + n]
        gradient[5 + i] = total
    for n in range(6):
        gradient[n] = wrench[0, n]
    return gradient


@jit
def add_moments(point: Floats, weight: Floats, link: Ints, moment: Floats) -> None:
    """Write mass, first and second moments (L, 10) of each link's own markers."""
    moment[:] = 0.0
    for m in range(weight.shape[0]):
        w = weight[m]
        if w <= 0.0:
            continue
        row = moment[link[m]]
        x, y, z = point[m, 0], point[m, 1], point[m, 2]
        wx, wy, wz = w * x, w * y, w * z
        row[0] += w
        row[1] += wx
        row[2] += wy
        row[3] += wz
        row[4] += wx * x
        row[5] += wx * y
        row[6] += wx * z
        row[7] += wy * y
        row[8] += wy * z
        row[9] += wz * z


@jit
def normal_matrix(fit: MarkerFit, weight: Floats, tree: Chain, k: Workspace) -> Floats:
    """Return J^T W J (6 + D, 6 + D), its lower triangle along the tree."""
    column, moment, normal = fit.column, k.moment, k.normal
    add_moments(fit.point, weight, tree.link, moment)
    for i in range(moment.shape[0] - 1, 0, -1):
        row, up = moment[i], moment[tree.parent[i]]
        for n in range(10):
            up[n] += row[n]
        ax, ay, az = column[i, 0], column[i, 1], column[i, 2]
        vx, vy, vz = column[i, 3], column[i, 4], column[i, 5]
        mass, cx, cy, cz = row[0], row[1], row[2], row[3]
        xx, xy, xz, yy, yz, zz = row[4], row[5], row[6], row[7], row[8], row[9]
        fx = ay * cz - az * cy + mass * vx
        fy = az * cx - ax * cz + mass * vy
        fz = ax * cy - ay * cx + mass * vz
        nx = (yy + zz) * ax - xy * ay - xz * az + cy * vz - cz * vy
        ny = (xx + zz) * ay - xy * ax - yz * az + cz * vx - cx * vz
        nz = (xx + yy) * az - xz * ax - yz * ay + cx * vy - cy * vx
        line = normal[5 + i]
        line[0], line[1], line[2] = fx, fy, fz
        line[3], line[4], line[5] = nx, ny, nz
        j = i
        while j > 0:
            c = column[j]
            line[5 + j] = (
                c[0] * nx + c[1] * ny + c[2] * nz + c[3] * fx + c[4] * fy + c[5] * fz
            )
            j = tree.parent[j]
    root = moment[0]
    mass, cx, cy, cz = root[0], root[1], root[2], root[3]
    for n in range(6):
        for j in range(n + 1):
            normal[n, j] = 0.0
    for n in range(3):
        normal[n, n] = mass
    normal[3, 1], normal[3, 2] = -cz, cy
    normal[4, 0], normal[4, 2] = cz, -cx
    normal[5, 0], normal[5, 1] = -cy, cx
    normal[3, 3] = root[7] + root[9]
    normal[4, 4] = root[4] + root[9]
    normal[5, 5] = root[4] + root[7]
    normal[4, 3], normal[5, 3], normal[5, 4] = -root[5], -root[6], -root[8]
    return normal


@jit
def factorise(tree: Chain, normal: Floats) -> None:
    """Replace the normal matrix by its L^T D L factors, leaves first, no fill-in."""
    parent = tree.parent
    for i in range(parent.shape[0] - 1, 0, -1):
        row = normal[5 + i]
        inverse = 1.0 / row[5 + i]
        j = parent[i]
        while j > 0:
            factor = row[5 + j] * inverse
            up = normal[5 + j]
            for n in range(6):
                up[n] -= factor * row[n]
            m = j
            while m > 0:
                up[5 + m] -= factor * row[5 + m]
                m = parent[m]
            row[5 + j] = factor
            j = parent[j]
        for j in range(6):
            factor = row[j] * inverse
            for m in range(j + 1):
                normal[j, m] -= factor * row[m]
        for j in range(6):
            row[j] *= inverse
    for i in range(5, -1, -1):
        inverse = 1.0 / normal[i, i]
        for j in range(i):
            factor = normal[i, j] * inverse
            for m in range(j + 1):
                normal[j, m] -= factor * normal[i, m]
        for j in range(i):
            normal[i, j] *= inverse


@jit
def substitute(tree: Chain, factors: Floats, gradient: Floats, step: Floats) -> float:
    """Write the step that solves the factorised equations.

    Returns
    -------
    The decrease it promises, ``gradient . step``.
    """
    parent = tree.parent
    for n in range(step.shape[0]):
        step[n] = gradient[n]
    for i in range(parent.shape[0] - 1, 0, -1):
        row, s = factors[5 + i], step[5 + i]
        j = parent[i]
        while j > 0:
            step[5 + j] -= row[5 + j] * s
            j = parent[j]
        for n in range(6):
            step[n] -= row[n] * s
    for i in range(5, -1, -1):
        for j in range(i):
            step[j] -= factors[i, j] * step[i]
    for i in range(6):
        step[i] /= factors[i, i]
        for j in range(i):
            step[i] -= factors[i, j] * step[j]
    promise = 0.0
    for n in range(6):
        promise += step[n] * gradient[n]
    for i in range(1, parent.shape[0]):
        row = factors[5 + i]
        s = step[5 + i] / row[5 + i]
        for n in range(6):
            s -= row[n] * step[n]
        j = parent[i]
        while j > 0:
            s -= row[5 + j] * step[5 + j]
            j = parent[j]
        step[5 + i] = s
        promise += s * gradient[5 + i]
    return promise


@jit
def damp(
    pose: Floats, tree: Chain, damping: float, normal: Floats, gradient: Floats
) -> None:
    """Add D, and hold the hinges that push against their limits.

    ``damping`` [m^2/rad^2] keeps undetermined hinges still; it is raised by Chan and
    Dubey's |dH/dq| for a hinge on its way to the nearer limit.
    """
    for n in range(6):
        normal[n, n] += damping * 1e-3
    for d in range(tree.limits.shape[0]):
        low, high = tree.limits[d, 0], tree.limits[d, 1]
        q, g = pose[7 + d], gradient[6 + d]
        extra = damping
        if (q <= low and g < 0.0) or (q >= high and g > 0.0):
            extra = HELD_PRECISION
            gradient[6 + d] = 0.0
        elif q > low and q < high:
            middle = 2.0 * q - high - low
            if middle * g > 0.0:
                span = high - low
                room = (high - q) * (q - low)
                extra += damping * span * span * abs(middle) / (4.0 * room * room)
        normal[6 + d, 6 + d] += extra


@jit
def advance(
    pose: Floats, step: Floats, scale: float, tree: Chain, k: Workspace, out: Floats
) -> None:
    """Write the pose moved by ``scale`` times the step, clipped at the limits."""
    turn = k.moment[0]  # room for a quaternion
    vector = k.moment[0, 4:7]
    for n in range(3):
        out[n] = pose[n] + scale * step[n]
        vector[n] = scale * step[3 + n]
    exponential(vector, turn[:4])
    compose(turn[:4], pose[3:7], out[3:7])
    for d in range(tree.limits.shape[0]):
        q = pose[7 + d] + scale * step[6 + d]
        out[7 + d] = min(max(q, tree.limits[d, 0]), tree.limits[d, 1])


@jit
def anchor_cost(pose: Floats, anchor: Anchor) -> float:
    """Return sum_d weight_d (q_d - rest_d)^2."""
    total = 0.0
    for d in range(anchor.weight.shape[0]):
        away = pose[7 + d] - anchor.rest[d]
        total += anchor.weight[d] * away * away
    return total


@jit
def add_anchor_pull(pose: Floats, anchor: Anchor, gradient: Floats) -> None:
    """Add the anchors' part to the right-hand side."""
    for d in range(anchor.weight.shape[0]):
        gradient[6 + d] -= anchor.weight[d] * (pose[7 + d] - anchor.rest[d])


@jit
def stop_at_limits(pose: Floats, step: Floats, stop: Floats, limits: Floats) -> bool:
    """Write which hinges a step takes beyond a limit; return whether any is new.

    Parameters
    ----------
    stop : (D,) [rad] changed: NaN, or the step that ends at the limit.
    """
    found = False
    for d in range(limits.shape[0]):
        q = pose[7 + d]
        to = q + step[6 + d]
        if math.isnan(stop[d]) and not limits[d, 0] <= to <= limits[d, 1]:
            stop[d] = (limits[d, 0] if to < q else limits[d, 1]) - q
            found = True
    return found


@jit
def newton_step(
    pose: Floats,
    fit: MarkerFit,
    weight: Floats,
    anchor: Anchor,
    tree: Chain,
    damping: float,
    k: Workspace,
) -> NewtonStep:
    """Return the Gauss-Newton step from a new matrix.

    A hinge that the step would take beyond a limit is taken to the limit instead, and
    the others, knowing that, are solved for again.
    """
    right, step, stop, normal = k.right, k.step, k.stop, k.normal
    hinges = anchor.weight.shape[0]
    stop[:] = math.nan
    promise = 0.0
    for _ in range(4):
        gradient = right_hand_side(fit, weight, tree, k)
        add_anchor_pull(pose, anchor, gradient)
        normal = normal_matrix(fit, weight, tree, k)
        for d in range(hinges):
            normal[6 + d, 6 + d] += anchor.weight[d]
        damp(pose, tree, damping, normal, gradient)
        for n in range(right.shape[0]):
            right[n] = gradient[n]
        for d in range(hinges):
            if not math.isnan(stop[d]):
                normal[6 + d, 6 + d] += HELD_PRECISION
                gradient[6 + d] = HELD_PRECISION * stop[d]
        factorise(tree, normal)
        substitute(tree, normal, gradient, step)
        promise = 0.0
        for n in range(right.shape[0]):
            promise += right[n] * step[n]
        if not stop_at_limits(pose, step, stop, tree.limits):
            break
    return NewtonStep(step, max(promise, 0.0), normal)


@jit
def hold_at_limits(
    pose: Floats, factors: Floats, gradient: Floats, limits: Floats
) -> bool:
    """Take hinges that the factors hold at a limit out of the right-hand side.

    Returns
    -------
    Whether all of them still push against their limits, so that the factors serve.
    """
    serves = True
    for d in range(limits.shape[0]):
        if factors[6 + d, 6 + d] >= HELD_PRECISION:
            inwards = gradient[6 + d] * (pose[7 + d] - limits[d, 0])
            outwards = gradient[6 + d] * (limits[d, 1] - pose[7 + d])
            if inwards < 0.0 or outwards > 0.0:
                serves = False
            gradient[6 + d] = 0.0
    return serves


@jit
def solve_full(
    pose: Floats,
    seen: Observations,
    anchor: Anchor,
    tree: Chain,
    control: StepControl,
    k: Workspace,
) -> PoseFit:
    """Solve for root and all angles from ``pose``, in place.

    Minimises C plus the anchors' cost, which is for hinges that the markers leave open;
    elsewhere the anchor's weight is 0.

    Stops when the decrease a step promises is under 3 % of C, where steps shrink fast
    (else 0.3 %), or under ``enough_m`` squared per unit of weight; that last step is
    still taken, and leaves less than a tenth of what it removes. From the second
    iteration on the old factors are tried first (a chord step); a new matrix is made
    only if they no longer bring the promise down to a fifth.

    Parameters
    ----------
    pose : (7 + D,) start, overwritten by the result.
    """
    weight, step, trial, factors = seen.weight, k.step, k.trial, k.normal
    total = 0.0
    for m in range(weight.shape[0]):
        total += weight[m]
    floor = total * control.enough_m * control.enough_m
    fit = misfit(pose, seen, tree, k)
    cost = fit.cost + anchor_cost(pose, anchor)
    promise = math.inf
    for count in range(control.iterations):
        before = promise
        chord = count > 0
        if chord:
            gradient = right_hand_side(fit, weight, tree, k)
            add_anchor_pull(pose, anchor, gradient)
            if hold_at_limits(pose, factors, gradient, tree.limits):
                promise = substitute(tree, factors, gradient, step)
                chord = promise < 0.2 * before
            else:
                chord = False
        if not chord:
            made = newton_step(pose, fit, weight, anchor, tree, control.damping, k)
            promise, factors = made.promise, made.factors
        fast = count > 0 and promise < 0.2 * before
        last = promise < (0.03 if fast else 0.003) * cost + floor
        scale = 1.0
        while True:
            advance(pose, step, scale, tree, k, trial)
            fit = misfit(trial, seen, tree, k)
            after = fit.cost + anchor_cost(trial, anchor)
            if after <= cost:
                break
            scale *= 0.5
            if scale < 0.02:
                fit = misfit(pose, seen, tree, k)
                return PoseFit(cost, count + 1, fit.error)
        for n in range(pose.shape[0]):
            pose[n] = trial[n]
        cost = after
        if last:
            return PoseFit(cost, count + 1, fit.error)
    return PoseFit(cost, control.iterations, fit.error)


@jit
def write_posture(
    subspace: Subspace, alpha: Floats, limits: Floats, out: Floats
) -> None:
    """Write angles = mean + basis alpha, clipped at the limits, to ``out`` (D,)."""
    for d in range(out.shape[0]):
        q = subspace.mean[d]
        for a in range(alpha.shape[0]):
            q += subspace.basis[d, a] * alpha[a]
        out[d] = min(max(q, limits[d, 0]), limits[d, 1])


@jit
def nearest_alpha(subspace: Subspace, angles: Floats, k: Workspace) -> Floats:
    """Return alpha (K,) of the posture nearest to ``angles`` (D,).

    The basis has orthogonal columns.
    """
    mean, basis, alpha = subspace.mean, subspace.basis, k.alpha
    for a in range(basis.shape[1]):
        along, size = 0.0, 0.0
        for d in range(basis.shape[0]):
            along += basis[d, a] * (angles[d] - mean[d])
            size += basis[d, a] * basis[d, a]
        alpha[a] = along / size if size > 0.0 else 0.0
    return alpha


@jit
def reduce_to_subspace(
    normal: Floats,
    gradient: Floats,
    subspace: Subspace,
    alpha: Floats,
    damping: float,
    k: Workspace,
) -> ReducedEquations:
    """Return M^T (J^T W J + D) M and M^T J^T W e for root and alpha, with the prior.

    Parameters
    ----------
    normal, gradient : (6 + D, 6 + D), (6 + D,) of root and angles.
    """
    basis, weight = subspace.basis, subspace.noise_m * subspace.noise_m
    directions, hinges = basis.shape[1], basis.shape[0]
    image, dense, right = k.image, k.reduced_matrix, k.reduced_right
    image[:] = 0.0
    dense[:] = 0.0
    for n in range(6):
        right[n] = gradient[n]
        for j in range(n + 1):
            dense[n, j] = normal[n, j]
        dense[n, n] += damping * 1e-3
    for i in range(hinges):
        row = normal[6 + i]
        for a in range(directions):
            for n in range(6):
                dense[6 + a, n] += row[n] * basis[i, a]
    for i in range(hinges):
        row = normal[6 + i]
        for j in range(i + 1):
            h = row[6 + j]
            if h == 0.0:
                continue
            for a in range(directions):
                image[i, a] += h * basis[j, a]
                if i != j:
                    image[j, a] += h * basis[i, a]
    for a in range(directions):
        total = -weight * alpha[a]
        for d in range(hinges):
            total += basis[d, a] * gradient[6 + d]
            for b in range(a + 1):
                dense[6 + a, 6 + b] += basis[d, a] * image[d, b]
        right[6 + a] = total
        dense[6 + a, 6 + a] += weight + damping
    return ReducedEquations(dense, right)


@jit
def solve_subspace(
    pose: Floats,
    alpha: Floats,
    seen: Observations,
    subspace: Subspace,
    tree: Chain,
    control: StepControl,
    k: Workspace,
) -> float:
    """Solve for root and alpha from ``pose``'s root and ``alpha``, in place.

    Parameters
    ----------
    pose : (7 + D,) overwritten by the result, angles within the limits.
    alpha : (K,) start, overwritten.

    Returns
    -------
    C at the result.
    """
    prior, directions = subspace.noise_m * subspace.noise_m, alpha.shape[0]
    root_step, trial = k.step, k.trial
    total = 0.0
    for m in range(seen.weight.shape[0]):
        total += seen.weight[m]
    floor = total * control.enough_m * control.enough_m
    write_posture(subspace, alpha, tree.limits, pose[7:])
    fit = misfit(pose, seen, tree, k)
    cost = fit.cost
    for _ in range(control.iterations):
        gradient = right_hand_side(fit, seen.weight, tree, k)
        normal = normal_matrix(fit, seen.weight, tree, k)
        reduced = reduce_to_subspace(
            normal, gradient, subspace, alpha, control.damping, k
        )
        norm, promise, step = 0.0, 0.0, k.reduced_step
        for a in range(directions):
            norm += alpha[a] * alpha[a]
        for n in range(step.shape[0]):
            step[n] = reduced.right[n]
        if not factor(reduced.matrix):
            return cost
        forward_vector(reduced.matrix, step, 0)
        backward_by_rows(reduced.matrix, step)
        for n in range(step.shape[0]):
            promise += step[n] * reduced.right[n]
        scale, accepted = 1.0, False
        while not accepted and scale > 0.02:
            for n in range(6):
                root_step[n] = step[n]
            advance(pose, root_step, scale, tree, k, trial)
            after_norm = 0.0
            for a in range(directions):
                alpha[a] += scale * step[6 + a]
                after_norm += alpha[a] * alpha[a]
            write_posture(subspace, alpha, tree.limits, trial[7:])
            fit = misfit(trial, seen, tree, k)
            accepted = fit.cost + prior * after_norm <= cost + prior * norm
            if not accepted:
                for a in range(directions):
                    alpha[a] -= scale * step[6 + a]
                scale *= 0.5
        if not accepted:
            return cost
        for n in range(pose.shape[0]):
            pose[n] = trial[n]
        cost = fit.cost
        if promise < 0.02 * (cost + prior * norm) + floor:
            return cost
    return cost


@jit
def find_open_hinges(
    pose: Floats,
    seen: Observations,
    tree: Chain,
    damping: float,
    lever_m: float,
    k: Workspace,
    out: Bools,
) -> Openness:
    """Find the hinges that the markers of a frame leave open.

    A hinge is open if, with everything beyond it free, turning it by one radian moves
    the markers by less than ``lever_m``; and with it the whole finger it belongs to,
    since its share cannot be told from its neighbours'.

    Parameters
    ----------
    damping : [m^2/rad^2]
    out : (D,) overwritten in full, ``hinges`` of what is returned.
    """
    fit = misfit(pose, seen, tree, k)
    normal = normal_matrix(fit, seen.weight, tree, k)
    for n in range(6):
        normal[n, n] += damping
    for d in range(out.shape[0]):
        normal[6 + d, 6 + d] += damping
    factorise(tree, normal)
    found = False
    for d in range(out.shape[0]):
        out[d] = normal[6 + d, 6 + d] < lever_m * lever_m
        found = found or out[d]
    if found:
        for i in range(out.shape[0], 0, -1):  # inwards: what is open beyond opens it
            if out[i - 1] and tree.parent[i] > 0:
                out[tree.parent[i] - 1] = True
        for i in range(1, out.shape[0] + 1):  # outwards
            if tree.parent[i] > 0 and out[tree.parent[i] - 1]:
                out[i - 1] = True
    level = HINGES_OPEN if found else ALL_DECIDED
    for n in range(6):
        if normal[n, n] < lever_m * lever_m:
            level = ROOT_OPEN
    return Openness(level, out)


@jit
def information(
    fit: MarkerFit, weight: Floats, prior: AnglePrior, tree: Chain, k: Workspace
) -> Floats:
    """Return ``J^T W J / noise_m^2 + [0 precision]``, (6 + D, 6 + D).

    Of the lower triangle; the rest is not written.
    """
    normal, matrix = normal_matrix(fit, weight, tree, k), k.information
    scale = prior.noise_m**-2.0
    for i in range(matrix.shape[0]):
        for j in range(i + 1):
            matrix[i, j] = 0.0
            if i >= 6 and j >= 6:
                matrix[i, j] = prior.precision[i - 6, j - 6]
            if j < 6:
                matrix[i, j] += scale * normal[i, j]
        if i >= 6:
            j = i
            while j >= 6:
                matrix[i, j] += scale * normal[i, j]
                j = 5 + tree.parent[j - 5]
    return matrix


@jit
def factored_information(
    fit: MarkerFit, weight: Floats, prior: AnglePrior, tree: Chain, k: Workspace
) -> Factor:
    """Return the Cholesky factor of what `information` returns."""
    matrix = information(fit, weight, prior, tree, k)
    return Factor(factor(matrix), matrix)


@jit
def is_spread_within(lower: Floats, most: SpreadLimits, k: Workspace) -> bool:
    """Whether markers and a prior of the angles together decide the whole posture.

    They do if the standard deviations of the root's rotation and of every hinge are
    small enough, in the covariance of root and angles.

    Parameters
    ----------
    lower : (6 + D, 6 + D) Cholesky factor of the inverse covariance.
    """
    row = k.row
    size = row.shape[0]
    for d in range(3, size):
        row[:] = 0.0
        row[d] = 1.0
        forward_vector(lower, row, d)
        variance = 0.0
        for i in range(d, size):
            variance += row[i] * row[i]
        if variance > (most.root_rad if d < 6 else most.hinge_rad) ** 2:
            return False
    return True
