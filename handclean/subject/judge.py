"""How good a calibration is: what is left over, and what the take taught.

A joint says where its axis is only by moving. How much a take taught about an axis is
read off the covariance of the adjustment: if the tilt is hardly better known than
before, the axis is the template's.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.hand.model import Model
from handclean.kernels import bundle, pose_fit
from handclean.subject.adjust import Adjusted, Known, Problem, residuals
from handclean.subject.frames import LEAST_FRAMES, Frames
from handclean.subject.shape import sections
from handclean.subject.start import OUTLIER_M, first_poses, fitted
from handclean.tree import POSE_HEAD, ROOT_DOFS, JointTree

DOUBTFUL_M = 0.005
"""[m] and more than the loss' constant: a sample so far off is called doubtful
(chosen)."""

UNLEARNT_TILT_SD_SHARE = 0.8
"""A tilt whose standard deviation is more than this part of the prior's was not learnt
(chosen)."""

NORMAL_RANGE_SD = 4.65
"""Standard deviations between the first and the last hundredth of normal numbers (a
property of the normal distribution)."""

LIMIT_MARGIN_RAD = 0.03
"""[rad] by which limits go beyond the range of a joint that went beyond them
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """How a hand fits frames.

    Attributes
    ----------
    poses : (T, 7 + D), fitted robustly.
    distance : (T, M) [m] how far markers are from where they should be, NaN if unseen.
    doubtful : (T, M) samples that fit no posture: wrong labels, ghosts.
    """

    poses: Floats
    distance: Floats
    doubtful: Bools

    @property
    def clean(self) -> Bools:
        """(T,) frames without a doubtful sample."""
        return np.asarray(~self.doubtful.any(axis=1))

    @property
    def kept(self) -> Floats:
        """(T, M) [m] the distances, NaN where doubtful, too."""
        return np.where(self.doubtful, np.nan, self.distance)


def rms(values: Floats) -> float:
    """Root mean square of what is not NaN; NaN if nothing is."""
    there = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(there**2))) if len(there) else float("nan")


def fit(known: Known, frames: Frames) -> Fit:
    """Fit the poses of frames from scratch, with the hand as it is.

    The robust loss tightens in stages, so that a posture that is still on its way does
    not cost a good marker its say.
    """
    model, targets, seen = known.model, frames.targets, frames.seen
    expected, sigma_m = known.pose_prior, known.sigma_m
    poses, _ = first_poses(model, targets, seen)
    last = known.soft**-0.5
    first = max(OUTLIER_M, last)
    for scale in (first, np.sqrt(first * last), last):
        poses = fitted(model, expected, poses, targets, seen, sigma_m, scale**-2)
    distance = residuals(model, poses, targets, seen)
    doubtful = np.nan_to_num(distance) > max(last, DOUBTFUL_M)
    return Fit(poses=poses, distance=distance, doubtful=doubtful)


def plain_distance(known: Known, fits: Fit, frames: Frames) -> Floats:
    """(T, M) [m] the distances left by least squares over every sample, NaN if unseen.

    Doubtful samples count like any other, and drag the posture along.
    """
    model, targets, seen = known.model, frames.targets, frames.seen
    expected, sigma_m = known.pose_prior, known.sigma_m
    poses = fitted(model, expected, fits.poses, targets, seen, sigma_m, 0.0)
    return residuals(model, poses, targets, seen)


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """The error on frames that were kept aside.

    Attributes
    ----------
    frames : how many.
    rms_m : [m] root mean square distance over every measured sample, least squares.
    kept_rms_m : [m] of the robust fit, without doubtful samples.
    by_marker_m : (M,) [m] the same per marker; NaN if never measured there.
    doubtful : share of doubtful samples.
    """

    frames: int
    rms_m: float
    kept_rms_m: float
    by_marker_m: Floats
    doubtful: float


