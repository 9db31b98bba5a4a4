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
the weight of ``prior_m`` metres of marker noise squared, without which the markers of a
reduced set could not decide it.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.kernels.chain import place_links
from handclean.kernels.cholesky import factor
from handclean.kernels.rotations import compose, exponential

HELD = 1e30
"""What is added to the diagonal for a hinge that must not move."""


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


class Work(NamedTuple):
    """Room for one frame's solve; nothing in it outlives the call."""

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
    dense: Floats  # (6 + K, 6 + K)
    image: Floats  # (D, K)
    reduced: Floats  # (6 + K,)
    slope: Floats  # (6 + K,) ``reduced`` before it is solved for
    alpha: Floats  # (K,)
    right: Floats  # (6 + D,) gradient before stops
    stop: Floats  # (D,) [rad] step that ends at a limit, or NaN


def make_work(hinges: int, markers: int, directions: int = 0) -> Work:
    """Room for trees of ``hinges`` hinges with ``markers`` markers.

    Parameters
    ----------
    directions : K of the posture subspace; it may be more than the tree has hinges.
    """
    links, dofs, small = hinges + 1, hinges + 6, directions + 6
    return Work(
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
        dense=np.zeros((small, small)),
        image=np.zeros((hinges, directions)),
        reduced=np.zeros(small),
        slope=np.zeros(small),
        alpha=np.zeros(directions),
        right=np.zeros(dofs),
        stop=np.zeros(hinges),
    )


@jit
def misfit(pose: Floats, target: Floats, weight: Floats, tree: Chain, k: Work) -> float:
    """Place the markers and return C; fills points and errors.

    Parameters
    ----------
    pose : (7 + D,)
    target : (M, 3) [m]; anything where the weight is 0.
    weight : (M,) not negative.
    """
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
    return cost


@jit
def pull(weight: Floats, tree: Chain, k: Work) -> None:
    """Write the right-hand side J^T W e from the errors of `misfit`."""
    wrench, column, gradient = k.wrench, k.column, k.gradient
    wrench[:] = 0.0
    for m in range(weight.shape[0]):
        w = weight[m]
        if w <= 0.0:
            continue
        row = wrench[tree.link[m]]
        x, y, z = k.point[m, 0], k.point[m, 1], k.point[m, 2]
        ex, ey, ez = w * k.error[m, 0], w * k.error[m, 1], w * k.error[m, 2]
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


@jit
def inertia(weight: Floats, tree: Chain, k: Work) -> None:
    """Write J^T W J, its lower triangle along the tree, from the points of `misfit`."""
    moment, column, normal = k.moment, k.column, k.normal
    moment[:] = 0.0
    for m in range(weight.shape[0]):
        w = weight[m]
        if w <= 0.0:
            continue
        row = moment[tree.link[m]]
        x, y, z = k.point[m, 0], k.point[m, 1], k.point[m, 2]
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


