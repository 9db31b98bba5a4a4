"""Poses from the markers of a hand, frame by frame."""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape
from handclean.errors import TAKE, HandcleanError
from handclean.hand.model import Model
from handclean.ik.decide import decide, precision_of
from handclean.ik.frames import solve_frames
from handclean.ik.likeliest import make_likeliest
from handclean.ik.mend import jumps, mend
from handclean.ik.prior import PosturePrior, knowing
from handclean.ik.residual_test import share_left
from handclean.ik.settings import SolveConfig
from handclean.kernels.gauss_newton import Chain, make_work
from handclean.recording import Recording
from handclean.tree import POSE_HEAD, ROOT_DOFS

QUIETEST = 1e-4
"""[m] noise of the markers per axis is not believed to be less."""

TASTED = 200
"""Frames that tell the noise of a take."""


@dataclass(frozen=True, kw_only=True)
class Solution:
    """What inverse kinematics found.

    Attributes
    ----------
    poses : (T, 7 + D) pose rows.
    residual : (T,) [m] RMS over the markers measured in that frame; NaN without any.
    opened : (T, D) hinges the markers of that frame do not decide.
    trusted : (T,) whether root and hinges are decided, by the markers or by them and
        the prior; without a prior, whether the markers decide the root.
    steps : (T,) Gauss-Newton steps taken.
    """

    poses: Floats
    residual: Floats
    opened: Bools
    trusted: Bools
    steps: Ints


def chain_of(model: Model) -> Chain:
    """Return the model as the kernels want it."""
    return Chain(
        parent=model.links.parent,
        offset=model.links.offset,
        axis=model.links.axis,
        link=model.link,
        at=model.link_at,
        limits=np.ascontiguousarray(model.tree.limits),
    )


def prior_arrays(model: Model, prior: PosturePrior | None) -> tuple[Floats, Floats]:
    """(D,) mean and (D, K) basis, one sd per column, in the order of the tree's hinges.

    Hinges the prior does not know (a forearm's) have mean 0 and do not follow it. One
    that knows none of them is no prior.
    """
    hinges = model.tree.hinges
    prior = knowing(prior, hinges)
    directions = 0 if prior is None else prior.components.shape[1]
    mean, basis = np.zeros(len(hinges)), np.zeros((len(hinges), directions))
    if prior is None:
        middle: Floats = model.tree.limits.mean(axis=1)
        return 0.3 * middle, basis
    for row, name in enumerate(hinges):
        if name in prior.names:
            known = prior.names.index(name)
            mean[row] = prior.mean[known]
            basis[row] = prior.components[known] * prior.deviations
    return mean, basis


def start_postures(model: Model, mean: Floats) -> Floats:
    """(S, D) [rad] the mean posture, the flat hand, a half and a fully closed fist."""
    limits = model.tree.limits
    flexes = np.array(["flexion" in name for name in model.tree.hinges])
    fists = [np.where(flexes, share * limits[:, 1], 0.0) for share in (0.35, 0.75)]
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
    hinges, limbs = len(mean), model.tree.limbs()[model.tree.hinge_bone]
    poses = np.zeros((frames, POSE_HEAD + hinges))
    residual, steps = np.full(frames, np.nan), np.zeros(frames, dtype=np.int64)
    opened, trusted = np.ones((frames, hinges), dtype=bool), np.zeros(frames, bool)
    targets = np.ascontiguousarray(positions, dtype=np.float64)
    weights = np.ascontiguousarray(weights, dtype=np.float64)
    chain, work = chain_of(model), make_work(hinges, markers, basis.shape[1])
    numbers = settings.damping, settings.enough_m, settings.prior_m
    solve_frames(
        targets,
        weights,
        chain,
        work,
        mean,
        basis,
        start_postures(model, mean),
        numbers,
        settings.lever_m,
        settings.restart_m,
        settings.iterations,
        poses,
        residual,
        opened,
        trusted,
        steps,
    )
    if jumps(poses):
        mend(
            targets,
            weights,
            chain,
            work,
            limbs,
            numbers,
            settings.iterations,
            _noise(model, targets, residual),
            poses,
            residual,
            opened,
        )
    if prior is not None:
        precision = precision_of(basis)
        make_likeliest(
            targets,
            weights,
            chain,
            work,
            mean,
            precision,
            settings.prior_m,
            poses,
            residual,
            opened,
            trusted,
            limbs,
        )
        decide(
            targets,
            weights,
            chain,
            work,
            mean,
            precision,
            settings.prior_m,
            settings.lever_m,
            poses,
            opened,
            trusted,
        )
    return Solution(
        poses=poses, residual=residual, opened=opened, trusted=trusted, steps=steps
    )


def decided(
    model: Model,
    positions: Floats,
    poses: Floats,
    prior: PosturePrior | None,
    settings: SolveConfig | None = None,
) -> Bools:
    """(T,) whether markers and a prior decide postures solved elsewhere: see `decide`.

    Parameters
    ----------
    positions : (T, M, 3) [m], NaN where missing; poses : (T, 7 + D).
    prior : without one, three markers in sight do.
    """
    settings, prior = settings or SolveConfig(), knowing(prior, model.tree.hinges)
    enough = np.isfinite(positions).all(axis=2).sum(axis=1) >= ROOT_DOFS // 2
    if prior is None:
        return np.asarray(enough)
    mean, basis = prior_arrays(model, prior)
    markers, hinges = len(model.labels), len(mean)
    decide(
        np.ascontiguousarray(positions),
        np.ones(markers),
        chain_of(model),
        make_work(hinges, markers, basis.shape[1]),
        mean,
        precision_of(basis),
        settings.prior_m,
        settings.lever_m,
        np.ascontiguousarray(poses),
        np.ones((len(poses), hinges), dtype=bool),
        enough,
    )
    return np.asarray(enough)


def _noise(model: Model, targets: Floats, residual: Floats) -> float:
    """[m] noise of the markers per axis, from what is usually left of it."""
    solved = np.flatnonzero(np.isfinite(residual))
    if len(solved) == 0:
        return QUIETEST
    solved = solved[:: max(len(solved) // TASTED, 1)]
    seen = np.asarray(np.isfinite(targets[solved]).all(axis=2))
    square = residual[solved] ** 2 / (3.0 * share_left(model, seen))
    return max(float(np.sqrt(np.median(square))), QUIETEST)


def markers_of(
    recording: Recording, model: Model, *, measured_only: bool = True
) -> Floats:
    """(T, M, 3) [m] the take's samples of the model's markers, NaN where missing.

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
    seen: Bools = found.measured if measured_only else found.origin > 0
    out = np.full((recording.frames, len(model.labels), 3), np.nan)
    for column, label in enumerate(model.labels):
        if label in found.labels:
            at = found.labels.index(label)
            there = seen[:, at]
            out[there, column] = found.positions[there, at]
    return out
