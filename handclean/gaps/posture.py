"""The posture of a whole take, interpolated where markers leave it open.

What markers in sight do not decide (`decided`) runs along paths of least acceleration
(`paths`). How uncertain such a path is then meets what the markers in sight still say:
each frame with something open minimises ::

    sum_m |t_m - p_m|^2 / sigma^2 + sum_d (q_d - path_d)^2 / sigma_d^2

over root and angles, so that a joint that is half decided follows both, and one that
nothing decides stays on its path. Where the root itself is open, the markers that are
missing take part where the path has them, with the path's sigma.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape, runs
from handclean.gaps.decided import (
    Decided,
    decide,
    doubt_jumps,
    same_finger,
)
from handclean.gaps.offsets import PARTIAL, Leftovers, carry, left_over
from handclean.gaps.paths import Paths, lay_paths, try_bridging
from handclean.gaps.refine import Targets, placed
from handclean.gaps.runs import Gap, Limits, seen_in
from handclean.gaps.uncertainty import spread
from handclean.hand.model import Model
from handclean.ik.doubt import prior_precision
from handclean.ik.frames import SUBSPACE_RESIDUAL_SD_RAD
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import Solution
from handclean.tree import POSE_HEAD, ROOT_DOFS, JointTree

SETTLED = 0.7
"""Share of a marker's noise that carried left-overs leave within a gap; with
`TOGETHER` it puts 68 % or more of what simulated takes hide, and about 95 %, within one
and two sigma per axis, see tests/bench/bench_gaps.py."""

TOGETHER = 2.0
"""The hinges of a finger err together: their variances count more than singly (chosen
with `SETTLED`)."""


@dataclass(frozen=True, kw_only=True)
class Posture:
    """A take's posture, bridged.

    Attributes
    ----------
    poses : (T, 7 + D)
    points : (T, M, 3) [m] where it has the markers, left-overs carried along.
    sigma : (T, D) [rad] standard deviation, NaN where neither markers nor a bridge
        decide a hinge.
    bridged, open_hinge : (T, D) hinges on a path; hinges that are open and stay so.
    bridged_root, open_root : (T,) the same of the root.
    marker_variance : (T, M) [m^2] squared distance that the posture's uncertainty makes
        between an expected but missing marker and where it is thought to be, else 0.
    leftovers : how the markers' places on their bones move.
    gaps : of hinges (by column) and of the root (column D), with what became of them.
    """

    poses: Floats
    points: Floats
    sigma: Floats
    bridged: Bools
    open_hinge: Bools
    bridged_root: Bools
    open_root: Bools
    marker_variance: Floats
    leftovers: Leftovers
    gaps: tuple[Gap, ...]


@dataclass(frozen=True, kw_only=True)
class SolvedTake:
    """A take as inverse kinematics has it, with its gaps.

    Attributes
    ----------
    positions : (T, M, 3) [m] measured samples of the model's markers, NaN elsewhere.
    expected : (T, M) samples measured, or missing in a gap short enough to fill.
    solution : inverse kinematics of ``positions``.
    noise : (M,) [m] standard deviation of the markers per axis.
    """

    model: Model
    positions: Floats
    expected: Bools
    solution: Solution
    noise: Floats


def bridge_posture(
    take: SolvedTake,
    limits: Limits,
    *,
    follows: bool,
    coupled: bool = False,
    settings: SolveConfig | None = None,
) -> Posture:
    """Interpolate the posture wherever markers are missing for a short while.

    Parameters
    ----------
    follows : whether joints that nothing decides follow a posture subspace.
    coupled : whether paths follow the joints that are known, see `coupling`.
    """
    settings = settings or SolveConfig()
    model, positions, expected = take.model, take.positions, take.expected
    expect_shape("expected", expected, *positions.shape[:2])
    solved, hinges = take.solution.poses, len(model.tree.hinges)
    seen, noise = seen_in(positions), take.noise
    decided = decide(
        model, solved, seen, expected, noise, settings.prior_m, follows=follows
    )
    decided = doubt_jumps(decided, model, solved, seen, expected)
    unknown = decided.affected.any(axis=1) | decided.root
    whole = ~(expected & ~seen).any(axis=1)
    tells = np.where(unknown, 0.0, np.where(whole, 1.0, PARTIAL))
    local = left_over(model, solved, positions)
    leftovers = carry(local, tells, limits.longest)
    targets = Targets(model, positions, seen, leftovers.places, noise, settings)

    poses = _led_through(model, solved, expected & ~seen, limits)
    part = np.flatnonzero(~whole & ~unknown)
    poses[part] = targets.fitted(part, poses, np.zeros((len(poses), hinges)))
    paths, poses = _on_paths(model, targets, poses, decided, limits, coupled)
    sigma, variance = _spread(model, poses, seen, expected, noise, paths)
    bridged = paths.hinge_variance > 0.0
    bridged_root = paths.root_variance[:, 0] > 0.0
    return Posture(
        poses=poses,
        points=placed(model, poses, leftovers.places),
        sigma=np.where(bridged, sigma, decided.sigma),
        bridged=bridged,
        open_hinge=decided.affected & ~bridged,
        bridged_root=bridged_root,
        open_root=decided.root & ~bridged_root,
        marker_variance=variance,
        leftovers=leftovers,
        gaps=tuple(gap for cluster in paths.clusters for gap in cluster.gaps),
    )


def _on_paths(
    model: Model,
    targets: Targets,
    poses: Floats,
    decided: Decided,
    limits: Limits,
    coupled: bool,
) -> tuple[Paths, Floats]:
    """Lay paths, refine, and once more from ends that agree with the first round."""
    is_open = decided.affected, decided.root, decided.lost
    tried = try_bridging(poses, *is_open, limits, coupled=coupled)
    first = lay_paths(model.tree, poses, *is_open, limits, tried)
    part = np.flatnonzero(decided.affected.any(axis=1) | decided.root)
    start = first.poses.copy()
    start[part] = targets.fitted(
        part, start, _held(first, decided), first.root_variance
    )
    second = lay_paths(model.tree, start, *is_open, limits, tried)
    count = targets.seen.astype(np.int64) @ model.tree.carried_by()[model.bone]
    ends = second.poses.copy()
    _lead_inner_gaps(ends, start, count, second, model.tree)
    ends[part] = targets.fitted(
        part, ends, _held(second, decided), second.root_variance
    )
    return second, ends


def _lead_inner_gaps(
    poses: Floats, refined_once: Floats, count: Ints, paths: Paths, tree: JointTree
) -> None:
    """Lead paths, in place, through frames in which fewer markers are seen than beside.

    A hinge may stay open over frames some of which show more of the markers it moves:
    there they pull it off its path. The frames in between follow by as much.

    Parameters
    ----------
    refined_once : (T, 7 + D) what the markers in sight made of the paths.
    count : (T, D) how many markers that each hinge moves are seen.
    """
    for cluster in paths.clusters:
        column = cluster.gaps[0].column
        if cluster.refused or column >= len(tree.hinges):
            continue
        for gap in cluster.gaps:
            rows = np.arange(gap.start, gap.stop)
            fewer = count[rows, column] < count[rows, column].max()
            if not fewer.any():
                continue
            path = poses[:, POSE_HEAD + column]
            more = rows[~fewer]
            pulled = refined_once[more, POSE_HEAD + column] - path[more]
            frames = np.concatenate([[gap.start - 1], more, [gap.stop]])
            off = np.interp(rows[fewer], frames, np.pad(pulled, 1))
            path[rows[fewer]] = np.clip(path[rows[fewer]] + off, *tree.limits[column])


def _led_through(
    model: Model, solved: Floats, missing: Bools, limits: Limits
) -> Floats:
    """(T, 7 + D) poses to start from where markers are missing.

    A chain may have two postures for one place of its marker; the one to be found is
    that which joins what was known before and after, so hinges of a finger that lacks a
    marker start between those and not where a frame by itself would put them.
    """
    poses, fingers = solved.copy(), same_finger(model)
    for start, stop in runs(np.asarray(missing.any(axis=1))):
        if start == 0 or stop == len(poses) or stop - start > 2 * limits.longest:
            continue
        lacking = (missing[start:stop] @ fingers).any(axis=0)
        columns = POSE_HEAD + np.flatnonzero(lacking)
        share = np.linspace(0.0, 1.0, stop - start + 2)[1:-1, None]
        ends = solved[start - 1, columns], solved[stop, columns]
        poses[start:stop, columns] = (1.0 - share) * ends[0] + share * ends[1]
    return poses


def _held(paths: Paths, decided: Decided) -> Floats:
    """(T, D) [rad^2] how surely each hinge is where its path has it, 0 if free."""
    held = paths.hinge_variance.copy()
    held[decided.affected & (held == 0.0)] = SUBSPACE_RESIDUAL_SD_RAD**2
    return held


def _spread(
    model: Model,
    poses: Floats,
    seen: Bools,
    expected: Bools,
    noise: Floats,
    paths: Paths,
) -> tuple[Floats, Floats]:
    """(T, D) [rad] sigma of angles, (T, M) [m^2] variance of missing markers."""
    hinges = paths.hinge_variance.shape[1]
    sigma, distance = np.full((len(poses), hinges), np.nan), np.zeros(seen.shape)
    missing = expected & ~seen
    frames = np.flatnonzero(missing.any(axis=1))
    precision = np.tile(prior_precision(hinges), (len(frames), 1))
    root = np.repeat(paths.root_variance[frames], ROOT_DOFS // 2, axis=1)
    held = np.hstack([root, TOGETHER * paths.hinge_variance[frames]])
    np.divide(1.0, held, out=precision, where=held > 0.0)
    weight = seen[frames] / (SETTLED * noise) ** 2
    variance, distance[frames] = spread(
        model, poses[frames], weight, precision, missing[frames]
    )
    sigma[frames] = np.sqrt(variance[:, ROOT_DOFS:])
    return sigma, distance


def what_is_open(
    posture: Posture, model: Model, bone: int, start: int, stop: int
) -> str:
    """Say what stays open, between frames, of all that moves a bone; "" if nothing."""
    if posture.open_root[start:stop].any():
        return "the hand's place"
    carried = model.tree.carried_by()[bone]
    still_open = carried & posture.open_hinge[start:stop].any(axis=0)
    names = np.array(model.tree.hinges, dtype=object)[still_open]
    return str(names[0]) if len(names) else ""
