"""Touching fingertips: the joint angles that bring them together (IK sampling).

Wang & Neff (2013), section 5.2. Angles theta start where the readings put them and
move, until the fingertip l is at its aim d, by

    d theta = J^T (J J^T + lambda^2 I)^-1 e + (I - J^+ J) z                 (2)

with e = d - l clamped to a length (3), lambda growing with |d - l|^2, and
z = -c grad (theta - middle)^2 (towards the middle of the range: the paper's sign is the
other way, see its errata), c smaller for the thumb; steps that lead further out of a
joint's range are scaled by w < 1. Where the tips meet is found by maximising the
probability of their angles,

    p(theta) = prod_v N(theta_v; m_v, sigma_v)                              (4)
    d = argmin sum_fingers -log p(theta at d)                               (5, 6)

m being the start. Starting at the most probable point for Gaussians of the tips, Gauss
and Newton's steps use the IK's own derivative, d theta / d d = J^+. All frames are
solved together. The angles are a glove's measured rotations; what follows them (DIPs,
pronation) follows here as well, so that the result can be reached by a calibration.
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

INDEPENDENT, COUPLED = np.radians(3.0), np.radians(6.0)
"""[rad] sigma of a rotation's start, by one sensor and by several (section 5.2.3)."""

_LONGEST = 0.02  # [m] e_max of equation 3
_DAMPING = 6.0  # [1/m] lambda = this |d - l|^2, in metres
_STIFF, _STIFF_THUMB = 0.01, 0.004  # c: share of the way to mid-range in a step, halved
_SUPPRESS = 0.1  # w
_NEAR = 2e-5  # [m] where a tip counts as there
_UNMET = 1e-4  # [m] a finger this far from its aim costs as much as a sigma
_STEPS, _ROUNDS = 60, 12


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


@dataclass(frozen=True, kw_only=True)
class Touch:
    """Where fingertips met.

    Attributes
    ----------
    rotations : (T, R') [rad] measured rotations, NaN for fingers that do not touch.
    place : (T, 3) [m] where, in the hand's frame.
    apart : (T,) [m] how far the farthest tip stayed from there.
    cost : (T,) half the sum of squares of (theta - m) / sigma.
    """

    rotations: Floats
    place: Floats
    apart: Floats
    cost: Floats


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
                stiff=_STIFF_THUMB if finger == "thumb" else _STIFF,
            )
        )
    return out


def start_sigma(glove: Glove) -> Floats:
    """(R',) [rad] how far off the rescaled readings are taken to be."""
    return np.array(
        [INDEPENDENT if row.kind == "1S1R" else COUPLED for row in glove.measured]
    )


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
    busy = apart > _NEAR
    for _ in range(_STEPS):
        if not busy.any():
            break
        j, error = slopes[busy], (aim - tips)[busy]
        size = apart[busy]
        error = error * np.minimum(1.0, _LONGEST / size)[:, None]  # (3)
        square = j @ j.transpose(0, 2, 1)
        damped = square + ((_DAMPING * size**2) ** 2)[:, None, None] * np.eye(3)
        step = (j.transpose(0, 2, 1) @ np.linalg.solve(damped, error[:, :, None]))[
            ..., 0
        ]
        z = -2.0 * chain.stiff * (angles[busy] - middle)
        step += z - _project(j, square, z)  # (2)
        now = angles[busy]
        out = ((now > chain.high) & (step > 0.0)) | ((now < chain.low) & (step < 0.0))
        angles[busy] = now + np.where(out, _SUPPRESS, 1.0) * step
        tips[busy], slopes[busy] = tip_and_slope(chain, angles[busy])
        apart = np.linalg.norm(aim - tips, axis=1)
        busy &= apart > _NEAR
    return angles, tips, slopes