@jit
def factorise(tree: Chain, k: Work) -> None:
    """Replace the normal matrix by its L^T D L factors, leaves first, no fill-in."""
    normal, parent = k.normal, tree.parent
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
def substitute(tree: Chain, k: Work) -> float:
    """Solve for the step with the factors; return the decrease it promises, g . s."""
    normal, parent, step, gradient = k.normal, tree.parent, k.step, k.gradient
    for n in range(step.shape[0]):
        step[n] = gradient[n]
    for i in range(parent.shape[0] - 1, 0, -1):
        row, s = normal[5 + i], step[5 + i]
        j = parent[i]
        while j > 0:
            step[5 + j] -= row[5 + j] * s
            j = parent[j]
        for n in range(6):
            step[n] -= row[n] * s
    for i in range(5, -1, -1):
        for j in range(i):
            step[j] -= normal[i, j] * step[i]
    for i in range(6):
        step[i] /= normal[i, i]
        for j in range(i):
            step[i] -= normal[i, j] * step[j]
    promise = 0.0
    for n in range(6):
        promise += step[n] * gradient[n]
    for i in range(1, parent.shape[0]):
        row = normal[5 + i]
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
def damp(pose: Floats, tree: Chain, damping: float, k: Work) -> None:
    """Add D, and hold the hinges that push against their limits.

    ``damping`` [m^2/rad^2] keeps undetermined hinges still; it is raised by Chan and
    Dubey's |dH/dq| for a hinge on its way to the nearer limit.
    """
    for n in range(6):
        k.normal[n, n] += damping * 1e-3
    for d in range(tree.limits.shape[0]):
        low, high = tree.limits[d, 0], tree.limits[d, 1]
        q, g = pose[7 + d], k.gradient[6 + d]
        extra = damping
        if (q <= low and g < 0.0) or (q >= high and g > 0.0):
            extra = HELD
            k.gradient[6 + d] = 0.0
        elif q > low and q < high:
            middle = 2.0 * q - high - low
            if middle * g > 0.0:
                span = high - low
                room = (high - q) * (q - low)
                extra += damping * span * span * abs(middle) / (4.0 * room * room)
        k.normal[6 + d, 6 + d] += extra


@jit
def advance(pose: Floats, scale: float, tree: Chain, k: Work, out: Floats) -> None:
    """Write the pose moved by ``scale`` times the step, clipped at the limits."""
    turn = k.moment[0]  # room for a quaternion
    vector = k.moment[0, 4:7]
    for n in range(3):
        out[n] = pose[n] + scale * k.step[n]
        vector[n] = scale * k.step[3 + n]
    exponential(vector, turn[:4])
    compose(turn[:4], pose[3:7], out[3:7])
    for d in range(tree.limits.shape[0]):
        q = pose[7 + d] + scale * k.step[6 + d]
        out[7 + d] = min(max(q, tree.limits[d, 0]), tree.limits[d, 1])


@jit
def pull_of_rest(pose: Floats, rest: Floats, anchor: Floats) -> float:
    """Return sum_d anchor_d (q_d - rest_d)^2."""
    total = 0.0
    for d in range(anchor.shape[0]):
        away = pose[7 + d] - rest[d]
        total += anchor[d] * away * away
    return total


@jit
def hold_to_rest(pose: Floats, rest: Floats, anchor: Floats, k: Work) -> None:
    """Add the anchors' part to the right-hand side."""
    for d in range(anchor.shape[0]):
        k.gradient[6 + d] -= anchor[d] * (pose[7 + d] - rest[d])


@jit
def stop_at_limits(pose: Floats, tree: Chain, k: Work) -> bool:
    """Note which hinges the step takes beyond a limit; return whether any is new."""
    found = False
    for d in range(tree.limits.shape[0]):
        q = pose[7 + d]
        to = q + k.step[6 + d]
        if math.isnan(k.stop[d]) and not tree.limits[d, 0] <= to <= tree.limits[d, 1]:
            k.stop[d] = (tree.limits[d, 0] if to < q else tree.limits[d, 1]) - q
            found = True
    return found


@jit
def newton_step(
    pose: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    rest: Floats,
    anchor: Floats,
    damping: float,
) -> float:
    """Write the Gauss-Newton step from a new matrix; return the decrease it promises.

    A hinge that the step would take beyond a limit is taken to the limit instead, and
    the others, knowing that, are solved for again.
    """
    k.stop[:] = math.nan
    promise = 0.0
    for _ in range(4):
        pull(weight, tree, k)
        hold_to_rest(pose, rest, anchor, k)
        inertia(weight, tree, k)
        for d in range(anchor.shape[0]):
            k.normal[6 + d, 6 + d] += anchor[d]
        damp(pose, tree, damping, k)
        for n in range(k.right.shape[0]):
            k.right[n] = k.gradient[n]
        for d in range(anchor.shape[0]):
            if not math.isnan(k.stop[d]):
                k.normal[6 + d, 6 + d] += HELD
                k.gradient[6 + d] = HELD * k.stop[d]
        factorise(tree, k)
        substitute(tree, k)
        promise = 0.0
        for n in range(k.right.shape[0]):
            promise += k.right[n] * k.step[n]
        if not stop_at_limits(pose, tree, k):
            break
    return max(promise, 0.0)


