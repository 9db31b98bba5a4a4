"""Which fingers of a solved take had no marker that tells of their joints."""

import numpy as np

from handclean.arrays import Bools
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.recording import Origin, Recording
from handclean.remarks import Remark, remark
from handclean.tree import ROOT_DOFS

MIN_SHARE = 0.05
"""Share of a take's frames without a marker beyond a joint, from which on it is said.
Chosen."""


def unseen(model: Model, seen: Bools) -> dict[str, float]:
    """Share of the frames in which a finger has no marker, or none beyond a joint.

    Of the frames that show enough of the hand to say where it is. "on the thumb", if
    that is a finger's innermost joint; otherwise "beyond thumb_ip_flexion", the joint
    which it is in most frames.

    Parameters
    ----------
    seen : (T, M) markers in sight.
    """
    enough = seen.sum(axis=1) > ROOT_DOFS // 3
    if not enough.any():
        return {}
    moves = model.tree.carried_by()
    bare = (seen[enough].astype(np.int64) @ moves[model.bone]) == 0
    limb = model.tree.limbs()[model.tree.hinge_bone]
    found = {}
    for first in sorted(set(limb.tolist())):
        name = model.tree.hinges[first]
        found[f"on the {name.split('_')[0]}"] = float(bare[:, first].mean())
        part = bare[:, limb == first] & ~bare[:, [first]]
        shares = part.mean(axis=0)
        inner = int(np.flatnonzero(limb == first)[np.argmax(shares)])
        found[f"beyond {model.tree.hinges[inner]}"] = float(shares.max())
    return found


def unobserved(
    recording: Recording, subject: Subject, name: str, *, filled: bool, prior: bool
) -> tuple[Remark, ...]:
    """Remark on joints that no marker told of, if there were some.

    Parameters
    ----------
    name : of the motion.
    filled : whether filled samples tell, too.
    prior : whether a posture prior stood in for markers.
    """
    model, markers = subject.model, recording.markers
    if markers is None:
        return ()
    there = markers.measured | (filled & (markers.origin == Origin.FILLED))
    seen = np.zeros((recording.frames, len(model.labels)), dtype=bool)
    for column, label in enumerate(model.labels):
        if label in markers.labels:
            seen[:, column] = there[:, markers.labels.index(label)]
    share_of = unseen(model, seen)
    shares = {w: share for w, share in share_of.items() if share >= MIN_SHARE}
    told = [f"{where} in {100.0 * share:.0f} %" for where, share in shares.items()]
    if not told:
        return ()
    what = "the prior's" if prior else "not measured"
    whose = "their" if len(told) > 1 else "its"
    text = f"{name}: no marker {', '.join(told)} of frames: {whose} angles are {what}"
    return (remark("unobserved", text, model=name, shares=shares),)
