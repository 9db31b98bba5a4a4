"""Which fingers of a solved take had no marker that tells of their joints."""

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.recording import Origin, Recording
from handclean.tree import ROOT_DOFS

SHARE = 0.05
"""Share of a take's frames from which on a finger without markers is worth a word."""


def limbs(model: Model) -> dict[str, Bools]:
    """(M,) which markers sit on a limb, by its name: "thumb", "index", ..."""
    moves = model.tree.carried_by()
    first = np.where(moves.any(axis=1), np.argmax(moves, axis=1), -1)
    of_marker = first[model.bone]
    found = sorted({int(hinge) for hinge in first if hinge >= 0})
    return {model.tree.hinges[h].split("_")[0]: of_marker == h for h in found}


def unseen(model: Model, seen: Bools) -> dict[str, float]:
    """Share of the frames in which a limb has no marker, by its name.

    Of the frames that show enough of the hand to say where it is.

    Parameters
    ----------
    seen : (T, M) markers in sight.
    """
    enough = seen.sum(axis=1) > ROOT_DOFS // 3
    if not enough.any():
        return {}
    some = seen[enough]
    shares: dict[str, Floats] = {
        name: 1.0 - some[:, on].any(axis=1).mean() for name, on in limbs(model).items()
    }
    return {name: float(share) for name, share in shares.items()}


def words(recording: Recording, subject: Subject, *, filled: bool, prior: bool) -> str:
    """One line on the fingers that no marker told of; "" if there were none.

    Parameters
    ----------
    filled : whether filled samples tell, too.
    prior : whether a posture prior stood in for markers.
    """
    model, markers = subject.model, recording.markers
    if markers is None:
        return ""
    there = markers.measured | (filled & (markers.origin == Origin.FILLED))
    seen = np.zeros((recording.frames, len(model.labels)), dtype=bool)
    for column, label in enumerate(model.labels):
        if label in markers.labels:
            seen[:, column] = there[:, markers.labels.index(label)]
    told = [
        f"on the {name} in {100.0 * share:.0f} %"
        for name, share in unseen(model, seen).items()
        if share >= SHARE
    ]
    if not told:
        return ""
    what = "the prior's" if prior else "not measured"
    whose = "their" if len(told) > 1 else "its"
    return f"no marker {', '.join(told)} of frames: {whose} angles are {what}"