def held_out(known: Known, frames: Frames) -> HeldOut:
    """Measure the error of a hand on frames it was not learnt from."""
    if len(frames) == 0:
        nowhere = np.full(frames.seen.shape[1], np.nan)
        return HeldOut(
            frames=0,
            rms_m=np.nan,
            kept_rms_m=np.nan,
            by_marker_m=nowhere,
            doubtful=np.nan,
        )
    found = fit(known, frames)
    return HeldOut(
        frames=len(frames),
        rms_m=rms(plain_distance(known, found, frames)),
        kept_rms_m=rms(found.kept),
        by_marker_m=np.array([rms(column) for column in found.kept.T]),
        doubtful=float(found.doubtful[frames.seen].mean()),
    )


def lengths(adjusted: Adjusted) -> tuple[dict[str, float], dict[str, float]]:
    """[m] how far each joint is from the one before it, and the standard deviation."""
    tree = adjusted.shape.model.tree
    found, sigma = {}, {}
    for b in range(1, len(tree.bones)):
        rows = slice(3 * b - 3, 3 * b)
        size = float(np.linalg.norm(tree.offsets[b]))
        spread = adjusted.covariance[rows, rows]
        along = tree.offsets[b] / size if size > 0.0 else np.zeros(3)
        found[tree.joints[b]] = size
        sigma[tree.joints[b]] = float(np.sqrt(along @ spread @ along))
    return found, sigma


def shown(model: Model, seen: Bools) -> Bools:
    """(T, D) whether a marker that the hinge moves was measured."""
    moves = model.links.carries[model.link][:, 1:]
    return np.asarray((seen[:, :, None] & moves[None]).any(axis=1))


def ranges(known: Known, fits: Fit, frames: Frames) -> Floats:
    """(D, 2) [rad] from where to where hinges went, where no sample is doubtful.

    One frame in a hundred is left out at each end, and what noise adds to the range is
    taken off, in squares. NaN if markers show the hinge in fewer than `LEAST_FRAMES`.
    """
    seen = shown(known.model, frames.seen) & fits.clean[:, None]
    angles, sigma = fits.poses[:, POSE_HEAD:], _angle_sigmas(known, fits, frames)
    out = np.full((angles.shape[1], 2), np.nan)
    for d in range(len(out)):
        there = seen[:, d]
        if there.sum() >= LEAST_FRAMES:
            low, high = np.percentile(angles[there, d], [1.0, 99.0])
            added = NORMAL_RANGE_SD * float(np.median(sigma[there, d]))
            width = np.sqrt(max((high - low) ** 2 - added**2, 0.0))
            out[d] = 0.5 * (low + high) + 0.5 * width * np.array([-1.0, 1.0])
    return out


def _angle_sigmas(known: Known, fits: Fit, frames: Frames) -> Floats:
    """(T, D) [rad] how well each angle is known, the hand taken as known."""
    body = known.pose_prior.body(known.model)
    out = np.zeros((len(frames), ROOT_DOFS + len(known.model.tree.hinges)))
    pose_fit.pose_sigmas(
        fits.poses,
        frames.targets,
        frames.seen / known.sigma_m**2,
        known.soft,
        body,
        bundle.make_room(body),
        out,
    )
    return out[:, ROOT_DOFS:]


def unlearnt(problem: Problem, adjusted: Adjusted) -> Bools:
    """(D,) whether an axis' tilt is hardly better known than before."""
    start, count = sections(problem.template)[:2]
    spread = np.diag(adjusted.covariance)[start : start + count].reshape(-1, 2)
    known = np.sqrt(spread.mean(axis=1)) / problem.tilt_rad
    return np.asarray(known > UNLEARNT_TILT_SD_SHARE)


def unmoved(went: Floats, moved_rad: float) -> Bools:
    """(D,) whether a hinge went through less than ``moved_rad``, or never shows."""
    return ~(went[:, 1] - went[:, 0] >= moved_rad)


def widened(tree: JointTree, went: Floats) -> Floats:
    """(D, 2) [rad] the tree's limits, wider where the hand went beyond them."""
    low = np.fmin(tree.limits[:, 0], went[:, 0] - LIMIT_MARGIN_RAD)
    high = np.fmax(tree.limits[:, 1], went[:, 1] + LIMIT_MARGIN_RAD)
    return np.column_stack(
        [
            np.where(went[:, 0] < tree.limits[:, 0], low, tree.limits[:, 0]),
            np.where(went[:, 1] > tree.limits[:, 1], high, tree.limits[:, 1]),
        ]
    )
