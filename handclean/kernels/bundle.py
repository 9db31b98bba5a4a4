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

from handclean.arrays import Floats, Ints
from handclean.kernels import jit
from handclean.kernels.chain import Links, marker_jacobian, place_links, place_points
from handclean.kernels.linalg import backward, factor, forward
from handclean.kernels.pose_step import move
from handclean.kernels.shape import Packing, shape_jacobian

DIAGONAL_ADDED = 1e-9
"""[1/m^2, 1/rad^2] added to the diagonal of a pose's equations, so that numbers which
no marker decides do not move (chosen: far below the weight of one marker)."""


class PoseBounds(NamedTuple):
    """The pose prior: where hinges are held, and how strongly."""

    centre: Floats
    """(D,) [rad] the angles they are held towards."""
    hold: Floats
    """(D,) [1/rad^2] how strongly."""
    limits: Floats
    """(D, 2) [rad] beyond which they are pulled back."""
    bound: float
    """[1/rad^2] how strongly."""


class Body(NamedTuple):
    """A hand with M markers, what is unknown about it, what is expected of poses."""

    links: Links
    """The joint tree, with L = D + 1 links."""
    link: Ints
    """(M,) the link each marker sits on."""
    at: Floats
    """(M, 3) [m] the markers' places in their links' frames."""
    packing: Packing
    """The numbers of the shape that each marker depends on, C of them."""
    prior: PoseBounds
    """What is expected of poses."""


class Room(NamedTuple):
    """One frame, placed and linearised; everything in it is written by a kernel."""

    turn: Floats
    """(L, 3, 3) rotation of each link, as `chain.place_links` writes it."""
    origin: Floats
    """(L, 3) [m] origin of each link, likewise."""
    hinge: Floats
    """(L, 6) column of each hinge, likewise."""
    point: Floats
    """(M, 3) [m] markers relative to the root's origin."""
    residual: Floats
    """(M, 3) [m] measured less modelled."""
    weight: Floats
    """(M,) [1/m^2] robust weights."""
    by_pose: Floats
    """(M, 3, P) [1, m/rad] derivative of the markers by the pose."""
    by_shape: Floats
    """(M, 3, C) [1, m/rad] derivative of the markers by the shape, packed."""


class Measured(NamedTuple):
    """What was measured of M markers in T frames, and how it counts."""

    places: Floats
    """(T, M, 3) [m] anything where the weight is 0."""
    weights: Floats
    """(T, M) [1/m^2]"""
    soft: float
    """[1/m^2] of the robust loss; 0 for plain least squares."""


class Eliminated(NamedTuple):
    """Equations of T frames, their poses eliminated."""

    lower: Floats
    """(T, P, P) the factors L of H."""
    reduced: Floats
    """(T, P, N) A = inv(L) M."""
    rest: Floats
    """(T, P, 1) y = inv(L) g."""
    square: Floats
    """(N, N) S, before the poses are eliminated."""
    slope: Floats
    """(N,) b, before the poses are eliminated."""


def make_room(body: Body) -> Room:
    """Return room for one frame of ``body``."""
    links, markers = len(body.links.parent), len(body.link)
    return Room(
        turn=np.zeros((links, 3, 3)),
        origin=np.zeros((links, 3)),
        hinge=np.zeros((links, 6)),
        point=np.zeros((markers, 3)),
        residual=np.zeros((markers, 3)),
        weight=np.zeros(markers),
        by_pose=np.zeros((markers, 3, 5 + links)),
        by_shape=np.zeros((markers, 3, body.packing.column.shape[1])),
    )


