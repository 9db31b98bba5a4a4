"""Touching fingertips: the joint angles that bring them together (IK sampling).

Wang & Neff (2013), section 5.2. Where the tips meet is found by maximising the
probability of their angles,

    p(theta) = prod_v N(theta_v; m_v, sigma_v)                              (4)
    d = argmin sum_fingers -log p(theta at d)                               (5, 6)

m being the start, where the readings put them. Starting at the most probable point for
Gaussians of the tips, Gauss and Newton's steps use the derivative of `reach`,
d theta / d d = J^+. All frames are solved together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.glove.gloves import Glove
from handclean.glove.reach import (
    MOST_ERROR_M,
    REACHED_M,
    RIDGE,
    Chain,
    reach,
    tip_and_slope,
)

ONE_SENSOR_SD_RAD, SEVERAL_SENSORS_SD_RAD = np.radians(3.0), np.radians(6.0)
"""[rad] sigma of a rotation's start, by one sensor and by several (section 5.2.3)."""

_MISSED_SD_M = 1e-4
"""[m] a tip this far from its aim costs as much as an angle one sigma off (chosen)."""

_FIRST_MISSED_SD_M = 1e-3
"""[m] the same in the first round; it is halved each round (chosen)."""

_MOST_ROUNDS = 12
"""Aims that are tried, at most (chosen)."""

_TIP_VARIANCE_M2 = 1e-7
"""[m^2] variance of a tip beyond that of its angles (chosen)."""


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


def start_sigma(glove: Glove) -> Floats:
    """Return how far off rescaled readings are taken to be where touching starts.

    Returns
    -------
    (R',) [rad] in the order of ``glove.measured``

    References
    ----------
    Wang & Neff (2013), section 5.2.3.
    """
    return np.array(
        [
            ONE_SENSOR_SD_RAD if row.kind == "1S1R" else SEVERAL_SENSORS_SD_RAD
            for row in glove.measured
        ]
    )


@dataclass(frozen=True, kw_only=True)
class _Reached:
    """How fingers reached one aim per frame.

    Attributes
    ----------
    angles : of each chain, (T, V) [rad].
    apart : (T,) [m] the farthest tip's distance from the aim.
    cost : (T,) half the sum of squares of (theta - m) / sigma.
    slope, curvature : (T, 3) [1/m] and (T, 3, 3) [1/m^2] of the cost at the aim, with
        what tips that do not reach it add.
    """

    angles: tuple[Floats, ...]
    apart: Floats
    cost: Floats
    slope: Floats
    curvature: Floats

    @property
    def score(self) -> Floats:
        """(T,) the cost, and what no finger reaches."""
        score: Floats = self.cost + 0.5 * (self.apart / _MISSED_SD_M) ** 2
        return score


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
    for number in range(_MOST_ROUNDS):
        missed_sd = max(_FIRST_MISSED_SD_M * 0.5**number, _MISSED_SD_M)
        found = _reach_all(chains, start, sigma, aim, missed_sd)
        score = found.score
        better = score < best_cost
        best_cost = np.where(better, score, best_cost)
        best_apart = np.where(better, found.apart, best_apart)
        place[better] = aim[better]
        for kept, angles in zip(best, found.angles, strict=True):
            kept[better] = angles[better]
        if not better.any():
            break
        step = _newton_step(found)
        aim = np.where(better[:, None], aim + step, 0.5 * (aim + place))
    return Touch(
        rotations=_together(chains, best, start.shape),
        place=place,
        apart=best_apart,
        cost=best_cost,
    )


def _reach_all(
    chains: Sequence[Chain], start: Floats, sigma: Floats, aim: Floats, missed_sd: float
) -> _Reached:
    """Move all fingers to an aim (T, 3) [m]; missed ones cost by ``missed_sd``."""
    slope, curvature = np.zeros((len(start), 3)), np.zeros((len(start), 3, 3))
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
        square = slopes @ slopes.transpose(0, 2, 1) + RIDGE * np.eye(3)
        follow = np.linalg.solve(square, slopes) / s[:, None, :]  # (J^+)^T / sigma
        slope += (follow @ off[:, :, None])[..., 0]
        curvature += follow @ follow.transpose(0, 2, 1)
        missed = (away > 2.0 * REACHED_M)[:, None] / missed_sd**2
        slope += missed * (aim - tips)
        curvature += missed[:, :, None] * np.eye(3)
    return _Reached(
        angles=tuple(found), apart=apart, cost=cost, slope=slope, curvature=curvature
    )


def _newton_step(found: _Reached) -> Floats:
    """(T, 3) [m] steps of the aim, clamped to a length."""
    step = -np.linalg.solve(found.curvature, found.slope[:, :, None])[..., 0]
    size = np.linalg.norm(step, axis=1, keepdims=True)
    clamped: Floats = step * np.minimum(1.0, MOST_ERROR_M / np.maximum(size, 1e-12))
    return clamped


def _together(
    chains: Sequence[Chain], angles: Sequence[Floats], shape: tuple[int, ...]
) -> Floats:
    """(T, R') [rad] rotations of all chains, the mean where several share one."""
    rotations = np.full(shape, np.nan)
    total, count = np.zeros(shape), np.zeros(shape[1])
    for chain, own in zip(chains, angles, strict=True):
        total[:, chain.columns] += own
        count[chain.columns] += 1.0
    rotations[:, count > 0] = total[:, count > 0] / count[count > 0]
    return rotations


def _first_aim(chains: Sequence[Chain], start: Floats, sigma: Floats) -> Floats:
    """(T, 3) [m] the most probable common point if tips were Gaussian."""
    weight, total = np.zeros((len(start), 3, 3)), np.zeros((len(start), 3, 1))
    for chain in chains:
        tips, slopes = tip_and_slope(chain, start[:, chain.columns])
        spread = slopes * sigma[:, None, chain.columns]
        square = spread @ spread.transpose(0, 2, 1)
        inverse = np.linalg.inv(square + _TIP_VARIANCE_M2 * np.eye(3))
        weight = weight + inverse
        total = total + inverse @ tips[:, :, None]
    return np.asarray(np.linalg.solve(weight, total)[..., 0])
