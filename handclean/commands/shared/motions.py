"""Joint angles of hands to learn from, from takes of any format.

Nothing is learnt from a frame that is not trusted: its angles count as unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.commands.shared import sessions
from handclean.errors import FileError, HandcleanError, UsageError
from handclean.remarks import Remark, remark
from handclean.runner.batch import Source
from handclean.tree import POSE_HEAD, JointTree


@dataclass(frozen=True, kw_only=True)
class HandMotion:
    """One hand's motion in one take.

    Attributes
    ----------
    where : file it is from.
    side : "left", "right", or "" if the file does not say.
    names : D angles.
    poses : (T, 7 + D), angles NaN where unknown or not trusted.
    doubtful : frames that are not trusted.
    """

    where: str
    side: str
    names: tuple[str, ...]
    poses: Floats
    doubtful: int = 0


def read(source: Source, odd: list[Remark]) -> list[HandMotion]:
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
    odd += recording.remarks
    found = []
    for name, motion in recording.motions.items():
        tree = recording.skeletons.get(name)
        if tree is not None and tree.kind != "hand":
            continue
        poses = motion.poses
        doubt = np.zeros(len(poses), dtype=bool)
        if motion.trusted is not None:
            doubt = ~motion.trusted
        poses[doubt, POSE_HEAD:] = np.nan
        found.append(
            HandMotion(
                where=str(source.path),
                side=tree.side if tree is not None else "",
                names=motion.names,
                poses=poses,
                doubtful=int(doubt.sum()),
            )
        )
    if not found:
        raise FileError(
            source.path, "has no joint angles", "'handclean solve' adds them"
        )
    return found


def left_out(motions: Sequence[HandMotion], of: str = "") -> tuple[Remark, ...]:
    """Remark on frames that are not learnt from, and on takes that have no others.

    Parameters
    ----------
    of : what the texts begin with: "--held-out: ".
    """
    remarks: list[Remark] = []
    if count := sum(motion.doubtful for motion in motions):
        frames = sum(len(motion.poses) for motion in motions)
        remarks.append(
            remark(
                "trust",
                f"{of}{count} of {frames} frames are not trusted: they are left out",
                count=count,
            )
        )
    none = sorted({m.where for m in motions if 0 < m.doubtful == len(m.poses)})
    if none and len(none) < len({motion.where for motion in motions}):
        few = ", ".join(none[:3]) + (", ..." if len(none) > 3 else "")
        remarks.append(remark("trust", f"{of}no frame is trusted of {few}", takes=none))
    return tuple(remarks)


def known(takes: Sequence[Floats]) -> int:
    """Count the frames of (T, D) angles in which all are known."""
    return sum(int(np.isfinite(take).all(axis=1).sum()) for take in takes)


def expect_enough(takes: Sequence[Floats], least: int, what: str) -> None:
    """Expect so many frames with all angles known and trusted.

    Parameters
    ----------
    takes : (T, D) angles each, NaN where unknown or not trusted.
    what : they are needed for.

    Raises
    ------
    HandcleanError
        If there are fewer.
    """
    frames = known(takes)
    if frames < least:
        count = f"{frames} frame{'s' * (frames != 1)}" if frames else "no frame"
        raise HandcleanError(
            f"inputs: have {count} in which all angles are known and trusted; "
            f"{what} needs {least} at least"
        )


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
        raise UsageError("has no joint angle that the hand has", where=Path(where))
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
