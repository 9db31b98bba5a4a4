"""The joint least squares over all chosen frames: poses and hand at once.

See ``handclean.kernels.bundle`` for the equations. The poses are eliminated frame by
frame (Schur complement), the shape is solved for, and the poses follow; Levenberg's and
Marquardt's damping makes every accepted step lower the cost. The noise of a marker is
estimated on the way, from the median size of the residuals, which a few mislabelled
markers do not disturb.

**How much a take may say.** What cameras add to a marker changes from frame to frame
and averages out. The rest of the residuals does not: skin slides over a joint in the
same way whenever it bends. So far as residuals are more than camera noise, F frames
therefore count as at most ``independent`` ones against the prior, which is multiplied
by

    share + (1 - share) F / independent,     share = (camera noise / noise)^2 .

Without this, a take that moves little bends axes and places to explain the sliding, and
fails on postures it did not show.

**Noise that poses take up.** Poses fitted to noisy markers hide a part of the noise and
leave fingers too long, by an amount that more frames do not lessen (Neyman and Scott
1948). It grows with the square of the noise: nothing to speak of below a millimetre, a
millimetre and more where markers are as noisy as three.

**The prior of poses** decides only what neither markers nor the hand decide. It counts
once for all frames together, like one more observation of the mean posture; otherwise
hundreds of frames would move the zero of an angle, which is decided by little else.
"""

import math
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.hand.model import Model, marker_positions
from handclean.kernels import bundle
from handclean.kernels.bundle import Eliminated, Measured
from handclean.subject.shape import Expectation, PosePrior, Shape, pose_numbers, prior

MEDIAN_NORM_SD = 1.5382
"""[standard deviations] median length of a vector of three independent standard normal
numbers (a property of the chi distribution)."""

LEAST_COST_STEP = 0.1
"""A step that lowers the cost by less moves no number of the shape by more than about a
third of its standard deviation (derived: a quadratic cost of that height)."""

