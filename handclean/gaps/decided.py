"""Which joints the markers in sight decide, and which they would if none were hidden.

With marker noise sigma per axis and a loose prior of the joints, the posterior of a
frame's step is Gaussian with precision J^T J / sigma^2 + prior. A degree of freedom is
*decided* if the markers explain at least `DECIDED` of its prior variance. It is
*affected* by missing markers if those in sight do not decide it while those expected
(in sight, or in a gap short enough to fill) would explain distinctly more.

So a marker further out decides the chain it hangs on (Maycock 2015 section III-C) as
far as the geometry allows, and a joint without any marker beyond it is not affected by
anything, except through the posture subspace: with a prior, joints that follow it are
affected in every frame in which some other joint is (Schroeder 2017, "Fully automatic
tracking").

The Jacobian is taken once per stretch of frames in which the same markers are in sight,
or several times in a long one.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.hand.model import Model, jacobian
from handclean.ik.frames import LOOSE
from handclean.tree import ROOT_DOFS

DECIDED = 0.9
"""Share of its variance that markers must explain for a joint to count as known."""

DISTINCT = 0.05
"""How much more of it the missing markers should explain for them to matter."""

ROOT_SPREAD = (0.05, 0.5)
"""[m], [rad] loose prior of the root's translation and rotation."""

LONGEST = 100
"""Frames for which one Jacobian serves."""

LEAST = 3
"""Markers without which inverse kinematics keeps the pose it had."""


@dataclass(frozen=True, kw_only=True)
class Decided:
    """What the markers in sight decide.

    Attributes
    ----------
    affected : (T, D) hinges that missing markers leave open.
    root : (T,) whether they leave the root open.
    sigma : (T, D) [rad] standard deviation of each hinge, NaN where nothing decides it.
    """

    affected: Bools
    root: Bools
    sigma: Floats


def prior_precision(hinges: int) -> Floats:
    """(6 + D,) of the loose prior."""
    spread = np.concatenate(
        [np.repeat(ROOT_SPREAD, ROOT_DOFS // 2), np.full(hinges, LOOSE)]
    )
    return np.asarray(1.0 / spread**2)


def posterior(columns: Floats, seen: Bools, noise: Floats, precision: Floats) -> Floats:
    """(6 + D, 6 + D) covariance of a step, given the markers in sight.

    Parameters
    ----------
    columns : (M, 3, 6 + D) Jacobian.
    seen : (M,)
    noise : (M,) [m] standard deviation per axis.
    precision : (6 + D,) of the prior.
    """
    rows = (columns[seen] / noise[seen, None, None]).reshape(-1, columns.shape[2])
    matrix = rows.T @ rows
    matrix[np.diag_indices_from(matrix)] += precision
    return np.asarray(np.linalg.inv(matrix))


def decide(
    model: Model,
    poses: Floats,
    seen: Bools,
    expected: Bools,
    noise: Floats,
    nominal_m: float,
    *,
    follows: bool,
) -> Decided:
    """Find what the markers in sight decide in every frame.

    Parameters
    ----------
    poses : (T, 7 + D) roughly right.
    seen, expected : (T, M) markers in sight; those and the ones hidden only briefly.
    noise : (M,) [m] standard deviation of a marker per axis.
    nominal_m : [m] noise at which a joint must be decided to count as known: the one
        inverse kinematics weighs its prior with.
    follows : whether joints that nothing decides follow a posture subspace.
    """
    frames, hinges = len(poses), len(model.tree.hinges)
    precision = prior_precision(hinges)
    nominal = np.full(len(model.labels), nominal_m)
    affected = np.zeros((frames, hinges), dtype=bool)
    root, sigma = np.zeros(frames, dtype=bool), np.full((frames, hinges), np.nan)
    for start, stop in _stretches(seen, expected):
        columns = jacobian(model, poses[(start + stop) // 2])
        here, hoped = seen[start], expected[start]
        share = _share(columns, here, nominal, precision)
        weak = share < DECIDED
        spread = np.sqrt(np.diag(posterior(columns, here, noise, precision)))
        sigma[start:stop] = np.where(weak, np.nan, spread)[ROOT_DOFS:]
        if np.array_equal(here, hoped) or not weak.any():
            continue
        weak &= share < _share(columns, hoped, nominal, precision) - DISTINCT
        if np.count_nonzero(here) < LEAST <= np.count_nonzero(hoped):
            weak[:] = True
        if follows and weak.any():
            weak[ROOT_DOFS:] |= share[ROOT_DOFS:] < DECIDED
        root[start:stop] = weak[:ROOT_DOFS].any()
        affected[start:stop] = weak[ROOT_DOFS:]
    return Decided(affected=affected, root=root, sigma=sigma)


def _stretches(seen: Bools, expected: Bools) -> list[tuple[int, int]]:
    """Frames that go together, as (start, stop)."""
    frames = len(seen)
    changes = np.any(np.diff(np.hstack([seen, expected]), axis=0), axis=1)
    regular = np.arange(0, frames, LONGEST)
    edges = np.union1d(np.flatnonzero(changes) + 1, np.append(regular, frames))
    return [(int(a), int(b)) for a, b in zip(edges[:-1], edges[1:], strict=True)]


def _share(columns: Floats, seen: Bools, noise: Floats, precision: Floats) -> Floats:
    """(6 + D,) share of the prior variance that markers explain."""
    return np.asarray(
        1.0 - np.diag(posterior(columns, seen, noise, precision)) * precision
    )