@jit
def solve_full(
    pose: Floats,
    target: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    rest: Floats,
    anchor: Floats,
    damping: float,
    iterations: int,
    enough_m: float,
) -> tuple[float, int]:
    """Solve for root and all angles from ``pose``, in place.

    Minimises C plus ``sum_d anchor_d (q_d - rest_d)^2``, which is for hinges that the
    markers leave open; elsewhere the anchor is 0.

    Stops when the decrease a step promises is under 3 % of C, where steps shrink fast
    (else 0.3 %), or under ``enough_m`` squared per unit of weight; that last step is
    still taken, and leaves less than a tenth of what it removes. From the second
    iteration on the old factors are tried first (a chord step); a new matrix is made
    only if they no longer bring the promise down to a fifth.

    Parameters
    ----------
    pose : (7 + D,) start, overwritten by the result.
    target, weight : (M, 3) [m], (M,)
    rest, anchor : (D,) [rad], (D,) [m^2/rad^2]
    iterations : how many steps at most.
    enough_m : [m] RMS below which a further decrease is not worth a step.

    Returns
    -------
    The minimised cost and the number of steps; ``k.error`` holds the errors.
    """
    total = 0.0
    for m in range(weight.shape[0]):
        total += weight[m]
    floor = total * enough_m * enough_m
    cost = misfit(pose, target, weight, tree, k) + pull_of_rest(pose, rest, anchor)
    promise = math.inf
    for count in range(iterations):
        before = promise
        chord = count > 0
        if chord:
            pull(weight, tree, k)
            hold_to_rest(pose, rest, anchor, k)
            for d in range(tree.limits.shape[0]):
                if k.normal[6 + d, 6 + d] >= HELD:
                    inwards = k.gradient[6 + d] * (pose[7 + d] - tree.limits[d, 0])
                    outwards = k.gradient[6 + d] * (tree.limits[d, 1] - pose[7 + d])
                    if inwards < 0.0 or outwards > 0.0:
                        chord = False  # it wants to come away from its limit
                    k.gradient[6 + d] = 0.0
        if chord:
            promise = substitute(tree, k)
            chord = promise < 0.2 * before
        if not chord:
            promise = newton_step(pose, weight, tree, k, rest, anchor, damping)
        fast = count > 0 and promise < 0.2 * before
        last = promise < (0.03 if fast else 0.003) * cost + floor
        scale = 1.0
        while True:
            advance(pose, scale, tree, k, k.trial)
            after = misfit(k.trial, target, weight, tree, k)
            after += pull_of_rest(k.trial, rest, anchor)
            if after <= cost:
                break
            scale *= 0.5
            if scale < 0.02:
                misfit(pose, target, weight, tree, k)
                return cost, count + 1
        for n in range(pose.shape[0]):
            pose[n] = k.trial[n]
        cost = after
        if last:
            return cost, count + 1
    return cost, iterations


@jit
def posture(
    mean: Floats, basis: Floats, limits: Floats, alpha: Floats, out: Floats
) -> None:
    """Write angles = mean + basis alpha, clipped at the limits, to ``out`` (D,)."""
    for d in range(out.shape[0]):
        q = mean[d]
        for a in range(alpha.shape[0]):
            q += basis[d, a] * alpha[a]
        out[d] = min(max(q, limits[d, 0]), limits[d, 1])


@jit
def project(mean: Floats, basis: Floats, angles: Floats, k: Work) -> None:
    """Write the alpha of the posture nearest to ``angles``; columns are orthogonal."""
    for a in range(basis.shape[1]):
        along, size = 0.0, 0.0
        for d in range(basis.shape[0]):
            along += basis[d, a] * (angles[d] - mean[d])
            size += basis[d, a] * basis[d, a]
        k.alpha[a] = along / size if size > 0.0 else 0.0