NOISE_FLOOR_M = 1e-5
"""Noise is never taken to be smaller: no marker is placed better (chosen; simulated
hands come to 0.1 mm)."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """What a joint adjustment is given.

    Attributes
    ----------
    template : the expected hand.
    expect : how far from it a hand may be; tilt_rad : (D,) [rad] its axes especially.
    pose_prior : what is expected of the mean posture.
    targets : (T, M, 3) [m], finite; seen : (T, M) what of them is measured.
    camera_m : [m] noise of a marker, each way, that changes from frame to frame.
    independent : as how many frames the chosen ones count, see the module.
    robust : residuals of so many standard deviations lose most of their say.
    """

    template: Model
    expect: Expectation
    tilt_rad: Floats
    pose_prior: PosePrior
    targets: Floats
    seen: Bools
    camera_m: float
    independent: float
    robust: float

    def strength(self, sigma_m: float) -> float:
        """By how much the prior is multiplied."""
        share = min((self.camera_m / sigma_m) ** 2, 1.0)
        return share + (1.0 - share) * max(len(self.targets) / self.independent, 1.0)

    def weighed(self, sigma_m: float) -> "_Weights":
        """Return what the noise decides."""
        strength = self.strength(sigma_m)
        return _Weights(
            marker=self.seen / sigma_m**2,
            soft=(self.robust * sigma_m) ** -2,
            prior=strength,
            pose_prior=self.pose_prior.times(strength / len(self.targets)),
        )


@dataclass(frozen=True, kw_only=True)
class _Weights:
    """Weights of markers (T, M) [1/m^2], of the loss, and of both priors."""

    marker: Floats
    soft: float
    prior: float
    pose_prior: PosePrior


@dataclass(frozen=True, kw_only=True)
class Known:
    """A hand to fit poses with.

    Attributes
    ----------
    model : the hand with its markers.
    sigma_m : [m] noise of a marker, each way.
    soft : [1/m^2] the robust loss' constant.
    pose_prior : what is expected of the pose of one frame.
    """

    model: Model
    sigma_m: float
    soft: float
    pose_prior: PosePrior


@dataclass(frozen=True, kw_only=True)
class Adjusted:
    """The outcome of a joint adjustment.

    Attributes
    ----------
    shape : the hand; poses : (T, 7 + D).
    known : the same hand, for fitting further poses.
    covariance : (N, N) of the shape's numbers.
    iterations : how many steps were tried.
    """

    shape: Shape
    poses: Floats
    known: Known
    covariance: Floats
    iterations: int


def residuals(model: Model, poses: Floats, targets: Floats, seen: Bools) -> Floats:
    """(T, M) [m] how far markers are from where the model puts them, NaN if unseen."""
    distance = np.linalg.norm(targets - marker_positions(model, poses), axis=2)
    return np.where(seen, distance, np.nan)


def marker_noise(
    distance: Floats, numbers: int, floor_m: float = NOISE_FLOOR_M
) -> float:
    """[m] noise of a marker along each axis, from residuals.

    Their median length is compared with that of normal numbers, which a few mislabelled
    markers do not disturb; fitted numbers have taken up a part of the noise.

    Parameters
    ----------
    distance : [m] lengths of the residuals, NaN where a marker was not seen; some
        should be finite.
    numbers : how many unknowns were fitted to them.
    floor_m : [m] the least that is returned.
    """
    seen = distance[np.isfinite(distance)]
    measured = 3 * len(seen)
    free = max(measured - numbers, 0.1 * measured)
    middle = float(np.median(seen))
    return max(middle / MEDIAN_NORM_SD * math.sqrt(measured / free), floor_m)


def adjust(
    problem: Problem,
    shape: Shape,
    poses: Floats,
    sigma_m: float,
    *,
    final: bool = True,
    iterations: int = 300,
) -> Adjusted:
    """Find the hand and its poses that explain the chosen frames best.

    Parameters
    ----------
    shape, poses : where to start; (T, 7 + D).
    sigma_m : [m] noise to start with; better too large.
    final : whether to step until the hand stands still, not only the cost.
    iterations : how many steps at most.
    """
    tried, settled = 0, False
    numbers = pose_numbers(shape.model) * len(poses)
    while not settled and tried < iterations:
        weights = problem.weighed(sigma_m)
        left = iterations - tried
        shape, poses, used = _settle(problem, shape, poses, weights, left, 1e-4)
        tried += used
        left_over = residuals(shape.model, poses, problem.targets, problem.seen)
        found = max(marker_noise(left_over, numbers), problem.camera_m)
        settled = 0.95 < found / sigma_m < 1.03
        sigma_m = max(found, 0.3 * sigma_m)
    weights = problem.weighed(sigma_m)
    if final:
        left = iterations - tried
        shape, poses, used = _settle(problem, shape, poses, weights, left, 0.0)
        tried += used
    last = _equations(problem, shape, poses, weights, 0.0)
    return Adjusted(
        shape=shape,
        poses=poses,
        known=Known(
            model=shape.model,
            sigma_m=sigma_m,
            soft=weights.soft,
            pose_prior=weights.pose_prior,
        ),
        covariance=np.asarray(weights.prior * np.linalg.inv(last.schur), dtype=float),
        iterations=tried,
    )


def _settle(
    problem: Problem,
    shape: Shape,
    poses: Floats,
    weights: _Weights,
    iterations: int,
    enough: float,
) -> tuple[Shape, Floats, int]:
    """Step until the cost falls by less than a part of it, or by next to nothing."""
    cost = _cost(problem, shape, poses, weights)
    damping, used, still = 1e-3, 0, False
    while used < iterations and not still and damping < 1e6:
        used += 1
        equations = _equations(problem, shape, poses, weights, damping)
        step = equations.solved(damping)
        there = shape.stepped(step)
        moved = equations.followed(poses, step)
        after = _cost(problem, there, moved, weights)
        if after <= cost:
            still = cost - after < max(enough * cost, LEAST_COST_STEP * weights.prior)
            shape, poses, cost = there, moved, after
            damping = max(0.2 * damping, 1e-8)
        else:
            damping *= 8.0
    return shape, poses, used


def _cost(problem: Problem, shape: Shape, poses: Floats, weights: _Weights) -> float:
    body = weights.pose_prior.body(shape.model)
    measured = Measured(problem.targets, weights.marker, weights.soft)
    each = bundle.costs(poses, measured, body, bundle.make_room(body))
    errors, _ = prior(shape, problem.template, problem.expect, problem.tilt_rad)
    return float(each.sum()) + weights.prior * float(errors @ errors)


@dataclass(frozen=True, kw_only=True)
class _Equations:
    """The equations of one linearisation.

    Attributes
    ----------
    frames : of every frame, its pose eliminated.
    diagonal : (N,) of the shape's equations before the poses were eliminated.
    schur, slope : (N, N), (N,) after.
    """

    frames: Eliminated
    diagonal: Floats
    schur: Floats
    slope: Floats

    def solved(self, damping: float) -> Floats:
        """(N,) the step of the shape."""
        damped = self.schur + damping * np.diag(self.diagonal)
        return np.asarray(np.linalg.solve(damped, self.slope), dtype=float)

    def followed(self, poses: Floats, step: Floats) -> Floats:
        """(T, 7 + D) the poses after the steps that go with a step of the shape."""
        return bundle.follow(poses, self.frames, step)


def _equations(
    problem: Problem, shape: Shape, poses: Floats, weights: _Weights, damping: float
) -> _Equations:
    """Linearise and eliminate the poses; ``damping`` is theirs."""
    body = weights.pose_prior.body(shape.model)
    errors, rows = prior(shape, problem.template, problem.expect, problem.tilt_rad)
    numbers = rows.shape[1]
    measured = Measured(problem.targets, weights.marker, weights.soft)
    frames = bundle.eliminate(
        poses, measured, damping, body, bundle.make_room(body), numbers
    )
    square = frames.square + weights.prior * rows.T @ rows
    slope = frames.slope - weights.prior * rows.T @ errors
    flat = frames.reduced.reshape(-1, numbers)
    return _Equations(
        frames=frames,
        diagonal=np.diag(square).copy(),
        schur=square - flat.T @ flat,
        slope=slope - flat.T @ frames.rest.ravel(),
    )
