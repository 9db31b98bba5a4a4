"""Which bones move the skin, and where it is when the fingers are not spread.

Along a finger the share of the bones beyond a joint rises from 0 to 1 over about the
finger's thickness, by the smooth step ``t^2 (3 - 2 t)``, so that it is exactly 0 or 1
on the middles of the segments. Between neighbours it depends on which finger's flesh is
nearer: only in the web do two fingers have a share. Along means along: the back of the
next finger, however near, has none.
"""

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.surface import MOST_BONES
from handclean.sculpt.anatomy import Anatomy, Finger, turn_of

WHOLE = 10_000
"""What the shares of a vertex sum to."""

_MM = 1e-3
_REACH = {"thumb": (11.0, 11.0, 9.0), "index": (10.0, 8.5, 7.0)}
"""[mm] how far from a joint the skin follows both bones, on thumb and index finger."""

_WEB = (
    4.0 * _MM
)  # difference of distances over which one finger's skin becomes another's
_THENAR = 14.0 * _MM  # the same for the ball of the thumb and the palm


def smooth_step(t: Floats) -> Floats:
    """Rise from 0 at 0 to 1 at 1, level beyond."""
    t = np.clip(t, 0.0, 1.0)
    out: Floats = t * t * (3.0 - 2.0 * t)
    return out


def finger_shares(anatomy: Anatomy, points: Floats) -> list[Floats]:
    """Shares (V, 3) of each finger's bones at (V, 3) [m] places, thumb first."""
    away = [finger.tube.distance(points) for finger in anatomy.fingers]
    palm = [tube.distance(points) for tube, _ in anatomy.palm[1:5]]
    out = []
    for n, finger in enumerate(anatomy.fingers):
        if finger.name == "thumb":
            others = np.min([*palm, *away[1:]], axis=0)
            owns = smooth_step((others - away[0]) / (2.0 * _THENAR) + 0.5)
        else:
            others = np.min([away[m] for m in range(5) if m != n], axis=0)
            owns = smooth_step((others - away[n]) / (2.0 * _WEB) + 0.5)
        out.append(owns[:, None] * _along(finger, points))
    return out


def _along(finger: Finger, points: Floats) -> Floats:
    """(V, 3) shares of a finger's bones by how far along it a place is."""
    y = finger.tube.local(points)[:, 1]
    thumb = finger.name == "thumb"
    reach = _MM * np.array(_REACH["thumb" if thumb else "index"])
    if not thumb:
        reach *= finger.tube.half[2] / (9.3 * _MM)
    beyond = [
        smooth_step((y - joint) / (2.0 * size) + 0.5)
        for joint, size in zip(finger.joints, reach, strict=False)
    ]
    first, second, third = beyond
    return np.column_stack(
        [first * (1.0 - second), first * second * (1.0 - third), first * second * third]
    )


def skin_weights(shares: list[Floats]) -> tuple[Ints, Ints]:
    """(V, 4) bones and shares of `WHOLE`, largest first; the hand has the rest."""
    full = np.hstack([np.zeros((len(shares[0]), 1)), *shares])
    full[:, 0] = np.maximum(1.0 - full.sum(axis=1), 0.0)
    bones = np.argsort(-full, axis=1, kind="stable")[:, :MOST_BONES]
    part = np.take_along_axis(full, bones, axis=1)
    part *= WHOLE / part.sum(axis=1, keepdims=True)
    weights = np.round(part).astype(np.int64)
    weights[:, 0] = WHOLE - weights[:, 1:].sum(axis=1)
    order = np.argsort(-weights, axis=1, kind="stable")
    bones, weights = (np.take_along_axis(n, order, axis=1) for n in (bones, weights))
    return bones, weights


def closed_up(
    anatomy: Anatomy, points: Floats, shares: list[Floats]
) -> tuple[Floats, Floats]:
    """(V, 3) [m] skin in the zero posture: linear blend skinning turned round.

    The spread posture carries a place v of the zero posture to A v + t, with A and t
    the bones' turns and shifts by its shares; here v is solved for. Returns A, too.
    """
    turn: Floats = np.tile(np.eye(3), (len(points), 1, 1))
    shift: Floats = np.zeros(points.shape)
    for finger, share in zip(anatomy.fingers, shares, strict=True):
        part, knuckle = share.sum(axis=1), finger.tube.origin
        rotation = turn_of(finger.name)
        turn += np.multiply.outer(part, rotation - np.eye(3)).astype(np.float64)
        shift += np.multiply.outer(part, knuckle - rotation @ knuckle)
    zero = np.linalg.solve(turn, (points - shift)[:, :, None])[:, :, 0]
    return zero.astype(np.float64), turn
