"""In which frames markers, or they and the posture prior, decide the whole posture.

With noise s on the markers (`SolveConfig.prior_m` per axis) and the prior's precision P
of the angles, root and angles have the covariance ``C = (J^T J / s^2 + [0 P])^-1``. A
posture is decided if

- that leaves the root's rotation and every hinge less than `DECIDED_SD`, one sd, and
- the posture is where markers and prior together would have it: no hinge is further
  than `DECIDED_SD` from there, a Newton step ``C [0 P (mean - q)]`` away. Of the
  postures that fit a finger with a marker on its tip only, that refuses the unlikely
  ones.

The prior is the posture subspace and, off it, `OFF_SUBSPACE_SD_RAD` for each hinge: a
finger without markers is not decided, whatever the others do; one whose tip is seen may
be. That a finger with two markers has an elbow up and an elbow down, it does not say.
"""

import numpy as np

from handclean.arrays import Floats
from handclean.ik.frames import MIN_MARKERS, TakeFit, TakeMarkers, weigh_markers
from handclean.kernels import jit
from handclean.kernels.gauss_newton import (
    AnglePrior,
    Chain,
    Observations,
    SpreadLimits,
    Workspace,
    factored_information,
    is_spread_within,
    misfit,
)
from handclean.kernels.linalg import backward_by_rows, forward_vector

DECIDED_SD = SpreadLimits(root_rad=0.25, hinge_rad=0.4)
"""[rad] standard deviations of the root's rotation and of a hinge, markers and prior
together, up to which a posture counts as decided. Chosen."""

OFF_SUBSPACE_SD_RAD = 0.37
"""[rad] how far a hinge is from what the subspace makes of it, one sd. Of fingers that
are hidden while the other four are known, it is 0.26 in manipnet's grasps, 0.33 in the
range of motion of dfki13, 0.36 in guitar playing, 0.1 to 0.15 in simulated grasps and
movements, by maximum likelihood under the prior that ships. With one marker on each
finger 0.37 puts 63 to 83 % of the errors of simulated takes within one sd, 85 to 97 %
within two; 52 to 67 and 73 to 88 % of real motion."""

UNKNOWN_HINGE_SD_RAD = 1.0
"""[rad] the same of a hinge that the prior does not know. Chosen."""

REUSE_FRAMES = 25
"""[frames] for which one answer is used while its markers are in sight. Chosen."""


def precision_of(basis: Floats) -> Floats:
    """(D, D) [1/rad^2] precision of angles about the prior's mean.

    Their covariance is that of the subspace and, off it, `OFF_SUBSPACE_SD_RAD` squared
    for each hinge; `UNKNOWN_HINGE_SD_RAD` squared for one that the prior does not know.

    Parameters
    ----------
    basis : (D, K) [rad] directions of the subspace, one sd each.
    """
    known = np.any(basis != 0.0, axis=1)
    stray = np.where(known, OFF_SUBSPACE_SD_RAD, UNKNOWN_HINGE_SD_RAD)
    covariance = basis @ basis.T + np.diag(stray**2)
    return np.ascontiguousarray(np.linalg.inv(covariance))


@jit
def is_expected(
    pose: Floats, lower: Floats, prior: AnglePrior, most_rad: float, k: Workspace
) -> bool:
    """Whether a posture is near what markers and prior together would have.

    Parameters
    ----------
    pose : (7 + D,)
    lower : (6 + D, 6 + D) Cholesky factor of the precision of root and angles.
    most_rad : [rad] how far a hinge may be from there.
    """
    step, mean = k.row, prior.mean
    size = step.shape[0]
    for i in range(size):
        step[i] = 0.0
        for e in range(mean.shape[0] if i >= 6 else 0):
            step[i] += prior.precision[i - 6, e] * (mean[e] - pose[7 + e])
    forward_vector(lower, step, 0)
    backward_by_rows(lower, step)
    farthest = 0.0
    for i in range(6, size):
        farthest = max(farthest, abs(step[i]))
    return farthest <= most_rad


@jit
def answers(here: Floats, then: Floats, known: bool) -> bool:
    """Whether the answer for markers of weights ``then`` holds for those ``here``.

    If they decide the posture, more markers do, too.
    """
    for m in range(here.shape[0]):
        more, less = here[m] > then[m], here[m] < then[m]
        if less or (more and not known):
            return False
    return True


@jit
def mark_decided_frames(
    markers: TakeMarkers,
    tree: Chain,
    prior: AnglePrior,
    lever_m: float,
    k: Workspace,
    fit: TakeFit,
) -> None:
    """Write which frames' postures markers and a prior decide.

    Parameters
    ----------
    lever_m : [m] markers of a hinge that is not open, see `find_open_hinges`, move by
        so much for a radian; where that is enough, there is nothing to compute.
    fit : the solved take; of ``decided``, whether the markers decide the root, is
        overwritten with the answer.
    """
    here, then = np.zeros(markers.weight.shape[0]), np.zeros(markers.weight.shape[0])
    known, since, decided = False, -REUSE_FRAMES, fit.decided
    least = min(DECIDED_SD.root_rad, DECIDED_SD.hinge_rad)
    plain = prior.noise_m <= lever_m * least
    for t in range(fit.poses.shape[0]):
        in_sight = weigh_markers(markers.targets[t], markers.weight, here).markers
        if in_sight < MIN_MARKERS:
            decided[t] = False
            since = -REUSE_FRAMES
            continue
        if plain and decided[t] and not fit.opened[t].any():
            since = -REUSE_FRAMES
            continue
        if t - since >= REUSE_FRAMES or not answers(here, then, known):
            then[:] = here
            pose = fit.poses[t]
            near = misfit(pose, Observations(markers.targets[t], here), tree, k)
            made = factored_information(near, here, prior, tree, k)
            known = made.positive and is_spread_within(made.lower, DECIDED_SD, k)
            known = known and is_expected(
                pose, made.lower, prior, DECIDED_SD.hinge_rad, k
            )
            since = t
        decided[t] = known
