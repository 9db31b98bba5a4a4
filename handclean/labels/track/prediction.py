"""Where markers are expected in the next frame, and how sure that is.

The pose moves on with its last velocity, as far as that has foretold anything. Joints
beyond which no marker was seen are frozen. A marker is expected where that pose puts
it, plus its bias: the place where it was last seen beside the model, since skin slides
and calibrations err, slowly.

The gate follows from the variance of the prediction error, which each marker learns
from its own errors. Out of sight it grows from frame to frame.
"""

import math

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.kernels import jit
from handclean.kernels.gauss_newton import Chain
from handclean.labels.track.fit import place_markers
from handclean.labels.track.state import FrameState, MarkerStats
from handclean.labels.track.tracker import Tracker, TrackRules

LED_DRIFT_SHARE, MAX_LED_DRIFT_SD = 0.3, 3.0
"""Drift of an unseen marker that markers further out lead, per that of others; and its
most, in sd of the prediction. Chosen."""

MAX_DRIFT_PER_REACH = 0.5
"""Most that an unseen marker drifts, per its reach. Chosen."""

GROWING_ERROR_SHARE, SHRINKING_ERROR_SHARE = 0.2, 0.03
"""Share of a frame's error in the variance of the prediction, where the error is larger
than usual, and where it is smaller. Chosen: gates open quickly and close slowly."""

MAX_ERROR_RATIO = 16.0
"""A frame's squared error counts up to so many times the variance. Chosen."""

VELOCITY_MEMORY = 0.1
"""Share of a frame in the regression of steps on velocities. Chosen."""

MIN_SQUARED_STEP_M2 = 1e-10
"""[m^2] mean squared step under which the hand stands and the regression says nothing:
a hundredth of a millimetre, squared. Chosen."""


@jit
def freeze_unseen_hinges(weight: Floats, chain: Chain, frozen: Bools) -> None:
    """Write which hinges (D,) have no marker of weight (M,) over 0 further out."""
    frozen[:] = True
    for m in range(weight.shape[0]):
        if weight[m] > 0.0:
            link = chain.link[m]
            while link > 0 and frozen[link - 1]:
                frozen[link - 1] = False
                link = chain.parent[link]


@jit
def predict_pose(state: FrameState, limits: Floats) -> None:
    """Move the pose on by its velocity, in place, within limits (D, 2) [rad]."""
    pose, norm = state.pose, 0.0
    share = state.progress.velocity_share
    for n in range(pose.shape[0]):
        if n < 7 or not state.frozen[n - 7]:
            pose[n] += share * state.velocity[n]
        if 3 <= n < 7:
            norm += pose[n] * pose[n]
    for n in range(3, 7):
        pose[n] /= math.sqrt(norm)
    for d in range(state.frozen.shape[0]):
        pose[7 + d] = min(max(pose[7 + d], limits[d, 0]), limits[d, 1])


@jit
def expected_places(pose: Floats, bias: Floats, tracker: Tracker) -> Floats:
    """(M, 3) [m] where a pose puts the markers, each with its bias (M, 3) [m]."""
    markers = bias.shape[0]
    places = np.zeros((markers, 3))
    turns = place_markers(pose, tracker, places)
    for m in range(markers):
        turn = turns[tracker.chain.link[m]]
        for n in range(3):
            for j in range(3):
                places[m, n] += turn[n, j] * bias[m, j]
    return places


@jit
def prediction_variance(
    frozen: Bools,
    stats: MarkerStats,
    chain: Chain,
    rules: TrackRules,
    gate_scale: float,
) -> Floats:
    """(M,) [m^2] variance per axis of where each marker is expected.

    Parameters
    ----------
    frozen : (D,) hinges beyond which no marker was seen.
    gate_scale : by how much all gates are wider than usual.
    """
    out = np.zeros(stats.unseen.shape[0])
    least = rules.min_error_m * rules.min_error_m
    for m in range(out.shape[0]):
        variance = max(stats.error_variance[m], least) * gate_scale * gate_scale
        if stats.unseen[m] > 0:
            stuck, link = False, chain.link[m]
            while link > 0:
                stuck = stuck or frozen[link - 1]
                link = chain.parent[link]
            drift = rules.drift_m * stats.unseen[m]
            if not stuck:  # markers further out tell where it is
                most = MAX_LED_DRIFT_SD * math.sqrt(variance)
                drift = min(LED_DRIFT_SHARE * drift, most)
            drift = min(drift, MAX_DRIFT_PER_REACH * rules.reach_m)
            variance += drift * drift
        out[m] = variance
    return out


@jit
def learn_prediction_error(
    expected: Floats, state: FrameState, stats: MarkerStats, min_error_m: float
) -> None:
    """Update the variance of each marker's prediction, quickly where errors grow.

    Parameters
    ----------
    expected : (M, 3) [m] where the markers were expected in this frame.
    """
    variance, observed = stats.error_variance, state.observed
    for m in range(variance.shape[0]):
        if state.weight[m] <= 0.0 or stats.unseen[m] > 0:
            continue
        error = 0.0
        for n in range(3):
            error += (observed[m, n] - expected[m, n]) ** 2 / 3.0
        most = MAX_ERROR_RATIO * variance[m] + min_error_m**2
        share = SHRINKING_ERROR_SHARE
        if error > variance[m]:
            share = GROWING_ERROR_SHARE
        variance[m] += share * (min(error, most) - variance[m])


@jit
def learn_velocity(state: FrameState, max_turn_rad: float) -> None:
    """Take the step to this pose as velocity, and how much of the last one came true.

    The share that came true is a running regression of the root's steps on the steps
    foretold. A hinge that turned by more than ``max_turn_rad`` jumped, and has no
    velocity.
    """
    progress = state.progress
    along, square, sign = 0.0, 0.0, 0.0
    for n in range(3, 7):
        sign += state.pose[n] * state.last_pose[n]
    for n in range(state.pose.shape[0]):
        flipped = 3 <= n < 7 and sign < 0.0  # q and -q are the same rotation
        last = -state.last_pose[n] if flipped else state.last_pose[n]
        step = state.pose[n] - last
        if n < 3:
            along += step * state.velocity[n]
            square += state.velocity[n] * state.velocity[n]
        state.velocity[n] = step if n < 7 or abs(step) < max_turn_rad else 0.0
    progress.step_product += VELOCITY_MEMORY * (along - progress.step_product)
    progress.step_square += VELOCITY_MEMORY * (square - progress.step_square)
    if progress.step_square > MIN_SQUARED_STEP_M2:
        share = progress.step_product / progress.step_square
        progress.velocity_share = min(max(share, 0.0), 1.0)
