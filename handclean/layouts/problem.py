"""What a layout is judged by, worked out once for all candidate places.

A candidate moves with one bone. In keyframe f its place is x and its Jacobian, by a
step of `handclean.hand.model.moved`, has three columns for the hand's rotation and one
for every direction of the posture subspace, J M (Schroeder 2016, equation 4), or for
every joint angle: all in metres per radian. The three columns for the hand's
translation are left out, because a marker on the forearm tells where the hand is; kept,
they are multiplied by the hand's length L, so that they too are metres per something
about as large as a radian.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from handclean.arrays import Floats, Ints, expect_shape
from handclean.errors import HandcleanError, UnknownNameError, UsageError
from handclean.hand.model import Model, jacobian, marker_positions, neutral_pose
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template import HAND_LENGTH_M
from handclean.ik.prior import PosturePrior, learn
from handclean.kernels import layouts
from handclean.layouts.keyframes import keyframes, known_frames
from handclean.layouts.settings import LayoutConfig
from handclean.layouts.visibility import hidden_share
from handclean.remarks import listed
from handclean.tree import POSE_HEAD, ROOT_DOFS, JointTree

_STILL_RAD = 1e-6
"""[rad] a joint that turns less does not move (chosen: rounding)."""

_MOTION_FRAMES = 200
"""Frames of the whole motion, for the methods that rank candidates (chosen)."""

_TURNS = ("turn_x", "turn_y", "turn_z")
_SHIFTS = ("shift_x", "shift_y", "shift_z")


@dataclass(frozen=True, kw_only=True)
class Problem:
    """N candidates in F keyframes, with C columns of the Jacobian.

    Attributes
    ----------
    model : the candidates as markers on a hand; vertices are called by their numbers.
    columns : names of the C unknowns.
    angles : (F, D) [rad] of the keyframes, in the order of the tree's hinges.
    home : (N, 3) [m] candidates in the zero posture.
    places : (F, N, 3) [m] candidates in the keyframes, the wrist at the origin.
    jacobian : (F, N, 3, C) [m/rad]
    motion : (S, N, 3) [m] candidates in frames spread evenly over the motion.
    hidden : (N,) share of keyframes and directions in which each is not seen.
    length_m : L, the hand's length.
    grams : (N, F, C (C + 1) / 2) [m^2] products J'J, lower triangle row by row.
    gaps : (N, N) smallest squared distance over the keyframes, in L^2.
    """

    model: Model
    columns: tuple[str, ...]
    angles: Floats
    home: Floats
    places: Floats
    jacobian: Floats
    motion: Floats
    hidden: Floats
    length_m: float
    grams: Floats = field(init=False, repr=False, compare=False)
    gaps: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        count, size = len(self.home), len(self.columns)
        expect_shape("places", self.places, "F", count, 3)
        expect_shape("jacobian", self.jacobian, len(self.places), count, 3, size)
        expect_shape("motion", self.motion, "S", count, 3)
        expect_shape("hidden", self.hidden, count)
        square = np.swapaxes(self.jacobian, 2, 3) @ self.jacobian
        low = np.tril_indices(size)
        grams = np.ascontiguousarray(square[:, :, low[0], low[1]].swapaxes(0, 1))
        gaps = np.zeros((count, count))
        layouts.smallest_gaps(np.ascontiguousarray(self.places / self.length_m), gaps)
        object.__setattr__(self, "grams", grams)
        object.__setattr__(self, "gaps", gaps)

    @property
    def needed(self) -> int:
        """Fewest markers that give as many equations as there are unknowns."""
        return -(-len(self.columns) // 3)


def on_bones(surface: Surface, tree: JointTree, rows: Ints) -> Model:
    """Vertices that one bone moves, as markers on that bone, called by their numbers.

    Parameters
    ----------
    rows : (N,) vertices, as `handclean.layouts.feasible.feasible` returns them.
    """
    bone = np.ascontiguousarray(surface.bones[rows, 0])
    return Model(
        tree=tree,
        labels=tuple(str(row) for row in rows.tolist()),
        bone=bone,
        at=surface.vertices[rows] - rest_joints(tree)[bone],
    )


def subspace_of(
    takes: Sequence[Floats], names: tuple[str, ...], settings: LayoutConfig
) -> PosturePrior:
    """Learn the posture subspace that layouts should serve.

    Parameters
    ----------
    takes : (T, D) [rad]; names : of the D angles.
    settings : dimensions, share.

    Raises
    ------
    HandcleanError
        If the motion does not vary along as many directions.
    """
    angles = known_frames(takes, max(sum(map(len, takes)), 1))
    still = [name for name, turn in zip(names, _turns(angles), strict=True) if not turn]
    if len(still) == len(names):
        raise HandcleanError(
            f"motion: no joint moves ({listed(still)}); a subspace needs motion"
        )
    asked = settings.dimensions or None
    prior = learn(takes, names, directions=asked, share=settings.share)
    varied = int((prior.deviations > _STILL_RAD).sum())
    if varied < len(prior.deviations):
        why = f" ({listed(still)} never move)" if still else ""
        raise HandcleanError(
            f"motion: varies along {varied} directions, not "
            f"{settings.dimensions}{why}; ask for {varied} dimensions or fewer"
        )
    return prior


def _turns(angles: Floats) -> list[bool]:
    """Whether each of D angles moves."""
    if not len(angles):
        return [False] * angles.shape[1]
    return [bool(turn > _STILL_RAD) for turn in np.ptp(angles, axis=0)]


def make_problem(
    model: Model,
    takes: Sequence[Floats],
    names: tuple[str, ...],
    settings: LayoutConfig,
    *,
    prior: PosturePrior | None = None,
    surface: Surface | None = None,
) -> Problem:
    """Work out what layouts of a hand's candidates are judged by.

    Parameters
    ----------
    model : the candidates: `on_bones`, or a marker set that is glued on already.
    takes : (T, D) [rad] angles of the motion to capture; names : of the D angles.
    settings : keyframes, dimensions, share, full, anchor, visibility.
    prior : the posture subspace; learnt from the takes if None.
    surface : the hand's skin; only visibility needs it.

    Raises
    ------
    UnknownNameError
        If the hand lacks one of the angles.
    HandcleanError
        If the motion is too short or does not move, or if all candidates together do
        not determine the posture.
    """
    tree = model.tree
    frames = _on_tree(tree, names, keyframes(takes, settings.keyframes))
    titles, directions = _directions(tree, takes, names, settings, prior)
    length = HAND_LENGTH_M * tree.scale
    poses = _poses(tree, frames)
    turning = np.stack([jacobian(model, pose) for pose in poses])
    parts = [turning[..., 3:ROOT_DOFS], turning[..., ROOT_DOFS:] @ directions]
    columns = _TURNS + titles
    if not settings.anchor:
        parts.insert(0, turning[..., :3] * length)
        columns = _SHIFTS + columns
    spread = _on_tree(tree, names, known_frames(takes, _MOTION_FRAMES))
    problem = Problem(
        model=model,
        columns=columns,
        angles=frames,
        home=marker_positions(model, neutral_pose(tree)[None])[0],
        places=marker_positions(model, poses),
        jacobian=np.ascontiguousarray(np.concatenate(parts, axis=-1)),
        motion=marker_positions(model, _poses(tree, spread)),
        hidden=_hidden(model, surface, poses, settings),
        length_m=length,
    )
    _check_determined(problem)
    return problem


def keyframe_poses(problem: Problem) -> Floats:
    """(F, 7 + D) the keyframes as poses, the wrist at the origin, unturned."""
    return _poses(problem.model.tree, problem.angles)


def _hidden(
    model: Model, surface: Surface | None, poses: Floats, settings: LayoutConfig
) -> Floats:
    if settings.visibility == 0.0:
        return np.zeros(len(model.labels))
    if surface is None:
        raise UsageError("visibility: needs the hand's skin; leave it at 0 without one")
    return hidden_share(model, surface, poses)


def _poses(tree: JointTree, angles: Floats) -> Floats:
    poses = np.tile(neutral_pose(tree), (len(angles), 1))
    poses[:, POSE_HEAD:] = angles
    return poses


def _hinges(tree: JointTree, names: Sequence[str], where: str) -> list[int]:
    for name in names:
        if name not in tree.hinges:
            raise UnknownNameError(where, "angle", name, tree.hinges)
    return [tree.hinges.index(name) for name in names]


def _on_tree(tree: JointTree, names: tuple[str, ...], angles: Floats) -> Floats:
    """(T, D') angles of all the tree's hinges; those not named are 0."""
    out = np.zeros((len(angles), len(tree.hinges)))
    out[:, _hinges(tree, names, "motion")] = angles
    return out


def _directions(
    tree: JointTree,
    takes: Sequence[Floats],
    names: tuple[str, ...],
    settings: LayoutConfig,
    prior: PosturePrior | None,
) -> tuple[tuple[str, ...], Floats]:
    """Names and (D, l) directions of the unknown posture."""
    if settings.full:
        within = [tree.bones[bone] != "forearm" for bone in tree.hinge_bone]
        titles = tuple(np.array(tree.hinges)[within].tolist())
        return titles, np.eye(len(tree.hinges))[:, within]
    prior = prior or subspace_of(takes, names, settings)
    kept = _kept(prior, settings)
    directions = np.zeros((len(tree.hinges), kept))
    rows = _hinges(tree, prior.names, "posture subspace")
    directions[rows] = prior.components[:, :kept]
    return tuple(f"direction {n}" for n in range(1, kept + 1)), directions


def _kept(prior: PosturePrior, settings: LayoutConfig) -> int:
    """How many of a prior's directions count."""
    count = len(prior.deviations)
    if settings.dimensions > count:
        raise HandcleanError(
            f"posture subspace: has {count} directions, not {settings.dimensions}; ask "
            f"for {count} dimensions or fewer"
        )
    if settings.dimensions:
        return settings.dimensions
    held = np.cumsum(prior.variance_share)
    return min(int(np.searchsorted(held, settings.share - 1e-9)) + 1, count)


def _check_determined(problem: Problem) -> None:
    """Raise if even all candidates together leave something undetermined."""
    blind = np.abs(problem.jacobian).max(axis=(1, 2)).min(axis=0) < 1e-9
    if blind.any():
        named = [name for name, b in zip(problem.columns, blind, strict=True) if b]
        raise HandcleanError(
            f"no candidate moves with {listed(named)}; allow markers farther out on "
            "the fingers, or leave these out of what is sought"
        )
    square = np.swapaxes(problem.jacobian, 2, 3) @ problem.jacobian
    ends = np.linalg.eigvalsh(square.sum(axis=1))[:, [0, -1]]
    if (ends[:, 0] < 1e-12 * ends[:, 1]).any():
        raise HandcleanError(
            f"the candidates together do not determine the {len(problem.columns)} "
            "unknowns; allow markers on more bones, or take fewer dimensions"
        )
