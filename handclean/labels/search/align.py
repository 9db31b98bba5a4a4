"""The first frame: which points are the hand, how it stands, which marker is which.

Maycock 2015 section III-A, for every cluster of points and every start posture:

1. *PCA alignment* (eq. 1), see `orientations`. Where that does not fit - arbitrary
   postures, points of other things - rotations spread evenly over all orientations
   follow.
2. *Scale*, of a template only, from the two oriented bounding boxes.
3. *ICP*, rigid, each step assigning by the Hungarian method with a shrinking gate
   (`icp.rigid_icp`).
4. *Hungarian and inverse kinematics* in turns until the assignment stands
   (`assign_and_solve`).
5. *Score* (eq. 2): E + alpha D. E is the mean distance of assigned points in units of
   the mean distance between neighbouring markers, D the share of markers without a
   point: both without dimension, so that alpha = 1 means the same for any hand and
   unit.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.model import marker_positions
from handclean.labels.clusters import cluster_candidates
from handclean.labels.search.icp import rigid_icp
from handclean.labels.search.orientations import (
    principal_axes,
    sign_combinations,
    spread_rotations,
)
from handclean.labels.target import TrackTarget, scale_target
from handclean.labels.track.alternatives import exchange_fingers, search_missing_fingers
from handclean.labels.track.fit import (
    assign_and_solve,
    closed_gate,
    measure_fit,
    observe_points,
)
from handclean.labels.track.state import FrameState, new_state
from handclean.labels.track.tracker import Tracker, TrackSetup, make_tracker

RIGID_GATE_M, SOLVE_GATE_M = 0.06, 0.035
"""[m] how far a marker may be from its point in a rigid alignment, and when its pose is
solved for. Chosen."""

FINGER_SEARCH_RADIUS_M = 0.1
"""[m] how far a finger may be from its points when the rest of the hand stands.
Chosen: the length of a finger."""

SETTLED_COST_PER_MARKER = 2.0
"""`fit_cost` per marker under which a fit may be all there is to find. Chosen."""

CLOSELY_SEARCHED_FITS = 5
"""How many of the fits have their fingers searched for and exchanged. Chosen."""

ORIENTATIONS_KEPT = 4
"""How many orientations of a posture in a cluster are kept. Chosen."""

CLUSTER_RADIUS_FACTOR = 1.1
"""Smallest radius of clusters, per the longest step between markers. Chosen."""

MIN_TEMPLATE_SCALE, MAX_TEMPLATE_SCALE = 0.7, 1.4
"""How far a template is scaled to the points. Chosen: the hands of children and of
large men."""

GOOD_RMS_FACTOR, GOOD_RMS_EXTRA_M = 1.25, 3e-4
"""A fit is good if its RMS distance is under the calibrated one times the factor, plus
the extra [m]. Chosen."""

GOOD_MISSING_SHARE = 0.1
"""Share of markers that a good fit may lack. Chosen."""


class SearchEffort(NamedTuple):
    """How much a search tries.

    postures : how many of the target's start postures. rotations : how many
    orientations besides those of the axes. kept : how many of the rigid alignments are
    solved for.
    """

    postures: int
    rotations: int
    kept: int


@dataclass(frozen=True, kw_only=True)
class FrameFit:
    """A target fitted to the points of one frame.

    Attributes
    ----------
    target : the target, scaled if it was a template.
    frame : where.
    pose : (7 + D,)
    chosen : (M,) row of each marker's point among the frame's points, -1 none.
    score : equation 2, without dimension; smaller is better.
    rms : [m] of the assigned markers.
    """

    target: TrackTarget
    frame: int
    pose: Floats
    chosen: Ints
    score: float
    rms: float


def is_good_fit(fit: FrameFit) -> bool:
    """Whether a fit is as close as the model promises, with hardly a marker missing."""
    usual = float(np.sqrt(np.mean(fit.target.sigma**2)))
    close = fit.rms < GOOD_RMS_FACTOR * usual + GOOD_RMS_EXTRA_M
    return close and float(np.mean(fit.chosen < 0)) <= GOOD_MISSING_SHARE


def search_frame(
    points: Floats,
    target: TrackTarget,
    frame: int,
    setup: TrackSetup,
    effort: SearchEffort,
) -> list[FrameFit]:
    """Fit a target to the points of one frame in every way worth trying.

    Parameters
    ----------
    points : (P, 3) [m]
    frame : its number, for the record.
    effort : how much is tried.

    Returns
    -------
    The fits found, no two with the same assignment, the best first; or only one, as
    soon as it is good.
    """
    starts = _rigid_starts(points, target, effort)
    starts.sort(key=lambda start: start.score)
    rough: dict[bytes, _RoughFit] = {}
    fits: dict[bytes, FrameFit] = {}
    alpha = setup.labelling.alpha
    for start in starts[: effort.kept]:
        found = _solved(points, start, setup)
        if found.cost < SETTLED_COST_PER_MARKER * len(target.sigma):
            fit = _finished(points, found, frame, alpha)
            if is_good_fit(fit):
                return [fit]
            fits.setdefault(fit.chosen.tobytes(), fit)
            continue
        key = found.state.chosen.tobytes()
        same = rough.get(key)
        if np.isfinite(found.cost) and (same is None or found.cost < same.cost):
            rough[key] = found
    best = sorted(rough.values(), key=lambda one: one.cost)[:CLOSELY_SEARCHED_FITS]
    for one in best:
        fit = _finished(points, one, frame, alpha)
        fits.setdefault(fit.chosen.tobytes(), fit)
    return sorted(fits.values(), key=lambda fit: fit.score)


class _RigidStart(NamedTuple):
    """A rigid alignment: its score, the pose, and the target, scaled if a template."""

    score: float
    pose: Floats
    target: TrackTarget


@dataclass(frozen=True)
class _RoughFit:
    """A pose solved for from a rigid alignment, and its `fit_cost`."""

    cost: float
    pose: Floats
    state: FrameState
    tracker: Tracker
    target: TrackTarget


def _rigid_starts(
    points: Floats, target: TrackTarget, effort: SearchEffort
) -> list[_RigidStart]:
    """Return every posture at its best orientations in every cluster of points."""
    angles = target.starts[: effort.postures]
    markers = len(target.model.labels)
    spread = spread_rotations(effort.rotations)
    out: list[_RigidStart] = []
    radius = CLUSTER_RADIUS_FACTOR * target.step
    for rows in cluster_candidates(points, radius, max(4, markers // 2)):
        centre, axes, extent = principal_axes(points[rows])
        sized = target
        if not target.fixed_size:
            sized = scale_target(target, _template_scale(target, extent))
        for posture, shape in zip(angles, _shapes(sized, angles), strict=True):
            turns = sign_combinations(principal_axes(shape)[1], axes)
            turns = np.ascontiguousarray(np.concatenate([turns, spread]))
            fits = rigid_icp(shape, points, turns, centre, RIGID_GATE_M)
            for r in np.argsort(fits.scores, kind="stable")[:ORIENTATIONS_KEPT]:
                pose = np.concatenate([fits.poses[r], posture])
                out.append(_RigidStart(float(fits.scores[r]), pose, sized))
    return out


def _template_scale(target: TrackTarget, extent: Floats) -> float:
    """Scale of a template whose flat hand is as large as points of (3,) [m] extent."""
    flat = _shapes(target, target.starts[1:2])[0]
    ratio = extent[:2] / principal_axes(flat)[2][:2]
    return float(np.clip(np.median(ratio), MIN_TEMPLATE_SCALE, MAX_TEMPLATE_SCALE))


def _solved(points: Floats, start: _RigidStart, setup: TrackSetup) -> _RoughFit:
    """Assign points and solve for the pose, from a rigid alignment."""
    target = start.target
    tracker = make_tracker(target, setup)
    state = new_state(len(target.sigma), len(target.mean))
    least = closed_gate(tracker.variance)
    cost = assign_and_solve(
        start.pose, points, state, tracker, tracker.basis, max(SOLVE_GATE_M, least),
        least,
    )  # fmt: skip
    return _RoughFit(cost, start.pose, state, tracker, target)


def _finished(points: Floats, rough: _RoughFit, frame: int, alpha: float) -> FrameFit:
    """Search for fingers without points, exchange fingers, and score (eq. 2)."""
    tracker, state, pose = rough.tracker, rough.state, rough.pose
    observe_points(points, state.chosen, state.observed, state.weight)
    cost = search_missing_fingers(
        pose, points, state, tracker, FINGER_SEARCH_RADIUS_M, rough.cost
    )
    exchange_fingers(pose, points, state, tracker, cost)
    has = state.chosen >= 0
    away = np.sqrt(measure_fit(pose, state, tracker).squares[has])
    score = away.mean() / rough.target.spacing + alpha * (1.0 - has.mean())
    return FrameFit(
        target=rough.target,
        frame=frame,
        pose=pose,
        chosen=state.chosen.copy(),
        score=float(score),
        rms=float(np.sqrt(np.mean(away**2))),
    )


def _shapes(target: TrackTarget, angles: Floats) -> Floats:
    """(S, M, 3) [m] markers of each posture, the root unturned at the origin."""
    poses = np.zeros((len(angles), 7 + angles.shape[1]))
    poses[:, 3] = 1.0
    poses[:, 7:] = angles
    return marker_positions(target.model, poses)
