"""Where to start: poses from nothing but marker places, the hand's size and its side.

The root comes from a weighted alignment of the template's markers, in several postures,
to the measured ones; from each of them the pose is fitted, and the best kept. The size
of the hand, and whether it is a left or a right one, are those of the template that
fits a few frames best.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.errors import HandcleanError, UsageError
from handclean.hand.marker_set import MarkerSet
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.hand.template import HAND_LENGTH_M, template
from handclean.kernels import bundle, pose_fit
from handclean.kernels.align import align
from handclean.subject.frames import Frames
from handclean.subject.shape import PosePrior
from handclean.tree import POSE_HEAD

TEMPLATE_PLACE_SD_M = 0.008
"""[m] how far a marker may lie from a template's before anything is calibrated
(chosen)."""

OUTLIER_M = 0.04
"""[m] a marker so far away counts little, when nothing is calibrated (chosen)."""

TRIED_SIZE_RATIOS = np.exp(np.linspace(np.log(0.53), np.log(1.45), 15))
"""Sizes of hands to try, against the template's (chosen: from small children to large
men)."""

CLEAR_SIDE_RATIO = 1.5
"""By what factor one side must fit better than the other to be called clear
(chosen)."""


def postures(model: Model) -> Floats:
    """(3, D) [rad] flat hand, half closed hand, fist; within the limits."""
    tree = model.tree
    rows = np.zeros((3, len(tree.hinges)))
    for d, name in enumerate(tree.hinges):
        if name == "thumb_cmc_abduction":
            rows[:, d] = np.radians([10.0, 35.0, 35.0])
        elif name.startswith("thumb"):
            rows[:, d] = np.radians([2.0, 16.0, 30.0])
        elif name.endswith("flexion") and not name.startswith("wrist"):
            rows[:, d] = np.radians([5.0, 40.0, 75.0])
    return np.clip(rows, tree.limits[:, 0], tree.limits[:, 1])


def loose(model: Model) -> PosePrior:
    """Return what is expected of a pose when the hand is not known either."""
    return PosePrior(
        centre=postures(model)[1],
        hold=0.8**-2,
        limits=model.tree.limits,
        bound=0.1**-2,
    )


def scaled(model: Model, size: float) -> Model:
    """Return the model, all of it ``size`` times as large."""
    tree = replace(
        model.tree,
        offsets=model.tree.offsets * size,
        scale=model.tree.scale * size,
    )
    return replace(model, tree=tree, at=model.at * size)


def first_poses(model: Model, targets: Floats, seen: Bools) -> tuple[Floats, Floats]:
    """Find the pose of every frame from scratch.

    Parameters
    ----------
    targets : (T, M, 3) [m]; seen : (T, M), three or more in every frame.

    Returns
    -------
    (T, 7 + D) poses and their (T,) costs.
    """
    body = loose(model).body(model)
    room = bundle.make_room(body)
    weights, soft = seen / TEMPLATE_PLACE_SD_M**2, OUTLIER_M**-2
    best = np.zeros((len(targets), POSE_HEAD + len(model.tree.hinges)))
    lowest, cost = np.full(len(targets), np.inf), np.zeros(len(targets))
    for angles in postures(model):
        poses = aligned(model, angles, targets, seen)
        pose_fit.fit_poses(poses, targets, weights, soft, 10, body, room, cost)
        better = cost < lowest
        best[better], lowest[better] = poses[better], cost[better]
    pose_fit.fit_poses(best, targets, weights, soft, 30, body, room, lowest)
    return best, lowest


def aligned(model: Model, angles: Floats, targets: Floats, seen: Bools) -> Floats:
    """(T, 7 + D) the posture ``angles`` laid onto the measured markers."""
    pose = neutral_pose(model.tree)
    pose[POSE_HEAD:] = angles
    there = marker_positions(model, pose[None])[0]
    poses = np.tile(pose, (len(targets), 1))
    for t in range(len(targets)):
        align(there, targets[t], seen[t].astype(float), poses[t])
    return poses


def fitted(
    model: Model,
    expected: PosePrior,
    poses: Floats,
    targets: Floats,
    seen: Bools,
    sigma_m: float,
    soft: float,
) -> Floats:
    """(T, 7 + D) poses fitted from ``poses`` with the hand as it is."""
    body = expected.body(model)
    out, cost = poses.copy(), np.zeros(len(poses))
    room = bundle.make_room(body)
    pose_fit.fit_poses(out, targets, seen / sigma_m**2, soft, 80, body, room, cost)
    return out


@dataclass(frozen=True, kw_only=True)
class Guess:
    """What a few frames tell of a hand before it is calibrated.

    Attributes
    ----------
    side : "left" or "right", as asked for.
    size : against the template's.
    clear : whether a hand of the other side would fit clearly worse.
    """

    side: str
    size: float
    clear: bool


def guess(marker_set: MarkerSet, frames: Frames, side: str) -> Guess:
    """Estimate the hand's size, and make sure that it is of the side asked for.

    Raises
    ------
    HandcleanError
        If what is measured is not of a hand's size.
    UsageError
        If it is clearly a hand of the other side.
    """
    _expect_a_hand(marker_set, frames, side)
    costs = {}
    for chirality in ("left", "right"):
        model = marker_set.on(template(chirality, forearm=marker_set.forearm))
        costs[chirality] = [
            first_poses(scaled(model, size), frames.targets, frames.seen)[1].sum()
            for size in TRIED_SIZE_RATIOS
        ]
    other = "left" if side == "right" else "right"
    mine, mirrored = min(costs[side]), min(costs[other])
    if mine > CLEAR_SIDE_RATIO * mirrored:
        raise UsageError(
            f"marker set {marker_set.name}: the take shows a {other} hand, not a {side}"
            f" one; give --side {other}, or the set of that hand"
        )
    best = int(np.argmin(costs[side]))
    if best in (0, len(TRIED_SIZE_RATIOS) - 1):
        _refuse(float(TRIED_SIZE_RATIOS[best]))
    return Guess(
        side=side,
        size=float(TRIED_SIZE_RATIOS[best]),
        clear=mirrored > CLEAR_SIDE_RATIO * mine,
    )


def _spread(points: Floats, seen: Bools) -> float:
    """Root mean square distance of the seen points of one frame from their centre."""
    there = points[seen]
    return float(np.sqrt(np.mean(np.sum((there - there.mean(axis=0)) ** 2, axis=1))))


def _expect_a_hand(marker_set: MarkerSet, frames: Frames, side: str) -> None:
    """Compare how far markers spread with how far a template's do."""
    model = marker_set.on(template(side, forearm=marker_set.forearm))
    pose = neutral_pose(model.tree)
    pose[POSE_HEAD:] = postures(model)[1]
    there = marker_positions(model, pose[None])[0]
    ratios = [
        _spread(points, seen) / _spread(there, seen)
        for points, seen in zip(frames.targets, frames.seen, strict=True)
    ]
    ratio = float(np.median(ratios))
    if not 0.4 < ratio < 2.0:
        _refuse(ratio)


def _refuse(ratio: float) -> None:
    power = 10.0 ** np.round(np.log10(max(ratio, 1e-12)))
    what = f"the markers span a hand about {1e3 * ratio * HAND_LENGTH_M:.3g} mm long"
    if power >= 10 or power <= 0.1:
        factor = power if power > 1 else 1 / power
        much = "large" if power > 1 else "small"
        what += f", some {factor:g} times too {much}; is the unit right (--unit)?"
    else:
        what += "; hands of 110 to 250 mm are known; are labels and set right?"
    raise HandcleanError(f"calibrate-hand: {what}")
