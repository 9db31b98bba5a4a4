"""How uncertain joint angles are: ``angles_sigma``.

Three things, added as variances:

- What the markers in sight leave open, with their noise and the prior of the angles
  (the posture subspace and deviations from it, or a loose one without a prior). Markers
  that a pose follows wherever they go have small residuals whatever their noise; so the
  noise of each is at least that of all together.
- On a path through a gap, what the path may be off (see `gaps.posture`).
- The zero. Where a subject has a bone and its markers turned about the hinge, all
  angles of a take are off by a constant, and residuals do not tell: the markers' places
  are turned with it. What holds the zero is how well places are known beforehand, the
  further from the hinge the better ::

      sigma_zero = s / sqrt(sum of squared distances, from the hinge's axis, of the
                            markers and joints on the bone that it moves)

  With one marker on the last bone of a finger that is several degrees. Simulated
  subjects calibrated from a range-of-motion take have s = 0.7 to 2.5 mm over hinges
  whose zeros are off by 0.6 to 6 degrees. A subject knows its s: the uncertainty of its
  bones' lengths (RMS); on a template it is `TEMPLATE_PLACE_SD_M`.

Share of angles within 1, 2, 3 sigma (simulated takes, subjects calibrated from their
own range-of-motion takes, gaps of 0.25 s cut into four markers at once):

    markers        decided by markers   bridged          open, following the prior
    maycock26      0.64 0.93 0.99       0.67 0.93 0.99   0.62 0.90 0.94
    schroeder17    0.68 0.92 1.00       0.71 0.94 0.99   0.66 0.85 0.94
    dfki13         0.55 0.87 0.95       0.61 0.90 0.97   0.46 0.87 0.91
    schroeder6     0.74 0.94 0.98       0.56 0.77 0.87   0.80 0.96 0.98

Errors of one hinge are nearly the same in all frames: sigma is what to expect of a
subject, not how much angles tremble. Two markers per finger (dfki13) may still be in
the wrong one of two postures, which no variance says.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.hand.model import Model, jacobian
from handclean.hand.subject import Subject
from handclean.ik.decide import UNKNOWN_HINGE_SD_RAD, precision_of
from handclean.ik.frames import SUBSPACE_RESIDUAL_SD_RAD
from handclean.ik.prior import PosturePrior, knowing
from handclean.ik.residual_test import share_left
from handclean.ik.solve import Solution, prior_arrays
from handclean.tree import POSE_HEAD, ROOT_DOFS

CALIBRATED_PLACE_SD_M = 1.5e-3
"""[m] how far places are off, one sd, on a subject that does not say. Within the 0.7 to
2.5 mm above."""

TEMPLATE_PLACE_SD_M = 6e-3
"""[m] how far places are off, one sd, on a hand that nobody measured. Chosen."""

MIN_EXPLAINED_SHARE = 0.5
"""Share of its variance that markers must explain for them to tell of a joint.
Chosen."""

ROOT_PLACE_SD_M = 0.05
"""[m] of the root's translation in the loose prior. Chosen."""

ROOT_TURN_SD_RAD = 0.5
"""[rad] of the root's rotation in the loose prior. Chosen."""

MAX_STRETCH_FRAMES = 100
"""[frames] for which one Jacobian is used, at most. Chosen."""

MIN_LEVER_M = 5e-3
"""[m] places on a bone count as this far from its hinge's axis at least. Chosen."""


@dataclass(frozen=True, kw_only=True)
class AngleUncertainty:
    """What markers and a prior leave open, without the error of zeros.

    Attributes
    ----------
    root : (T,) [rad] standard deviation of the root's rotation.
    hinges : (T, D) [rad] of the hinges, NaN where nothing tells of one.
    off : (T, D) [rad] how far hinges are from where markers and prior together would
        have them, see `ik.decide`; 0 without a prior.
    """

    root: Floats
    hinges: Floats
    off: Floats


def zero_sigma(subject: Subject) -> Floats:
    """Estimate how far the zero of each hinge's angle is off, see the module.

    Returns
    -------
    (D,) [rad] standard deviation of an angle's constant error
    """
    model = subject.model
    known = [v for k, v in subject.errors.items() if k.endswith("_length_sigma_m")]
    places = (
        float(np.sqrt(np.mean(np.square(known)))) if known else CALIBRATED_PLACE_SD_M
    )
    if not subject.calibrated:
        places = TEMPLATE_PLACE_SD_M
    square = np.full(len(model.tree.hinges), MIN_LEVER_M**2)
    parents = np.asarray(model.tree.parents)
    for hinge, bone in enumerate(model.tree.hinge_bone):
        axis = model.tree.axes[hinge] / np.linalg.norm(model.tree.axes[hinge])
        held = [model.at[model.bone == bone], model.tree.offsets[parents == bone]]
        away = np.cross(axis, np.concatenate(held))
        square[hinge] = max(float(np.sum(away * away)), square[hinge])
    return np.asarray(places / np.sqrt(square))


