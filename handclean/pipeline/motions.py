"""Joint angles of hands as layouts are made for, from takes of any format."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UsageError
from handclean.pipeline import sessions
from handclean.pipeline.batch import Source
from handclean.tree import POSE_HEAD, JointTree


@dataclass(frozen=True, kw_only=True)
class HandMotion:
    """One hand's motion in one take.

    Attributes
    ----------
    where : file it is from.
    side : "left", "right", or "" if the file does not say.
    names : D angles.
    poses : (T, 7 + D), NaN where unknown.
    """

    where: str
    side: str
    names: tuple[str, ...]
    poses: Floats


def read(source: Source, odd: list[str]) -> list[HandMotion]:
    """Motions of all hands of a take.

    Parameters
    ----------
    odd : what is odd about the file is appended.

    Raises
    ------
    FileError
        If it has none.
    """
    recording = sessions.read(source)
    odd += [f"{source.path}: {trap}" for trap in sessions.traps(source, recording)]
    found = []
    for name, motion in recording.motions.items():
        tree = recording.skeletons.get(name)
        if tree is not None and tree.kind != "hand":
            continue
        found.append(
            HandMotion(
                where=str(source.path),
                side=tree.side if tree is not None else "",
                names=motion.names,
                poses=motion.poses,
            )
        )
    if not found:
        raise FileError(
            source.path, "has no joint angles", "'handclean solve' adds them"
        )
    return found


def common(motions: Sequence[HandMotion], tree: JointTree) -> tuple[str, ...]:
    """Names of the angles that a hand and all motions have, but the forearm's.

    Raises
    ------
    UsageError
        If there is none.
    """
    own = [
        hinge
        for hinge, bone in zip(tree.hinges, tree.hinge_bone, strict=True)
        if tree.bones[bone] != "forearm"
    ]
    names = tuple(name for name in own if all(name in m.names for m in motions))
    if not names:
        where = motions[0].where
        raise UsageError(f"{where}: has no joint angle that the hand has")
    return names


def angles(motion: HandMotion, names: tuple[str, ...]) -> Floats:
    """(T, D) [rad] these angles of a motion."""
    columns = [POSE_HEAD + motion.names.index(name) for name in names]
    return np.ascontiguousarray(motion.poses[:, columns])


def on_tree(motion: HandMotion, tree: JointTree) -> Floats:
    """(T, 7 + D) known frames as poses of a hand.

    Angles the motion lacks are 0; a root that is unknown anywhere is at the origin.
    """
    out = np.zeros((len(motion.poses), POSE_HEAD + len(tree.hinges)))
    out[:, :POSE_HEAD] = motion.poses[:, :POSE_HEAD]
    for d, hinge in enumerate(tree.hinges):
        if hinge in motion.names:
            out[:, POSE_HEAD + d] = motion.poses[
                :, POSE_HEAD + motion.names.index(hinge)
            ]
    known = np.isfinite(out[:, POSE_HEAD:]).all(axis=1)
    out = out[known]
    if not np.isfinite(out[:, :POSE_HEAD]).all():
        out[:, :POSE_HEAD] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    return np.ascontiguousarray(out)
