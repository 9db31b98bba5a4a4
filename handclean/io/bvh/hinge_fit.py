"""Hinge angles from rotation matrices: rest rotations, axes and what hinges leave.

For a bone with rotation M(t) against its parent bone, the rest rotation Q (own frame to
S, the hand's side-free frame, in the zero posture) is sought with

    ``Q_parent M(t) = H(t) Q``,   ``H(t) = Rot(a1, angle1) Rot(a2, angle2)``

where the a are hinge axes in S. In a left-handed file, or for a right hand, Q is a
reflection; H is a rotation all the same. Below, ``turned`` is ``Q_parent M(t)``,
``along`` is where the bone points in the zero posture, in S, and ``own`` where it
points in its own frame.

One hinge
    Its axis is the principal axis of the rotations ``turned`` about their mean, on the
    side of the tree's axis. Its zero is where the finger is straight: seen along the
    axis, the bone lies as in the tree's zero posture.
Two hinges
    The axes are the tree's. Q puts the bone where it lies in the zero posture, turned
    about itself so that what is left is smallest.

What is left, ``H(t)^T turned Q^T``, no hinge can hold; it is reported, and so is by how
much an axis found leans from the tree's.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats
from handclean.io.shared.rotations import about_line, rotation_angle

_STILL_RMS_RAD = np.radians(2.0)
"""[rad] RMS motion below which an axis cannot be found: the tree's is taken
(chosen)."""

_FITTED_FRAMES = 400
"""Frames from which a rest rotation is found, at most twice as many (chosen)."""

_MOST_SWEEPS = 50
"""Rounds in which two angles, or a rest rotation, are set in turn, at most (chosen)."""

_ABDUCTION_WEIGHT = 0.01
"""[-] weight of abduction against residual rotation; tells a bone from its half turn
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class BoneFit:
    """How well hinges hold what one bone did.

    Attributes
    ----------
    rms_deg, max_deg : [degrees] rotation that the bone's hinges cannot hold.
    tilt_deg : [degrees] from the tree's axis to the one found; 0 if that is not sought.
    """

    rms_deg: float
    max_deg: float
    tilt_deg: float


class Hinged(NamedTuple):
    """A bone's motion as its hinges hold it.

    Attributes
    ----------
    angles : (T, 1 or 2) [rad]
    rest : (3, 3) rest rotation.
    fit : how well.
    """

    angles: Floats
    rest: Floats
    fit: BoneFit


def fit_hinges(turned: Floats, axes: Floats, along: Floats, own: Floats) -> Hinged:
    """Find the hinge angles of one bone.

    Parameters
    ----------
    turned : (T, 3, 3) rotation of the bone's frame to S, the parent bone at rest.
    axes : (1 or 2, 3) hinge axes of the tree in S; two are perpendicular.
    along : (3,) where the bone points in the zero posture, in S.
    own : (3,) where it points in its own frame.
    """
    found = axes
    if len(axes) == 1:
        found = principal(turned, axes[0], _STILL_RMS_RAD, _mean(turned))[None]
        angles, rest = _one_hinge(turned, found[0], along, own)
    else:
        rest = _rest_of_two(turned, axes, along, own)
        angles = two_hinges(turned @ rest.T, axes)
    left = left_over(turned, angles, found, rest)
    return Hinged(angles, rest, fit_of(left, found, axes))


def fit_of(left: Floats, found: Floats, axes: Floats) -> BoneFit:
    """Sum up what hinges leave, (T, 3, 3), and how far axes lean from the tree's."""
    degrees = np.degrees(rotation_angle(left))
    lean = np.clip(np.sum(found * axes, axis=1), -1.0, 1.0)
    return BoneFit(
        rms_deg=float(np.sqrt(np.mean(degrees**2))),
        max_deg=float(degrees.max()),
        tilt_deg=float(np.degrees(np.arccos(lean)).max()),
    )


def _mean(turned: Floats) -> Floats:
    """(3, 3) orthogonal matrix nearest to the mean of (T, 3, 3)."""
    u, _, v = np.linalg.svd(turned.mean(axis=0))
    return np.array(u @ v)