def even_noise(
    noise: Floats, positions: Floats, residual: Floats, left: Floats
) -> Floats:
    """(M,) [m] noise of markers per axis, none less than that of all together.

    Parameters
    ----------
    noise : (M,) [m] as `noise.marker_noise` says.
    positions : (T, M, 3); residual : (T,) [m] RMS of the frames.
    left : (T,) share of what markers say that poses do not absorb.
    """
    count = np.isfinite(positions).all(axis=2).sum(axis=1)
    solved = np.isfinite(residual) & (count > 0)
    if not solved.any():
        return noise
    square = np.median(residual[solved] ** 2 / (3.0 * left[solved]))
    return np.asarray(np.maximum(noise, np.sqrt(square)))


def prior_precision(hinges: int) -> Floats:
    """Return the precision of the loose prior of all degrees of freedom.

    Parameters
    ----------
    hinges : how many there are, D.

    Returns
    -------
    (6 + D,) [1/m^2, 1/rad^2] of the root's translation, its rotation, and the hinges
    """
    spread = np.concatenate(
        [
            np.repeat((ROOT_PLACE_SD_M, ROOT_TURN_SD_RAD), ROOT_DOFS // 2),
            np.full(hinges, SUBSPACE_RESIDUAL_SD_RAD),
        ]
    )
    return np.asarray(1.0 / spread**2)


def stretches_of(*marks: Bools) -> list[tuple[int, int]]:
    """Frames in which marks (T, M) stay the same, not too many, as (start, stop)."""
    frames = len(marks[0])
    changes = np.any(np.diff(np.hstack(marks), axis=0), axis=1)
    regular = np.arange(0, frames, MAX_STRETCH_FRAMES)
    edges = np.union1d(np.flatnonzero(changes) + 1, np.append(regular, frames))
    return [(int(a), int(b)) for a, b in pairwise(edges)]


def uncertainty_of_take(
    subject: Subject,
    positions: Floats,
    poses: Floats,
    solution: Solution,
    noise: Floats,
    prior: PosturePrior | None,
    nominal_m: float,
) -> AngleUncertainty:
    """How uncertain the angles of a solved take are, but for their zeros.

    See `angle_uncertainty`; the noise of each marker is at least that of all together.

    Parameters
    ----------
    positions : (T, M, 3) [m] measured samples, NaN elsewhere; poses : (T, 7 + D).
    solution : inverse kinematics of ``positions``.
    noise : (M,) [m] as `noise.marker_noise` says.
    """
    seen = np.asarray(np.isfinite(positions).all(axis=2))
    left = share_left(subject.model, seen)
    noise = even_noise(noise, positions, solution.residual, left)
    return angle_uncertainty(subject.model, poses, seen, noise, prior, nominal_m)


def angle_uncertainty(
    model: Model,
    poses: Floats,
    seen: Bools,
    noise: Floats,
    prior: PosturePrior | None,
    nominal_m: float = math.inf,
) -> AngleUncertainty:
    """How uncertain angles are with the markers in sight and the prior.

    Parameters
    ----------
    poses : (T, 7 + D); seen : (T, M); noise : (M,) [m] per axis.
    nominal_m : [m] noise with which markers weigh against the prior at least in the
        last answer: on a hand nobody measured, residuals are no noise.
    """
    hinges, prior = len(model.tree.hinges), knowing(prior, model.tree.hinges)
    louder = bool(np.any(noise > nominal_m))
    precision = np.diag(prior_precision(hinges))
    usual = np.diag(precision)[ROOT_DOFS:] ** -1.0
    mean, basis = prior_arrays(model, prior)
    if prior is not None:
        precision[ROOT_DOFS:, ROOT_DOFS:] = precision_of(basis)
        usual = np.full(hinges, UNKNOWN_HINGE_SD_RAD**2)
    root, out = np.zeros(len(poses)), np.zeros((len(poses), hinges))
    off = np.zeros((len(poses), hinges))
    for start, stop in stretches_of(seen):
        here, pose = seen[start], poses[(start + stop) // 2]
        slope = jacobian(model, pose)[here]
        covariance = _covariance(slope, noise[here], precision)
        variance = np.diag(covariance)
        root[start:stop] = np.sqrt(variance[ROOT_DOFS // 2 : ROOT_DOFS].max())
        variance = variance[ROOT_DOFS:]
        told = variance <= (1.0 - MIN_EXPLAINED_SHARE) * usual
        out[start:stop] = np.where(told, np.sqrt(variance), np.nan)
        if prior is not None:
            if louder:
                least = np.minimum(noise[here], nominal_m)
                covariance = _covariance(slope, least, precision)
            pull = precision[ROOT_DOFS:, ROOT_DOFS:] @ (mean - pose[POSE_HEAD:])
            off[start:stop] = np.abs(covariance[ROOT_DOFS:, ROOT_DOFS:] @ pull)
    return AngleUncertainty(root=root, hinges=out, off=off)


def _covariance(slope: Floats, noise: Floats, precision: Floats) -> Floats:
    """(6 + D, 6 + D) of root and angles, markers (N, 3, 6 + D) and prior together."""
    scaled = (slope / noise[:, None, None]).reshape(-1, slope.shape[2])
    return np.asarray(np.linalg.inv(scaled.T @ scaled + precision))
