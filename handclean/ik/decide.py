"""In which frames markers, or they and the posture prior, decide the whole posture.

With noise s on the markers (`SolveConfig.prior_m` per axis) and the prior's precision P
of the angles, root and angles have the covariance ``C = (J^T J / s^2 + [0 P])^-1``. A
posture is decided if

- that leaves the root's rotation and every hinge less than `DECIDED`, one sd, and
- the posture is where markers and prior together would have it: no hinge is further
  than `DECIDED` from there, a Newton step ``C [0 P (mean - q)]`` away. Of the postures
  that fit a finger with a marker on its tip only, that refuses the unlikely ones.

The prior is the posture subspace and, off it, `STRAY` for each hinge: a finger without
markers is not decided, whatever the others do; one whose tip is seen may be. That a
finger with two markers has an elbow up and an elbow down, it does not say.
"""

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.ik.frames import look
from handclean.kernels import jit
from handclean.kernels.gauss_newton import Chain, Work, known_with, misfit

DECIDED = 0.25, 0.4
"""[rad] standard deviations of the root's rotation and of a hinge, markers and prior
together, up to which a posture counts as decided."""

STRAY = 0.37
"""[rad] how far a hinge is from what the subspace makes of it, one sd. Of fingers that
are hidden while the other four are known, it is 0.26 in manipnet's grasps, 0.33 in the
range of motion of dfki13, 0.36 in guitar playing, 0.1 to 0.15 in simulated grasps and
movements, by maximum likelihood under the prior that ships. With one marker on each
finger 0.37 puts 63 to 83 % of the errors of simulated takes within one sd, 85 to 97 %
within two; 52 to 67 and 73 to 88 % of real motion."""

UNKNOWN = 1.0
"""[rad] the same of a hinge that the prior does not know."""

EVERY = 25
"""[frames] for which one answer serves while its markers are in sight."""


def precision_of(basis: Floats) -> Floats:
    """(D, D) [1/rad^2] precision of angles about the prior's mean.

    Their covariance is that of the subspace and, off it, `STRAY` squared for each
    hinge; `UNKNOWN` squared for a hinge that the prior does not know.

    Parameters
    ----------
    basis : (D, K) [rad] directions of the subspace, one sd each.
    """
    stray = np.where(np.any(basis != 0.0, axis=1), STRAY, UNKNOWN)
    covariance = basis @ basis.T + np.diag(stray**2)
    return np.ascontiguousarray(np.linalg.inv(covariance))


@jit
def expected(pose: Floats, mean: Floats, precision: Floats, square: Floats) -> bool:
    """Whether a posture is near what markers and prior together would have.

    Parameters
    ----------
    pose : (7 + D,); mean : (D,) [rad] and precision : (D, D) of the prior.
    square : (7 + D, 6 + D) as `known_with` leaves it: the Cholesky factor of the
        precision of root and angles, and a row of room.
    """
    size = square.shape[1]
    step = square[size]
    for i in range(size):
        step[i] = 0.0
        for e in range(mean.shape[0] if i >= 6 else 0):
            step[i] += precision[i - 6, e] * (mean[e] - pose[7 + e])
        for n in range(i):
            step[i] -= square[i, n] * step[n]
        step[i] /= square[i, i]
    for i in range(size - 1, 5, -1):
        for n in range(i + 1, size):
            step[i] -= square[n, i] * step[n]
        step[i] /= square[i, i]
        if abs(step[i]) > DECIDED[1]:
            return False
    return True


@jit
def serves(here: Floats, then: Floats, known: bool) -> bool:
    """Whether the answer for some markers serves for those here.

    That they decide the posture is true of more markers, too.
    """
    for m in range(here.shape[0]):
        more, less = here[m] > then[m], here[m] < then[m]
        if less or (more and not known):
            return False
    return True


@jit
def decide(
    targets: Floats,
    weight: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    precision: Floats,
    noise: float,
    lever_m: float,
    poses: Floats,
    opened: Bools,
    sure: Bools,
) -> None:
    """Write which frames' postures markers and a prior decide.

    Parameters
    ----------
    targets : (T, M, 3) [m], NaN where missing; weight : (M,).
    mean, precision : (D,) [rad], (D, D) [1/rad^2] of the angles under the prior.
    noise : [m] of the markers per axis.
    lever_m : [m] markers of a hinge that is not open, see `undecided`, move by so much
        for a radian; where that is enough, there is nothing to compute.
    poses : (T, 7 + D); opened : (T, D)
    sure : (T,) whether the markers decide the root, overwritten with the answer.
    """
    here, then = np.zeros(weight.shape[0]), np.zeros(weight.shape[0])
    size = 6 + precision.shape[0]
    square = np.zeros((size + 1, size))
    known, since = False, -EVERY
    plain = noise <= lever_m * min(DECIDED[0], DECIDED[1])
    for t in range(poses.shape[0]):
        count, _ = look(targets[t], weight, here)
        if count < 3:
            sure[t] = False
            since = -EVERY
            continue
        if plain and sure[t] and not opened[t].any():
            since = -EVERY
            continue
        if t - since >= EVERY or not serves(here, then, known):
            then[:] = here
            misfit(poses[t], targets[t], here, tree, k)
            known = known_with(here, tree, k, precision, noise, DECIDED, square)
            known = known and expected(poses[t], mean, precision, square)
            since = t
        sure[t] = known
