"""Which joints the markers in sight decide, and which they would if none were hidden.

With a nominal noise of the markers and a loose prior of all degrees of freedom,
`spread` says how much of each one's variance is left. One is *decided* if the markers
explain at least `DECIDED` of its prior variance. It is *affected* by missing markers if
those in sight do not decide it while those expected (in sight, or in a gap short enough
to fill) would explain distinctly more.

So a marker further out decides the chain it hangs on (Maycock 2015 section III-C) as
far as the geometry allows, and a joint without any marker beyond it is not affected by
anything, except through the posture subspace: with a prior, joints that only follow it
(of which markers explain less than `MIN_EXPLAINED_SHARE`) are affected in every frame
in which some other joint is (Schroeder 2017, "Fully automatic tracking").

That is said of small steps. A chain may also have two postures for one place of its
marker, an elbow up and an elbow down, and inverse kinematics may change over while a
marker that tells them apart is missing. Hinges that jump where such a marker vanishes
or comes back are therefore affected as well, see `doubt_jumps`.

The Jacobian is taken once per stretch of frames in which the same markers are in sight,
or several times in a long one.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Floats, runs
from handclean.gaps.uncertainty import spread
from handclean.hand.model import Model
from handclean.ik.doubt import MIN_EXPLAINED_SHARE, prior_precision, stretches_of
from handclean.tree import POSE_HEAD, ROOT_DOFS

DECIDED = 0.9
"""Share of its variance that markers must explain for a joint to count as known
(chosen)."""

DISTINCT = 0.05
"""How much more of it the missing markers should explain for them to matter
(chosen)."""

JUMP = (0.15, 4.0)
"""[rad] a jump is more than this and so many times the steps just beside it
(chosen)."""

LEAST = 3
"""Markers without which inverse kinematics keeps the pose it had (as
`handclean.ik.frames.MIN_MARKERS`)."""


@dataclass(frozen=True, kw_only=True)
class Decided:
    """What the markers in sight decide.

    Attributes
    ----------
    affected : (T, D) hinges that missing markers leave open.
    lost : (T, D) hinges that markers leave open which are not expected: those in sight
        do not decide them, all that the take ever shows would.
    root : (T,) whether they leave the root open.
    sigma : (T, D) [rad] standard deviation of each hinge, NaN where nothing decides it.
    """

    affected: Bools
    lost: Bools
    root: Bools
    sigma: Floats


def decide(
    model: Model,
    poses: Floats,
    seen: Bools,
    expected: Bools,
    noise: Floats,
    nominal_m: float,
    *,
    follows: bool,
) -> Decided:
    """Find what the markers in sight decide in every frame.

    Parameters
    ----------
    poses : (T, 7 + D) roughly right.
    seen, expected : (T, M) markers in sight; those and the ones hidden only briefly.
    noise : (M,) [m] standard deviation of a marker per axis.
    nominal_m : [m] noise at which a joint must be decided to count as known: the one
        inverse kinematics weighs its prior with.
    follows : whether joints that nothing decides follow a posture subspace.
    """
    stretches = stretches_of(seen, expected)
    starts = np.array([start for start, _ in stretches], dtype=np.int64)
    stops = np.array([stop for _, stop in stretches], dtype=np.int64)
    middles, here, hoped = poses[(starts + stops) // 2], seen[starts], expected[starts]
    precision = np.tile(prior_precision(len(model.tree.hinges)), (len(starts), 1))
    ask, nominal = np.zeros(here.shape, dtype=bool), nominal_m**-2.0
    whole = np.broadcast_to(seen.any(axis=0), here.shape)
    left, left_hoped, left_whole, variance = (
        spread(model, middles, weight, precision, ask)[0]
        for weight in (
            here * nominal, hoped * nominal, whole * nominal, here / noise**2
        )
    )  # fmt: skip
    left, left_hoped = left * precision, left_hoped * precision
    weak, untold = left > 1.0 - DECIDED, left > 1.0 - MIN_EXPLAINED_SHARE
    sigma = np.where(untold, np.nan, np.sqrt(variance))[:, ROOT_DOFS:]
    missing = np.any(here != hoped, axis=1)
    touched = weak & (left > left_hoped + DISTINCT) & missing[:, None]
    few = (here.sum(axis=1) < LEAST) & (hoped.sum(axis=1) >= LEAST)
    touched[few] = True
    if follows:
        linked = touched.any(axis=1)
        touched[linked, ROOT_DOFS:] |= untold[linked, ROOT_DOFS:]
    lost = weak & (left > left_whole * precision + DISTINCT) & ~touched
    lengths = stops - starts
    return Decided(
        affected=np.repeat(touched[:, ROOT_DOFS:], lengths, axis=0),
        lost=np.repeat(lost[:, ROOT_DOFS:], lengths, axis=0),
        root=np.repeat(touched[:, :ROOT_DOFS].any(axis=1), lengths),
        sigma=np.repeat(sigma, lengths, axis=0),
    )


def doubt_jumps(
    decided: Decided, model: Model, poses: Floats, seen: Bools, expected: Bools
) -> Decided:
    """Count hinges that jump where a marker of their finger comes or goes as affected.

    Parameters
    ----------
    poses : (T, 7 + D) as solved; seen, expected : (T, M)
    """
    angles, affected = poses[:, POSE_HEAD:], decided.affected.copy()
    fingers = same_finger(model)
    missing = expected & ~seen
    steps = np.abs(np.diff(angles, axis=0, prepend=angles[:1]))
    for start, stop in runs(np.asarray(missing.any(axis=1))):
        if start == 0 or stop == len(poses):
            continue
        beside = np.concatenate(
            [steps[max(start - 5, 0) : start], steps[stop + 1 :][:5]]
        )
        usual = beside.max(axis=0, initial=0.0)
        jumps = np.maximum(steps[start], steps[stop]) > JUMP[0] + JUMP[1] * usual
        affected[start:stop] |= jumps & (missing[start:stop] @ fingers)
    return replace(decided, affected=affected)


def same_finger(model: Model) -> Bools:
    """(M, D) whether a hinge is on the limb of the tree that a marker sits on."""
    limbs = model.tree.limbs()
    limb_of_hinge, limb_of_marker = limbs[model.tree.hinge_bone], limbs[model.bone]
    return np.asarray(limb_of_marker[:, None] == limb_of_hinge)