@jit
def reduce_to_subspace(basis: Floats, damping: float, weight: float, k: Work) -> None:
    """Write M^T (J^T W J + D) M and M^T J^T W e for root and alpha, with the prior."""
    directions, hinges = basis.shape[1], basis.shape[0]
    image, dense, normal = k.image, k.dense, k.normal
    image[:] = 0.0
    dense[:] = 0.0
    for n in range(6):
        k.reduced[n] = k.gradient[n]
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
        total = -weight * k.alpha[a]
        for d in range(hinges):
            total += basis[d, a] * k.gradient[6 + d]
            for b in range(a + 1):
                dense[6 + a, 6 + b] += basis[d, a] * image[d, b]
        k.reduced[6 + a] = total
        dense[6 + a, 6 + a] += weight + damping


@jit
def solve_dense(a: Floats, b: Floats) -> None:
    """Solve a x = b by Cholesky, x in place of b; a's lower triangle is overwritten."""
    size = b.shape[0]
    for i in range(size):
        for j in range(i + 1):
            total = a[i, j]
            for n in range(j):
                total -= a[i, n] * a[j, n]
            if i == j:
                a[i, i] = math.sqrt(total)
            else:
                a[i, j] = total / a[j, j]
        total = b[i]
        for n in range(i):
            total -= a[i, n] * b[n]
        b[i] = total / a[i, i]
    for i in range(size - 1, -1, -1):
        for n in range(i + 1, size):
            b[i] -= a[n, i] * b[n]
        b[i] /= a[i, i]


@jit
def solve_subspace(
    pose: Floats,
    target: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    basis: Floats,
    prior_m: float,
    damping: float,
    iterations: int,
    enough_m: float,
) -> float:
    """Solve for root and alpha from ``pose``'s root and ``k.alpha``, in place.

    Parameters
    ----------
    pose : (7 + D,) overwritten by the result, angles within the limits.
    mean : (D,) [rad]; basis : (D, K) [rad] columns one standard deviation long.
    prior_m : [m] marker noise that weighs as much as one standard deviation of alpha.

    Returns
    -------
    C at the result.
    """
    prior = prior_m * prior_m
    total = 0.0
    for m in range(weight.shape[0]):
        total += weight[m]
    floor = total * enough_m * enough_m
    posture(mean, basis, tree.limits, k.alpha, pose[7:])
    cost = misfit(pose, target, weight, tree, k)
    for _ in range(iterations):
        pull(weight, tree, k)
        inertia(weight, tree, k)
        reduce_to_subspace(basis, damping, prior, k)
        norm, promise = 0.0, 0.0
        for a in range(basis.shape[1]):
            norm += k.alpha[a] * k.alpha[a]
        for n in range(k.reduced.shape[0]):
            k.slope[n] = k.reduced[n]
        solve_dense(k.dense, k.reduced)
        for n in range(k.reduced.shape[0]):
            promise += k.reduced[n] * k.slope[n]
        scale, accepted = 1.0, False
        while not accepted and scale > 0.02:
            for n in range(6):
                k.step[n] = k.reduced[n]
            advance(pose, scale, tree, k, k.trial)
            after_norm = 0.0
            for a in range(basis.shape[1]):
                k.alpha[a] += scale * k.reduced[6 + a]
                after_norm += k.alpha[a] * k.alpha[a]
            posture(mean, basis, tree.limits, k.alpha, k.trial[7:])
            after = misfit(k.trial, target, weight, tree, k)
            accepted = after + prior * after_norm <= cost + prior * norm
            if not accepted:
                for a in range(basis.shape[1]):
                    k.alpha[a] -= scale * k.reduced[6 + a]
                scale *= 0.5
        if not accepted:
            return cost
        for n in range(pose.shape[0]):
            pose[n] = k.trial[n]
        cost = after
        if promise < 0.02 * (cost + prior * norm) + floor:
            return cost
    return cost