def _project(j: Floats, square: Floats, z: Floats) -> Floats:
    """J^+ J z, with a pseudo-inverse that bears singular postures."""
    inner = np.linalg.solve(square + 1e-9 * np.eye(3), j @ z[:, :, None])
    out: Floats = (j.transpose(0, 2, 1) @ inner)[..., 0]
    return out


def meet(glove: Glove, chains: Sequence[Chain], start: Floats, sigma: Floats) -> Touch:
    """Find where fingertips touch, and the rotations that bring them there.

    Parameters
    ----------
    start : (T, R') [rad] measured rotations as the readings put them, m.
    sigma : (T, R') or (R',) [rad] how far off these are taken to be.
    """
    sigma = np.broadcast_to(sigma, start.shape)
    aim = _first_aim(chains, start, sigma)
    best_cost = np.full(len(start), np.inf)
    best: list[Floats] = [start[:, chain.columns] for chain in chains]
    place, best_apart = aim.copy(), np.full(len(start), np.inf)
    for number in range(_ROUNDS):
        unmet = max(1e-3 * 0.5**number, _UNMET)
        pull, bend = np.zeros((len(start), 3)), np.zeros((len(start), 3, 3))
        cost, apart = np.zeros(len(start)), np.zeros(len(start))
        found = []
        for chain in chains:
            m, s = start[:, chain.columns], sigma[:, chain.columns]
            angles, tips, slopes = reach(chain, m, aim)
            away = np.linalg.norm(aim - tips, axis=1)
            found.append(angles)
            apart = np.maximum(apart, away)
            off = (angles - m) / s
            cost += 0.5 * (off**2).sum(axis=1)
            square = slopes @ slopes.transpose(0, 2, 1) + 1e-9 * np.eye(3)
            follow = np.linalg.solve(square, slopes) / s[:, None, :]  # (J^+)^T / sigma
            pull += (follow @ off[:, :, None])[..., 0]
            bend += follow @ follow.transpose(0, 2, 1)
            short = (away > 2.0 * _NEAR)[:, None] / unmet**2  # out of this reach
            pull += short * (aim - tips)
            bend += short[:, :, None] * np.eye(3)
        score = cost + 0.5 * (apart / _UNMET) ** 2  # where no finger reaches is worse
        better = score < best_cost
        best_cost = np.where(better, score, best_cost)
        best_apart = np.where(better, apart, best_apart)
        place[better] = aim[better]
        for kept, angles in zip(best, found, strict=True):
            kept[better] = angles[better]
        if not better.any():
            break
        step = -np.linalg.solve(bend, pull[:, :, None])[..., 0]
        size = np.linalg.norm(step, axis=1, keepdims=True)
        aim = np.where(
            better[:, None],
            aim + step * np.minimum(1.0, _LONGEST / np.maximum(size, 1e-12)),
            0.5 * (aim + place),
        )
    rotations = np.full(start.shape, np.nan)
    total, count = np.zeros(start.shape), np.zeros(start.shape[1])
    for chain, angles in zip(chains, best, strict=True):
        total[:, chain.columns] += angles
        count[chain.columns] += 1.0
    rotations[:, count > 0] = total[:, count > 0] / count[count > 0]
    return Touch(rotations=rotations, place=place, apart=best_apart, cost=best_cost)


def _first_aim(chains: Sequence[Chain], start: Floats, sigma: Floats) -> Floats:
    """(T, 3) [m] the most probable common point if tips were Gaussian."""
    weight, total = np.zeros((len(start), 3, 3)), np.zeros((len(start), 3, 1))
    for chain in chains:
        tips, slopes = tip_and_slope(chain, start[:, chain.columns])
        spread = slopes * sigma[:, None, chain.columns]
        inverse = np.linalg.inv(spread @ spread.transpose(0, 2, 1) + 1e-7 * np.eye(3))
        weight = weight + inverse
        total = total + inverse @ tips[:, :, None]
    return np.asarray(np.linalg.solve(weight, total)[..., 0])