@jit
def frame_cost(
    pose: Floats, target: Floats, weight: Floats, soft: float, body: Body, room: Room
) -> float:
    """Return a frame's cost, and write the frame.

    Parameters
    ----------
    pose : (7 + D,) translation [m], quaternion, angles [rad].
    target : (M, 3) [m]; anything where the weight is 0.
    weight : (M,) [1/m^2]
    soft : [1/m^2] of the robust loss; 0 for plain least squares.
    body : the hand.
    room : links, places, residuals and robust weights are overwritten.
    """
    links, prior = body.links, body.prior
    place_links(
        pose,
        links.parent,
        links.offset,
        links.axis,
        room.turn,
        room.origin,
        room.hinge,
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
    for d in range(prior.centre.shape[0]):
        q = pose[7 + d]
        low, high = prior.limits[d, 0], prior.limits[d, 1]
        cost += prior.hold[d] * (q - prior.centre[d]) ** 2
        if q < low:
            cost += prior.bound * (q - low) ** 2
        elif q > high:
            cost += prior.bound * (q - high) ** 2
    return cost


@jit
def pose_equations(
    pose: Floats, body: Body, room: Room, square: Floats, slope: Floats
) -> None:
    """Write H and g of one frame.

    Parameters
    ----------
    pose : (7 + D,) translation [m], quaternion, angles [rad].
    body : the hand.
    room : the frame in this pose, as `frame_cost` writes it; its derivative by the
        pose is overwritten.
    square : (P, P) H; its lower triangle is overwritten.
    slope : (P,) g, overwritten.
    """
    prior, carries = body.prior, body.links.carries
    marker_jacobian(room.point, room.hinge, body.link, carries, room.by_pose)
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
    for d in range(prior.centre.shape[0]):
        q = pose[7 + d]
        low, high = prior.limits[d, 0], prior.limits[d, 1]
        square[6 + d, 6 + d] += prior.hold[d]
        slope[6 + d] += prior.hold[d] * (prior.centre[d] - q)
        if q < low:
            square[6 + d, 6 + d] += prior.bound
            slope[6 + d] += prior.bound * (low - q)
        elif q > high:
            square[6 + d, 6 + d] += prior.bound
            slope[6 + d] += prior.bound * (high - q)


@jit
def add_shape_equations(
    body: Body, room: Room, mixed: Floats, square: Floats, slope: Floats
) -> None:
    """Write M of one frame and add its part of S and b.

    Parameters
    ----------
    body : the hand.
    room : the frame, as `pose_equations` writes it; its derivative by the shape is
        overwritten.
    mixed : (P, N) M, overwritten in full.
    square : (N, N) S, added to in full.
    slope : (N,) b, added to.
    """
    column = body.packing.column
    shape_jacobian(
        room.turn,
        room.origin,
        room.point,
        body.links.parent,
        body.link,
        body.packing,
        room.by_shape,
    )
    mixed[:] = 0.0
    size, packed = mixed.shape[0], column.shape[1]
    for m in range(body.link.shape[0]):
        if room.weight[m] == 0.0:
            continue
        for row in range(3):
            for c in range(packed):
                at = column[m, c]
                if at < 0:
                    continue
                left = room.weight[m] * room.by_shape[m, row, c]
                slope[at] += left * room.residual[m, row]
                for a in range(size):
                    mixed[a, at] += left * room.by_pose[m, row, a]
                for b in range(packed):
                    if column[m, b] >= 0:
                        square[at, column[m, b]] += left * room.by_shape[m, row, b]


@jit
def costs(poses: Floats, measured: Measured, body: Body, room: Room) -> Floats:
    """Return the (T,) costs of all frames.

    Parameters
    ----------
    poses : (T, 7 + D)
    measured : the markers.
    body : the hand.
    room : work space.
    """
    out = np.zeros(poses.shape[0])
    targets, weights, soft = measured.places, measured.weights, measured.soft
    for f in range(poses.shape[0]):
        out[f] = frame_cost(poses[f], targets[f], weights[f], soft, body, room)
    return out


@jit
def eliminate(
    poses: Floats,
    measured: Measured,
    damping: float,
    body: Body,
    room: Room,
    numbers: int,
) -> Eliminated:
    """Return what is left of every frame's equations when its pose is eliminated.

    Parameters
    ----------
    poses : (T, 7 + D)
    measured : the markers.
    damping : by which the diagonal of each H is enlarged (Marquardt).
    body : the hand.
    room : work space.
    numbers : N, of the shape.
    """
    frames, size = poses.shape[0], poses.shape[1] - 1
    targets, weights, soft = measured.places, measured.weights, measured.soft
    lower = np.zeros((frames, size, size))
    reduced = np.zeros((frames, size, numbers))
    rest = np.zeros((frames, size, 1))
    square, slope = np.zeros((numbers, numbers)), np.zeros(numbers)
    line = np.zeros(size)
    for f in range(frames):
        frame_cost(poses[f], targets[f], weights[f], soft, body, room)
        pose_equations(poses[f], body, room, lower[f], line)
        add_shape_equations(body, room, reduced[f], square, slope)
        for a in range(size):
            lower[f, a, a] += damping * lower[f, a, a] + DIAGONAL_ADDED
            rest[f, a, 0] = line[a]
        factor(lower[f])
        forward(lower[f], reduced[f])
        forward(lower[f], rest[f])
    return Eliminated(lower, reduced, rest, square, slope)


@jit
def follow(poses: Floats, equations: Eliminated, shape_step: Floats) -> Floats:
    """Return the (T, 7 + D) poses after the steps that go with a step of the shape.

    Parameters
    ----------
    poses : (T, 7 + D) before.
    equations : of these poses.
    shape_step : (N,)
    """
    lower, reduced, rest = equations.lower, equations.reduced, equations.rest
    step, out = np.zeros(lower.shape[1]), np.zeros(poses.shape)
    for f in range(poses.shape[0]):
        for a in range(step.shape[0]):
            total = rest[f, a, 0]
            for n in range(shape_step.shape[0]):
                total -= reduced[f, a, n] * shape_step[n]
            step[a] = total
        backward(lower[f], step)
        move(poses[f], step, out[f])
    return out
