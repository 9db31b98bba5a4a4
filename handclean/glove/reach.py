"""Fingers that reach for a point: clamped, damped least squares.

Wang & Neff (2013), section 5.2. Angles theta start where the readings put them and
move, until the fingertip l is at its aim d, by

    d theta = J^T (J J^T + lambda^2 I)^-1 e + (I - J^+ J) z                 (2)

with e = d - l clamped to a length (3), lambda growing with |d - l|^2, and
z = -c grad (theta - middle)^2 (towards the middle of the range: the paper's sign is the
other way, see its errata), c smaller for the thumb; steps that lead further out of a
joint's range are scaled by w < 1. All frames are solved together. The angles are a
glove's measured rotations; what follows them (DIPs, pronation) follows here as well, so
that the result can be reached by a calibration.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import UsageError
from handclean.glove.gloves import Glove
from handclean.glove.hands import fingertips
from handclean.hand.model import Model, jacobian, marker_positions
from handclean.hand.template import FINGERS
from handclean.tree import POSE_HEAD, ROOT_DOFS, JointTree

MOST_ERROR_M = 0.02
"""[m] e_max, the length to which errors are clamped (equation 3; chosen)."""

_DAMPING_PER_M = 6.0
"""[1/m] lambda is this times the squared distance to the aim in metres (chosen)."""

_STIFFNESS, _THUMB_STIFFNESS = 0.01, 0.004
"""[-] c: half the share of the way to mid-range that a step goes (chosen)."""

_OUTWARD_STEP_FACTOR = 0.1
"""[-] w of steps that lead further out of a joint's range (chosen)."""

REACHED_M = 2e-5
"""[m] a tip this close to its aim has reached it (chosen)."""

_MOST_STEPS = 60
"""Steps of a tip to its aim, at most (chosen)."""

RIDGE = 1e-9
"""Added to J J^T, so that singular postures have an inverse (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Chain:
    """A finger from the hand to its tip, in measured rotations.

    Attributes
    ----------
    model : the hand with this finger's tip as its only marker.
    columns : V measured rotations that move the tip.
    couple : (D, R') hinge angles from measured rotations; offset : (D,) [rad].
    low, high : (V,) [rad] range of each.
    stiff : stiffness c.
    """

    model: Model
    columns: Ints
    couple: Floats
    offset: Floats
    low: Floats
    high: Floats
    stiff: float


def chains_of(glove: Glove, tree: JointTree, fingers: Sequence[str]) -> list[Chain]:
    """Return the chains of fingers that touch.

    Parameters
    ----------
    tree : hand as the glove's definition has it, see `GloveHand.tree`.

    Raises
    ------
    UsageError
        If there are fewer than two, or one is no finger.
    """
    for finger in fingers:
        if finger not in FINGERS:
            raise UsageError(
                f"--touch: no finger is called '{finger}'; known: {', '.join(FINGERS)}"
            )
    if len(set(fingers)) < 2:
        raise UsageError("--touch: names one finger; touching takes two or more")
    factor, rest = glove.completion()
    matrix = glove.hand.to_hinges(tree.hinges)
    couple, offset = matrix @ factor, matrix @ rest
    ends = [glove.hand.ranges[glove.hand.index(r.rotation)] for r in glove.measured]
    model = fingertips(tree)
    carried = tree.carried_by()
    out = []
    for finger in dict.fromkeys(fingers):
        moves = carried[tree.bone(f"{finger}_distal")]
        columns = np.flatnonzero(np.abs(couple[moves]).sum(axis=0) > 0.0)
        out.append(
            Chain(
                model=model.selected((f"{finger}_tip",)),
                columns=columns,
                couple=couple,
                offset=offset,
                low=np.array([ends[c][0] for c in columns]),
                high=np.array([ends[c][1] for c in columns]),
                stiff=_THUMB_STIFFNESS if finger == "thumb" else _STIFFNESS,
            )
        )
    return out


def tip_and_slope(chain: Chain, angles: Floats) -> tuple[Floats, Floats]:
    """(T, 3) [m] the tip and (T, 3, V) [m/rad] its derivative at (T, V) angles."""
    poses = np.zeros((len(angles), POSE_HEAD + len(chain.offset)))
    poses[:, 3] = 1.0
    own = chain.couple[:, chain.columns]
    poses[:, POSE_HEAD:] = chain.offset + angles @ own.T
    tips = marker_positions(chain.model, poses)[:, 0]
    slopes = np.array([jacobian(chain.model, pose)[0] for pose in poses])
    return tips, slopes[:, :, ROOT_DOFS:] @ own


def reach(chain: Chain, start: Floats, aim: Floats) -> tuple[Floats, Floats, Floats]:
    """Move fingertips to their aims by clamped, damped least squares (2, 3).

    Parameters
    ----------
    start : (T, V) [rad]; aim : (T, 3) [m].

    Returns
    -------
    (T, V) [rad] angles, (T, 3) [m] where the tips came to, (T, 3, V) slopes there.
    """
    angles = start.copy()
    middle = 0.5 * (chain.low + chain.high)
    tips, slopes = tip_and_slope(chain, angles)
    apart = np.linalg.norm(aim - tips, axis=1)
    busy = apart > REACHED_M
    for _ in range(_MOST_STEPS):
        if not busy.any():
            break
        j, error = slopes[busy], (aim - tips)[busy]
        size = apart[busy]
        error = error * np.minimum(1.0, MOST_ERROR_M / size)[:, None]  # (3)
        square = j @ j.transpose(0, 2, 1)
        damped = square + ((_DAMPING_PER_M * size**2) ** 2)[:, None, None] * np.eye(3)
        step = (j.transpose(0, 2, 1) @ np.linalg.solve(damped, error[:, :, None]))[
            ..., 0
        ]
        z = -2.0 * chain.stiff * (angles[busy] - middle)
        step += z - _project(j, square, z)  # (2)
        now = angles[busy]
        out = ((now > chain.high) & (step > 0.0)) | ((now < chain.low) & (step < 0.0))
        angles[busy] = now + np.where(out, _OUTWARD_STEP_FACTOR, 1.0) * step
        tips[busy], slopes[busy] = tip_and_slope(chain, angles[busy])
        apart = np.linalg.norm(aim - tips, axis=1)
        busy &= apart > REACHED_M
    return angles, tips, slopes


def _project(j: Floats, square: Floats, z: Floats) -> Floats:
    """J^+ J z, with a pseudo-inverse that bears singular postures."""
    inner = np.linalg.solve(square + 1e-9 * np.eye(3), j @ z[:, :, None])
    out: Floats = (j.transpose(0, 2, 1) @ inner)[..., 0]
    return out
