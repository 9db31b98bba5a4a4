"""Poses from the markers of a hand, frame by frame."""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape
from handclean.errors import TAKE, HandcleanError
from handclean.hand.model import Model
from handclean.ik.decide import mark_decided_frames, precision_of
from handclean.ik.frames import (
    MIN_MARKERS,
    PoseProblem,
    TakeFit,
    TakeMarkers,
    empty_fit,
    solve_frames,
)
from handclean.ik.likeliest import find_map_poses
from handclean.ik.mend import JumpTask, has_jumps, remove_jumps
from handclean.ik.prior import PosturePrior, knowing
from handclean.ik.residual_test import share_left
from handclean.ik.settings import SolveConfig
from handclean.kernels.gauss_newton import (
    AnglePrior,
    Chain,
    StepControl,
    Subspace,
    make_workspace,
)
from handclean.recording import Recording, Trajectories

MIN_TAKE_NOISE_M = 1e-4
"""[m] noise of all markers of a take per axis is not taken to be less. Chosen."""

MEAN_WITHOUT_PRIOR = 0.3
"""Share of the middle of each hinge's limits that stands for the mean posture where
there is no prior: a hand a little bent. Chosen."""

FIST_SHARES = (0.35, 0.75)
"""Shares of the largest flexion that make a half and a closed fist. Chosen."""

NOISE_FRAMES = 200
"""Frames from which the noise of a take is estimated, about. Chosen."""


@dataclass(frozen=True, kw_only=True)
class Solution:
    """What inverse kinematics found.

    Attributes
    ----------
    poses : (T, 7 + D) pose rows.
    residual : (T,) [m] RMS over the markers measured in that frame; NaN without any.
    opened : (T, D) hinges the markers of that frame do not decide.
    decided : (T,) whether root and hinges are decided, by the markers or by them and
        the prior; without a prior, whether the markers decide the root. A frame is
        trusted if its residual is plausible as well, see `handclean.ik.take`.
    steps : (T,) Gauss-Newton steps taken.
    """

    poses: Floats
    residual: Floats
    opened: Bools
    decided: Bools
    steps: Ints


def chain_of(model: Model) -> Chain:
    """Return a model's joint tree and markers as the kernels want them."""
    return Chain(
        parent=model.links.parent,
        offset=model.links.offset,
        axis=model.links.axis,
        link=model.link,
        at=model.link_at,
        limits=np.ascontiguousarray(model.tree.limits),
    )


def prior_arrays(model: Model, prior: PosturePrior | None) -> tuple[Floats, Floats]:
    """Return a posture prior in the order of a tree's hinges.

    Hinges the prior does not know (a forearm's) have mean 0 and do not follow it. One
    that knows none of them is no prior.

    Returns
    -------
    mean : (D,) [rad]; without a prior, a hand a little bent.
    basis : (D, K) [rad] one standard deviation per column; K = 0 without a prior.
    """
    hinges = model.tree.hinges
    prior = knowing(prior, hinges)
    directions = 0 if prior is None else prior.components.shape[1]
    mean, basis = np.zeros(len(hinges)), np.zeros((len(hinges), directions))
    if prior is None:
        middle: Floats = model.tree.limits.mean(axis=1)
        return MEAN_WITHOUT_PRIOR * middle, basis
    for row, name in enumerate(hinges):
        if name in prior.names:
            known = prior.names.index(name)
            mean[row] = prior.mean[known]
            basis[row] = prior.components[known] * prior.deviations
    return mean, basis


def start_postures(model: Model, mean: Floats) -> Floats:
    """List postures to start from: the mean, the flat hand, a half and a closed fist.

    Parameters
    ----------
    mean : (D,) [rad]

    Returns
    -------
    (4, D) [rad] within the hinges' limits
    """
    limits = model.tree.limits
    flexes = np.array(["flexion" in name for name in model.tree.hinges])
    fists = [np.where(flexes, share * limits[:, 1], 0.0) for share in FIST_SHARES]
    starts = np.array([mean, np.zeros_like(mean), *fists])
    clipped: Floats = np.clip(starts, limits[:, 0], limits[:, 1])
    return clipped