@jit
def undecided(
    pose: Floats,
    target: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    damping: float,
    lever_m: float,
    out: Bools,
) -> int:
    """Write which hinges the weighted markers leave open.

    A hinge is open if, with everything beyond it free, turning it by one radian moves
    the markers by less than ``lever_m``; and with it the whole finger it belongs to,
    since its share cannot be told from its neighbours'.

    Parameters
    ----------
    out : (D,) overwritten in full.

    Returns
    -------
    0 if all is decided, 1 if hinges are open, 2 if the root is.
    """
    misfit(pose, target, weight, tree, k)
    pull(weight, tree, k)
    inertia(weight, tree, k)
    for n in range(6):
        k.normal[n, n] += damping
    for d in range(out.shape[0]):
        k.normal[6 + d, 6 + d] += damping
    factorise(tree, k)
    found = False
    for d in range(out.shape[0]):
        out[d] = k.normal[6 + d, 6 + d] < lever_m * lever_m
        found = found or out[d]
    if found:
        for i in range(out.shape[0], 0, -1):  # inwards: what is open beyond opens it
            if out[i - 1] and tree.parent[i] > 0:
                out[tree.parent[i] - 1] = True
        for i in range(1, out.shape[0] + 1):  # outwards
            if tree.parent[i] > 0 and out[tree.parent[i] - 1]:
                out[i - 1] = True
    for n in range(6):
        if k.normal[n, n] < lever_m * lever_m:
            return 2
    return 1 if found else 0


@jit
def information(
    weight: Floats,
    tree: Chain,
    k: Work,
    precision: Floats,
    prior_m: float,
    matrix: Floats,
) -> None:
    """Write ``J^T W J / prior_m^2 + [0 precision]``, its lower triangle.

    To be called after `misfit` or `undecided`, of whose pose ``k`` holds points and
    columns; overwrites ``k.normal``.

    Parameters
    ----------
    precision : (D, D) [1/rad^2] of the prior, symmetric.
    matrix : (6 + D, 6 + D) overwritten.
    """
    inertia(weight, tree, k)
    normal, scale = k.normal, prior_m**-2.0
    for i in range(matrix.shape[0]):
        for j in range(i + 1):
            matrix[i, j] = 0.0
            if i >= 6 and j >= 6:
                matrix[i, j] = precision[i - 6, j - 6]
            if j < 6:
                matrix[i, j] += scale * normal[i, j]
        if i >= 6:
            j = i
            while j >= 6:
                matrix[i, j] += scale * normal[i, j]
                j = 5 + tree.parent[j - 5]


@jit
def known_with(
    weight: Floats,
    tree: Chain,
    k: Work,
    precision: Floats,
    prior_m: float,
    most: tuple[float, float],
    square: Floats,
) -> bool:
    """Whether markers and a prior of the angles together decide the whole posture.

    With noise ``prior_m`` on the markers, root and angles have the covariance
    ``(J^T W J / prior_m^2 + [0 precision])^-1``. They are decided if the standard
    deviations of the root's rotation and of every hinge are small enough.

    To be called after `misfit` or `undecided`, of whose pose ``k`` holds points and
    columns; overwrites ``k.normal``.

    Parameters
    ----------
    precision : (D, D) [1/rad^2] of the prior, symmetric.
    most : [rad] largest standard deviations of the root's rotation and of a hinge.
    square : (7 + D, 6 + D) room.
    """
    size = square.shape[1]
    row = square[size]
    matrix = square[:size]
    information(weight, tree, k, precision, prior_m, matrix)
    if not factor(matrix):
        return False
    for d in range(3, size):
        row[:] = 0.0
        row[d] = 1.0
        variance = 0.0
        for i in range(d, size):
            for n in range(d, i):
                row[i] -= matrix[i, n] * row[n]
            row[i] /= matrix[i, i]
            variance += row[i] * row[i]
        if variance > most[0 if d < 6 else 1] ** 2:
            return False
    return True
