"""Which skins a format that shows hands gives those of a solved take."""

from collections.abc import Mapping

import numpy as np

from handclean.commands.shared import hands, sessions
from handclean.errors import TAKE, UsageError
from handclean.hand.subject import Subject
from handclean.hand.surface import Surface
from handclean.recording import Recording
from handclean.remarks import Remark, remark
from handclean.runner.batch import Source
from handclean.tree import JointTree

OTHER_LENGTH_SHARE = 0.03
"""Share by which a bone's length may differ before it is said to be another hand's
(chosen)."""

_LEAST_BONE_M = 0.01
"""[m] joints nearer to each other tell nothing of a hand's size (chosen)."""


def skins_of(
    source: Source, recording: Recording
) -> tuple[dict[str, Surface], tuple[Remark, ...]]:
    """Return skins by the name of the motion, and remarks on their owners.

    Raises
    ------
    UsageError
        If no subject is of a hand that the take has.
    """
    found = hands.subjects(source)
    _expect_one(found, recording)
    remarks = [
        remark("fit", text, model=name)
        for name, subject in found.items()
        if name in recording.skeletons
        and (text := _unlike(name, subject, recording.skeletons[name]))
    ]
    return sessions.surfaces(found), tuple(remarks)


def _expect_one(found: Mapping[str, Subject], recording: Recording) -> None:
    """Expect that the take has the hand of at least one subject."""
    if found.keys() & recording.motions.keys() or not recording.motions:
        return
    theirs, has = " and ".join(found), " and ".join(recording.motions)
    raise UsageError(
        f"has the motion of {has}, but --subject is {theirs}; "
        f"it should be the subject of {has}",
        where=TAKE,
    )


def _unlike(name: str, subject: Subject, tree: JointTree) -> str:
    """Say that a skin is of a hand with other bones than those that moved."""
    own, moved = _lengths(subject.model.tree), _lengths(tree)
    shared = [b for b in moved if b in own and moved[b] >= _LEAST_BONE_M]
    if not shared:
        return ""
    worst = max(shared, key=lambda bone: abs(own[bone] / moved[bone] - 1.0))
    share = own[worst] / moved[worst] - 1.0
    if abs(share) <= OTHER_LENGTH_SHARE:
        return ""
    return (
        f"--subject '{subject.name}' is hardly the {name} hand of this take: from "
        f"{_joint(tree, worst)} to the joint before it are {1e3 * own[worst]:.1f} mm, "
        f"in the take {1e3 * moved[worst]:.1f} mm ({100 * share:+.0f} %)"
    )


def _lengths(tree: JointTree) -> dict[str, float]:
    """Distance [m] of every bone's joint from that of the bone it hangs on."""
    lengths = np.linalg.norm(tree.offsets, axis=1)
    return dict(zip(tree.bones, lengths.tolist(), strict=True))


def _joint(tree: JointTree, bone: str) -> str:
    return tree.joints[tree.bone(bone)]
