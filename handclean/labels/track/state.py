"""What tracking reads and writes: points in frames, marker statistics, poses, results.

All are bundles of arrays, so that compiled functions can take and change them.
"""

from typing import NamedTuple, Protocol, cast

import numpy as np

from handclean.arrays import Bools, Bytes, Floats, Floats32, Ints
from handclean.kernels import jit
from handclean.kernels.gauss_newton import ROOT_OPEN
from handclean.labels.target import TrackTarget
from handclean.labels.track.residual_gate import UsualResiduals, usual_residuals
from handclean.labels.track.tracker import TrackRules

ABSENT, FOLLOWED, RETURNED, REJECTED = 0, 1, 2, 3
"""Outcome of a marker in a frame: without a point; with one as in the frame before;
with one again; with one that was too far from the model."""

ANCHOR, NEWCOMER, OUTLIER = 0, 1, 2
"""Role of a marker while a frame is fitted: it holds the model; it was out of sight
and is on trial; its point was rejected."""

FIRST_LINK_TRUST = 0.9
"""Share of links between points that are taken to be right at the start. Chosen."""

FIRST_ERROR_M2 = 1e-6
"""[m^2] added to each axis' variance of a marker's prediction at the start, 1 mm
squared. Chosen."""


class Progress(Protocol):
    """Numbers that tracking carries from frame to frame.

    Attributes
    ----------
    open_level : what `find_open_hinges` said last.
    lost_frames : frames on end with too few markers.
    step_product, step_square, velocity_share : regression of the root's steps on the
        steps that its velocity foretold, see `learn_velocity`.
    link_trust : share of links between points that were right.
    """

    open_level: int
    lost_frames: int
    step_product: float
    step_square: float
    velocity_share: float
    link_trust: float


_PROGRESS = np.dtype(
    [
        ("open_level", np.int64),
        ("lost_frames", np.int64),
        ("step_product", np.float64),
        ("step_square", np.float64),
        ("velocity_share", np.float64),
        ("link_trust", np.float64),
    ]
)


class FrameSequence(NamedTuple):
    """The points of a take in the direction in which they are tracked.

    at (P, 3) [m]. start (T + 1,) : where each frame's points begin. previous (P,) : row
    of the point before on the same path, -1 none; the later one when going backwards.
    """

    at: Floats
    start: Ints
    previous: Ints


class MarkerStats(NamedTuple):
    """What has been learnt of each marker while tracking.

    bias (M, 3) [m] : of its place beside the model, in its link's frame. error_variance
    (M,) [m^2] : of the prediction's error per axis. unseen (M,) : frames out of sight.
    usual : its usual distances from the model.
    """

    bias: Floats
    error_variance: Floats
    unseen: Ints
    usual: UsualResiduals


class PairCosts(NamedTuple):
    """What it costs to take each point for each marker, or none.

    pair (M, P) : cost of a pair, infinity beyond the gate. no_point (M,) : cost of
    leaving a marker without a point.
    """

    pair: Floats
    no_point: Floats


class FrameState(NamedTuple):
    """The frame at hand, and what is carried from frame to frame.

    pose, last_pose, velocity, trial_pose (7 + D,). chosen (M,) : row of each marker's
    point among the frame's points, -1 none. observed (M, 3) [m], weight (M,) : that
    point, and 1 where it holds the model. role (M,) : `ANCHOR`... confidence (M,) :
    probability that the label is right. frozen (D,) : hinges beyond which no marker
    was seen. last_row (M,) : row in the take of each marker's point in the frame
    before, -1 none. is_open (D,), solved_weight (M,) : joints that the last solve left
    open, and the weights it had.
    progress : see `Progress`.
    """

    pose: Floats
    last_pose: Floats
    velocity: Floats
    trial_pose: Floats
    chosen: Ints
    observed: Floats
    weight: Floats
    role: Ints
    confidence: Floats32
    frozen: Bools
    last_row: Ints
    is_open: Bools
    solved_weight: Floats
    progress: Progress


class TrackResult(NamedTuple):
    """What was tracked, one row per frame of the take.

    pose (T, 7 + D). chosen (T, M) : row of the cloud, -1 none. confidence (T, M) :
    probability that the label is right. outcome (T, M) : `ABSENT`... cost (T,) : see
    `fit_cost`. rms (T,) [m]. tracked (T,) : whether the model was tracked.
    """

    pose: Floats
    chosen: Ints
    confidence: Floats32
    outcome: Bytes
    cost: Floats
    rms: Floats
    tracked: Bools


@jit
def frame_points(sequence: FrameSequence, t: int) -> Floats:
    """(P, 3) [m] the points of a frame."""
    points: Floats = sequence.at[sequence.start[t] : sequence.start[t + 1]]
    return points


def start_stats(target: TrackTarget, rules: TrackRules, unseen: Ints) -> MarkerStats:
    """Return what is known of the markers before the first frame.

    Parameters
    ----------
    unseen : (M,) not 0 for markers that the first frame does not show.
    """
    first = target.sigma**2 / 3.0 + (2.0 * rules.min_error_m) ** 2 + FIRST_ERROR_M2
    return MarkerStats(
        bias=np.zeros((len(target.sigma), 3)),
        error_variance=first,
        unseen=unseen.astype(np.int64),
        usual=usual_residuals(target.sigma, rules.small_m),
    )


def new_state(markers: int, hinges: int) -> FrameState:
    """Return the state before the first frame; its pose is still to be set.

    Parameters
    ----------
    markers, hinges : how many there are, M and D.
    """
    progress = cast(Progress, np.zeros(1, dtype=_PROGRESS).view(np.recarray)[0])
    progress.open_level = ROOT_OPEN
    progress.velocity_share = 1.0
    progress.link_trust = FIRST_LINK_TRUST
    return FrameState(
        pose=np.zeros(7 + hinges),
        last_pose=np.zeros(7 + hinges),
        velocity=np.zeros(7 + hinges),
        trial_pose=np.zeros(7 + hinges),
        chosen=np.zeros(markers, dtype=np.int64),
        observed=np.zeros((markers, 3)),
        weight=np.zeros(markers),
        role=np.zeros(markers, dtype=np.int64),
        confidence=np.zeros(markers, dtype=np.float32),
        frozen=np.zeros(hinges, dtype=np.bool_),
        last_row=np.full(markers, -1),
        is_open=np.zeros(hinges, dtype=np.bool_),
        solved_weight=np.full(markers, -1.0),
        progress=progress,
    )


def empty_result(frames: int, markers: int, hinges: int) -> TrackResult:
    """Return the result of a take in which nothing was tracked.

    Parameters
    ----------
    frames, markers, hinges : how many there are, T, M and D.
    """
    return TrackResult(
        pose=np.zeros((frames, 7 + hinges)),
        chosen=np.full((frames, markers), -1),
        confidence=np.zeros((frames, markers), dtype=np.float32),
        outcome=np.zeros((frames, markers), dtype=np.uint8),
        cost=np.full(frames, np.inf),
        rms=np.full(frames, np.nan),
        tracked=np.zeros(frames, dtype=bool),
    )