def _sines(turn: Floats) -> Floats:
    """(T, 3) axis of each rotation times the sine of its angle."""
    return 0.5 * np.stack(
        [
            turn[:, 2, 1] - turn[:, 1, 2],
            turn[:, 0, 2] - turn[:, 2, 0],
            turn[:, 1, 0] - turn[:, 0, 1],
        ],
        axis=1,
    )


def twist(turn: Floats, axis: Floats) -> Floats:
    """(T,) [rad] angle about an axis that leaves the smallest rotation."""
    trace = np.einsum("tii->t", turn)
    along = np.einsum("i,tij,j->t", axis, turn, axis)
    angle: Floats = np.arctan2(2.0 * _sines(turn) @ axis, trace - along)
    return angle


def principal(turned: Floats, hint: Floats, still: float, middle: Floats) -> Floats:
    """(3,) axis of rotations about a middle one, or the hint where they are too small.

    Parameters
    ----------
    still : [rad] RMS motion below which they are.
    """
    sines = _sines(turned @ middle.T)
    spread, axes = np.linalg.eigh(sines.T @ sines / len(sines))
    if spread[2] < still**2:
        return hint
    axis: Floats = axes[:, 2]
    return axis if axis @ hint > 0 else -axis


def _one_hinge(
    turned: Floats, axis: Floats, along: Floats, own: Floats
) -> tuple[Floats, Floats]:
    """(T,) [rad] angles from straight and (3, 3) the rest rotation."""
    middle = _mean(turned)
    now = middle @ own
    sine, cosine = axis @ np.cross(along, now), along @ now
    bent = np.arctan2(sine, cosine - (axis @ along) * (axis @ now))
    rest = about_line(axis, np.array([-bent]))[0] @ middle
    return twist(turned @ rest.T, axis)[:, None], rest


def two_hinges(turn: Floats, axes: Floats, first: Floats | None = None) -> Floats:
    """(T, 2) [rad] angles of ``Rot(a1) Rot(a2)`` nearest to (T, 3, 3) rotations.

    ``first`` (T,) is where to start the first angle; each is then set in turn.
    """
    first = np.zeros(len(turn)) if first is None else first
    for _ in range(_MOST_SWEEPS):
        last = first
        second = twist(about_line(axes[0], -first) @ turn, axes[1])
        first = twist(turn @ about_line(axes[1], -second), axes[0])
        if np.abs(first - last).max() < 1e-12:
            break
    return np.column_stack([first, second])


def _rest_of_two(turned: Floats, axes: Floats, along: Floats, own: Floats) -> Floats:
    """(3, 3) rest rotation that puts the bone in place and leaves least, by turns."""
    sample = turned[:: max(1, len(turned) // _FITTED_FRAMES)]
    start = _onto(along, own, reflect=bool(np.linalg.det(sample[0]) < 0))
    best, rest = np.inf, start
    for quarter in range(4):
        trial = about_line(along, np.array([quarter * np.pi / 2]))[0] @ start
        angles = np.zeros((len(sample), 2))
        for _ in range(_MOST_SWEEPS):
            angles = two_hinges(sample @ trial.T, axes, angles[:, 0])
            left = left_over(sample, angles, axes, trial)
            turn = twist(_mean(left)[None], along)
            trial = about_line(along, turn)[0] @ trial
            if abs(turn[0]) < 1e-9:
                break
        price = np.mean(rotation_angle(left) ** 2)
        price += _ABDUCTION_WEIGHT * np.mean(angles[:, 0] ** 2)
        if price < best:
            best, rest = float(price), trial
    return rest


def _onto(along: Floats, own: Floats, *, reflect: bool) -> Floats:
    """(3, 3) some rotation, or reflection, that takes ``own`` to ``along``."""

    def frame(first: Floats, sign: float) -> Floats:
        second = np.eye(3)[np.argmin(np.abs(first))]
        second = second - (second @ first) * first
        second /= np.linalg.norm(second)
        return np.column_stack([first, second, sign * np.cross(first, second)])

    return frame(along, 1.0) @ frame(own, -1.0 if reflect else 1.0).T


def left_over(turned: Floats, angles: Floats, axes: Floats, rest: Floats) -> Floats:
    """(T, 3, 3) what the hinges leave of a bone's rotation."""
    out: Floats = turned @ rest.T
    for axis, angle in zip(axes, angles.T, strict=True):
        out = about_line(axis, -angle) @ out
    return out
