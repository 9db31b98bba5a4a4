"""Normal equations of many frames that share one hand, each with a pose of its own.

Unknown are the pose x_f of every frame (P = 6 + D numbers, moved as in
``kernels.chain``) and the shape s of the hand (N numbers, see ``kernels.shape``).
Minimised is, over frames f and markers m with residual r = measured - modelled,

    sum_f sum_m w_fm rho(|r_fm|^2) + pose prior(x_f) + shape prior(s)

with rho(q) = q / (1 + soft q), Geman and McClure's, which lets a mislabelled marker go;
soft = 0 is plain least squares. Linearised, with rho'(q) = 1 / (1 + soft q)^2 put into
the weights, each frame gives

    [ H_f    M_f ] [dx_f]   [g_f]
    [ M_f^T  .   ] [ds  ] = [ . ]

Eliminating dx_f = inv(H_f) (g_f - M_f ds) leaves the Schur complement

    (S - sum_f M_f^T inv(H_f) M_f) ds = b - sum_f M_f^T inv(H_f) g_f .

With H_f = L L^T, A = inv(L) M and y = inv(L) g it is S - sum A^T A and b - sum A^T y.

The pose prior holds hinge d towards ``centre`` with weight ``hold`` and pulls it back
to its limits with weight ``bound`` when it is beyond them.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.kernels.chain import marker_jacobian, place_links, place_points
from handclean.kernels.cholesky import backward, factor, forward
from handclean.kernels.pose_step import move
from handclean.kernels.shape import shape_jacobian

SPEECHLESS = 1e-9
"""Added to the diagonal of a pose's equations: what no marker decides stays put."""


class Body(NamedTuple):
    """A hand with markers, what is unknown about it, and what is expected of poses.

    With L = D + 1 links, M markers, C packed columns (see `shape.shape_jacobian`).
    """

    parent: Ints  # (L,)
    offset: Floats  # (L, 3)
    axis: Floats  # (L, 3)
    carries: Bools  # (L, L)
    link: Ints  # (M,)
    at: Floats  # (M, 3)
    tangents: Floats  # (L, 3, 2)
    joint_up: Ints  # (M, A)
    hinges: Ints  # (M, H)
    column: Ints  # (M, C)
    centre: Floats  # (D,)
    hold: Floats  # (D,)
    limits: Floats  # (D, 2)
    bound: float


class Room(NamedTuple):
    """Work space for one frame."""

    turn: Floats  # (L, 3, 3)
    origin: Floats  # (L, 3)
    hinge: Floats  # (L, 6)
    point: Floats  # (M, 3)
    residual: Floats  # (M, 3)
    weight: Floats  # (M,)
    by_pose: Floats  # (M, 3, P)
    by_shape: Floats  # (M, 3, C)


def make_room(body: Body) -> Room:
    """Return work space for one frame of ``body``."""
    links, markers = len(body.parent), len(body.link)
    return Room(
        turn=np.zeros((links, 3, 3)),
        origin=np.zeros((links, 3)),
        hinge=np.zeros((links, 6)),
        point=np.zeros((markers, 3)),
        residual=np.zeros((markers, 3)),
        weight=np.zeros(markers),
        by_pose=np.zeros((markers, 3, 5 + links)),
        by_shape=np.zeros((markers, 3, body.column.shape[1])),
    )


@jit
def frame_cost(
    pose: Floats, target: Floats, weight: Floats, soft: float, body: Body, room: Room
) -> float:
    """Return a frame's cost; fills places, residuals and robust weights.

    Parameters
    ----------
    pose : (7 + D,)
    target : (M, 3) [m]; anything where the weight is 0.
    weight : (M,) [1/m^2]
    soft : [1/m^2] 0 for plain least squares.
    """
    place_links(
        pose, body.parent, body.offset, body.axis, room.turn, room.origin, room.hinge
    )
    place_points(room.turn, room.origin, body.link, body.at, room.point)
    cost = 0.0
    for m in range(target.shape[0]):
        room.weight[m] = 0.0
        if weight[m] > 0.0:
            square = 0.0
            for n in range(3):
                r = target[m, n] - pose[n] - room.point[m, n]
                room.residual[m, n] = r
                square += r * r
            share = 1.0 / (1.0 + soft * square)
            cost += weight[m] * square * share
            room.weight[m] = weight[m] * share * share
    for d in range(body.centre.shape[0]):
        q = pose[7 + d]
        low, high = body.limits[d, 0], body.limits[d, 1]
        cost += body.hold[d] * (q - body.centre[d]) ** 2
        if q < low:
            cost += body.bound * (q - low) ** 2
        elif q > high:
            cost += body.bound * (q - high) ** 2
    return cost


