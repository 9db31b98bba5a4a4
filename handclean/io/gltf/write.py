"""A take's motions, or one hand, as skinned glTF (.glb), for viewers and engines.

`handclean.io.gltf.skinned` says what is in the file and writes it. A frame without a
motion holds the last known pose, as in BVH.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from handclean.arrays import runs
from handclean.errors import FileError, UnknownNameError
from handclean.hand.surface import Surface
from handclean.hand.template_surface import template_surface
from handclean.io.gltf.skinned import _TO_Y, SkinnedHand, write_hands
from handclean.io.shared.writing import NO_TREE, held_poses, motions_of
from handclean.recording import Recording
from handclean.remarks import Remark, remark
from handclean.tree import POSE_HEAD, JointTree


def write_glb(
    path: Path,
    recording: Recording,
    *,
    surfaces: Mapping[str, Surface] | None = None,
) -> tuple[Remark, ...]:
    """Write all motions of a take.

    Parameters
    ----------
    surfaces : skins by the name of the motion; a hand without one has the template's.

    Returns
    -------
    what the format cannot hold, one line each

    Raises
    ------
    FileError
        If there is no motion, or a motion has no skeleton or is missing throughout.
    """
    motions = motions_of(path, recording)
    remarks: list[Remark] = []
    hands: list[SkinnedHand] = []
    for name, motion in motions.items():
        if name not in recording.skeletons:
            wrong = f"cannot be written: motion '{name}' has no joint tree"
            raise FileError(path, wrong, NO_TREE)
        tree = recording.skeletons[name]
        for hinge in tree.hinges:
            if hinge not in motion.names:
                raise UnknownNameError(path, "joint angle", hinge, motion.names)
        columns = [POSE_HEAD + motion.names.index(hinge) for hinge in tree.hinges]
        poses = motion.poses[:, [*range(POSE_HEAD), *columns]]
        held, missing = held_poses(poses)
        if missing == len(held):
            raise FileError(path, f"cannot be written: motion '{name}' is all missing")
        if missing:
            remarks.append(
                remark(
                    "not-kept",
                    f"{missing} frames without a pose of '{name}' hold the last one",
                    model=name,
                    count=missing,
                )
            )
        doubtful = () if motion.trusted is None else runs(~motion.trusted)
        if count := sum(stop - start for start, stop in doubtful):
            remarks.append(
                remark(
                    "not-kept",
                    f"{count} of {len(held)} frames of '{name}' are not trusted; they "
                    "move like the others, the animation's extras list them",
                    model=name,
                    count=int(count),
                )
            )
        surface = (surfaces or {}).get(name)
        if surface is None and tree.kind == "hand":
            surface = template_surface(tree)
        if surface is None:
            remarks.append(
                remark(
                    "not-kept",
                    f"'{name}' has no surface: its bones alone are written",
                    model=name,
                )
            )
        head = f"{name}_" if len(motions) > 1 else ""
        doubt = tuple(recording.numbering.span(*rows) for rows in doubtful)
        hands.append(
            SkinnedHand(name=head, tree=tree, surface=surface, poses=held, doubt=doubt)
        )
    if recording.up_axis not in _TO_Y:
        remarks.append(
            remark("not-kept", "the take does not say which way is up: z is taken")
        )
    write_hands(
        path,
        hands,
        rate=recording.rate,
        up_axis=recording.up_axis,
        first_frame=recording.first_frame,
    )
    return tuple(remarks)


def write_hand(path: Path, tree: JointTree, surface: Surface | None) -> None:
    """Write a hand in its zero posture, palm down; without a skin, the template's.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    pose = np.zeros((1, POSE_HEAD + len(tree.hinges)))
    pose[0, 3] = 1.0
    own = template_surface(tree) if surface is None else surface
    hand = SkinnedHand(name="", tree=tree, surface=own, poses=pose)
    write_hands(path, [hand], rate=None, up_axis="+z")