def solve_markers(
    model: Model,
    positions: Floats,
    *,
    weights: Floats | None = None,
    prior: PosturePrior | None = None,
    settings: SolveConfig | None = None,
) -> Solution:
    """Fit a model to its markers, frame by frame.

    Parameters
    ----------
    model : the hand with its M markers.
    positions : (T, M, 3) [m] in the order of ``model.labels``, NaN where missing.
    weights : (M,) not negative, 1 when not given.
    prior : posture subspace for what markers leave open; none is standard IK.

    Raises
    ------
    ShapeError
        If the arrays do not fit the model.
    """
    settings = settings or SolveConfig()
    frames, markers = len(positions), len(model.labels)
    expect_shape("positions", positions, frames, markers, 3)
    weights = np.ones(markers) if weights is None else weights
    expect_shape("weights", weights, markers)
    prior = knowing(prior, model.tree.hinges)
    mean, basis = prior_arrays(model, prior)
    seen = TakeMarkers(
        targets=np.ascontiguousarray(positions, dtype=np.float64),
        weight=np.ascontiguousarray(weights, dtype=np.float64),
    )
    problem = PoseProblem(
        tree=chain_of(model),
        subspace=Subspace(mean, basis, settings.prior_m),
        control=StepControl(settings.damping, settings.enough_m, settings.iterations),
        lever_m=settings.lever_m,
    )
    work = make_workspace(len(mean), markers, basis.shape[1])
    fit = empty_fit(frames, len(mean))
    starts, limb = start_postures(model, mean), _limb_of_hinge(model)
    solve_frames(seen, problem, starts, settings.restart_m, work, fit)
    if has_jumps(fit.poses):
        noise = _noise(model, seen.targets, fit.residual)
        remove_jumps(limb, JumpTask(seen, problem, noise, fit, work))
    if prior is not None:
        likely = AnglePrior(mean, precision_of(basis), settings.prior_m)
        find_map_poses(seen, limb, problem.tree, likely, work, fit)
        mark_decided_frames(seen, problem.tree, likely, settings.lever_m, work, fit)
    return Solution(
        poses=fit.poses,
        residual=fit.residual,
        opened=fit.opened,
        decided=fit.decided,
        steps=fit.steps,
    )


def decided(
    model: Model,
    positions: Floats,
    poses: Floats,
    prior: PosturePrior | None,
    settings: SolveConfig | None = None,
) -> Bools:
    """(T,) whether markers and a prior decide given postures, see `decide`.

    The labeller's postures are judged so.

    Parameters
    ----------
    positions : (T, M, 3) [m], NaN where missing; poses : (T, 7 + D).
    prior : without one, a frame with three markers counts as decided.
    """
    settings, prior = settings or SolveConfig(), knowing(prior, model.tree.hinges)
    enough = np.isfinite(positions).all(axis=2).sum(axis=1) >= MIN_MARKERS
    if prior is None:
        return np.asarray(enough)
    mean, basis = prior_arrays(model, prior)
    fit = TakeFit(
        poses=np.ascontiguousarray(poses),
        residual=np.full(len(poses), np.nan),
        opened=np.ones((len(poses), len(mean)), dtype=bool),
        decided=np.asarray(enough),
        steps=np.zeros(len(poses), dtype=np.int64),
    )
    mark_decided_frames(
        TakeMarkers(np.ascontiguousarray(positions), np.ones(len(model.labels))),
        chain_of(model),
        AnglePrior(mean, precision_of(basis), settings.prior_m),
        settings.lever_m,
        make_workspace(len(mean), len(model.labels), basis.shape[1]),
        fit,
    )
    return fit.decided


def _limb_of_hinge(model: Model) -> Ints:
    """(D,) first hinge of the limb each hinge belongs to."""
    return np.asarray(model.tree.limbs()[model.tree.hinge_bone])


def _noise(model: Model, targets: Floats, residual: Floats) -> float:
    """[m] noise of the markers per axis, from the residuals of some frames."""
    solved = np.flatnonzero(np.isfinite(residual))
    if len(solved) == 0:
        return MIN_TAKE_NOISE_M
    solved = solved[:: max(len(solved) // NOISE_FRAMES, 1)]
    seen = np.asarray(np.isfinite(targets[solved]).all(axis=2))
    square = residual[solved] ** 2 / (3.0 * share_left(model, seen))
    return max(float(np.sqrt(np.median(square))), MIN_TAKE_NOISE_M)


def expect_markers(recording: Recording, model: Model) -> Trajectories:
    """Return the labelled markers of a take that has some of a model's.

    Raises
    ------
    HandcleanError
        If the take has no labelled markers, or none of the model's.
    """
    found = recording.markers
    if found is None or not any(label in model.labels for label in found.labels):
        has = ", ".join(found.labels[:6]) if found is not None else ""
        raise HandcleanError(
            f"none of the subject's markers ({', '.join(model.labels[:4])}, ...) "
            f"are in it; it has {has or 'no labelled markers'}",
            where=TAKE,
        )
    return found


def markers_of(
    recording: Recording, model: Model, *, measured_only: bool = True
) -> Floats:
    """Take the samples of a model's markers out of a take.

    Parameters
    ----------
    measured_only : whether filled samples count as missing.

    Returns
    -------
    (T, M, 3) [m] in the order of the model's labels, NaN where missing

    Raises
    ------
    HandcleanError
        If the take has no labelled markers, or none of the model's.
    """
    found = expect_markers(recording, model)
    seen: Bools = found.measured if measured_only else found.origin > 0
    out = np.full((recording.frames, len(model.labels), 3), np.nan)
    for column, label in enumerate(model.labels):
        if label in found.labels:
            at = found.labels.index(label)
            there = seen[:, at]
            out[there, column] = found.positions[there, at]
    return out