@jit
def pose_equations(
    pose: Floats, body: Body, room: Room, square: Floats, slope: Floats
) -> None:
    """Write H and g of one frame, from what `frame_cost` left in ``room``.

    Parameters
    ----------
    square : (P, P) its lower triangle is overwritten.
    slope : (P,) overwritten.
    """
    marker_jacobian(room.point, room.hinge, body.link, body.carries, room.by_pose)
    size = square.shape[0]
    square[:] = 0.0
    slope[:] = 0.0
    for m in range(body.link.shape[0]):
        if room.weight[m] == 0.0:
            continue
        for row in range(3):
            for a in range(size):
                left = room.weight[m] * room.by_pose[m, row, a]
                if left != 0.0:
                    slope[a] += left * room.residual[m, row]
                    for b in range(a + 1):
                        square[a, b] += left * room.by_pose[m, row, b]
    for d in range(body.centre.shape[0]):
        q = pose[7 + d]
        low, high = body.limits[d, 0], body.limits[d, 1]
        square[6 + d, 6 + d] += body.hold[d]
        slope[6 + d] += body.hold[d] * (body.centre[d] - q)
        if q < low:
            square[6 + d, 6 + d] += body.bound
            slope[6 + d] += body.bound * (low - q)
        elif q > high:
            square[6 + d, 6 + d] += body.bound
            slope[6 + d] += body.bound * (high - q)


@jit
def add_shape_equations(
    body: Body, room: Room, mixed: Floats, square: Floats, slope: Floats
) -> None:
    """Write M of one frame and add its part of S and b.

    Parameters
    ----------
    mixed : (P, N) overwritten in full.
    square : (N, N) added to, in full; slope : (N,) added to.
    """
    shape_jacobian(
        room.turn,
        room.origin,
        room.point,
        body.parent,
        body.link,
        body.tangents,
        body.joint_up,
        body.hinges,
        room.by_shape,
    )
    mixed[:] = 0.0
    size, packed = mixed.shape[0], body.column.shape[1]
    for m in range(body.link.shape[0]):
        if room.weight[m] == 0.0:
            continue
        for row in range(3):
            for c in range(packed):
                at = body.column[m, c]
                if at < 0:
                    continue
                left = room.weight[m] * room.by_shape[m, row, c]
                slope[at] += left * room.residual[m, row]
                for a in range(size):
                    mixed[a, at] += left * room.by_pose[m, row, a]
                for b in range(packed):
                    if body.column[m, b] >= 0:
                        square[at, body.column[m, b]] += left * room.by_shape[m, row, b]


@jit
def costs(
    poses: Floats,
    targets: Floats,
    weights: Floats,
    soft: float,
    body: Body,
    room: Room,
    out: Floats,
) -> None:
    """Write the (T,) costs of all frames."""
    for f in range(poses.shape[0]):
        out[f] = frame_cost(poses[f], targets[f], weights[f], soft, body, room)


@jit
def eliminate(
    poses: Floats,
    targets: Floats,
    weights: Floats,
    soft: float,
    damping: float,
    body: Body,
    room: Room,
    lower: Floats,
    reduced: Floats,
    rest: Floats,
    square: Floats,
    slope: Floats,
) -> None:
    """Write what is left of every frame's equations when its pose is eliminated.

    Parameters
    ----------
    poses : (T, 7 + D); targets : (T, M, 3); weights : (T, M)
    damping : by which the diagonal of each H is enlarged (Marquardt).
    lower : (T, P, P) the factors L of H.
    reduced : (T, P, N) A = inv(L) M; rest : (T, P, 1) y = inv(L) g.
    square : (N, N) S, slope : (N,) b, both before the poses are eliminated.
        All are overwritten.
    """
    square[:] = 0.0
    slope[:] = 0.0
    size = lower.shape[1]
    line = np.zeros(size)
    for f in range(poses.shape[0]):
        frame_cost(poses[f], targets[f], weights[f], soft, body, room)
        pose_equations(poses[f], body, room, lower[f], line)
        add_shape_equations(body, room, reduced[f], square, slope)
        for a in range(size):
            lower[f, a, a] += damping * lower[f, a, a] + SPEECHLESS
            rest[f, a, 0] = line[a]
        factor(lower[f])
        forward(lower[f], reduced[f])
        forward(lower[f], rest[f])


@jit
def follow(
    poses: Floats,
    lower: Floats,
    reduced: Floats,
    rest: Floats,
    shape_step: Floats,
    out: Floats,
) -> None:
    """Write the (T, 7 + D) poses after the steps that go with a shape step (N,)."""
    step = np.zeros(lower.shape[1])
    for f in range(poses.shape[0]):
        for a in range(step.shape[0]):
            total = rest[f, a, 0]
            for n in range(shape_step.shape[0]):
                total -= reduced[f, a, n] * shape_step[n]
            step[a] = total
        backward(lower[f], step)
        move(poses[f], step, out[f])
