"""Which bones move the skin, and where it is when the fingers are not spread.

Along a finger the share of the bones beyond a joint rises from 0 to 1 over about the
finger's thickness, by the smooth step ``t^2 (3 - 2 t)``, so that it is exactly 0 or 1
on the middles of the segments. Between neighbours it depends on which finger's flesh is
nearer: only in the web do two fingers have a share. Along means along: the back of the
next finger, however near, has none.
"""

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.factory.sculpt.anatomy import Anatomy, Finger, turn_of
from handclean.hand.surface import BONES_PER_VERTEX, edges_of

WHOLE_SHARE = 10_000
"""What the whole-numbered shares of a vertex sum to (chosen)."""

_MM = 1e-3
"""Metres of a millimetre."""

_REACH_MM = {"thumb": (11.0, 11.0, 9.0), "index": (9.0, 8.5, 7.0)}
"""[mm] how far from a joint the skin follows both bones, on thumb and index finger
(chosen)."""

_CREASE_SHARE = 0.4
"""How much further out the palm's side of a finger begins, share of the depth
(chosen)."""

# Differences of distances over which one finger's skin becomes another's, and the
# thumb's the palm's: the latter at the thumb's base, and at its web.
_WEB_M, _THENAR_M = 4.0 * _MM, (11.0 * _MM, 20.0 * _MM)
_THENAR_WIDENS_M = (20.0 * _MM, 45.0 * _MM)  # along the thumb


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
            start, stop = _THENAR_WIDENS_M
            y = finger.tube.local(points)[:, 1]
            web = smooth_step((y - start) / (stop - start))
            width = (1.0 - web) * _THENAR_M[0] + web * _THENAR_M[1]
            owns = smooth_step((others - away[0]) / (2.0 * width) + 0.5)
        else:
            others = np.min([away[m] for m in range(5) if m != n], axis=0)
            owns = smooth_step((others - away[n]) / (2.0 * _WEB_M) + 0.5)
        out.append(owns[:, None] * _along(finger, points))
    return out


def _along(finger: Finger, points: Floats) -> Floats:
    """(V, 3) shares of a finger's bones by how far along it a place is."""
    _, y, z = finger.tube.local(points).T
    thumb = finger.name == "thumb"
    reach = _MM * np.array(_REACH_MM["thumb" if thumb else "index"])
    if not thumb:
        reach *= finger.tube.half[2] / (9.3 * _MM)
    start = 0.0 if thumb else _CREASE_SHARE * np.clip(-z, 0.0, 15.0 * _MM)
    beyond = [
        smooth_step((y - joint) / (2.0 * size) + 0.5)
        for joint, size in zip((start, *finger.joints[1:3]), reach, strict=True)
    ]
    first, second, third = beyond
    return np.column_stack(
        [first * (1.0 - second), first * second * (1.0 - third), first * second * third]
    )


def webs(shares: list[Floats], faces: Ints) -> Bools:
    """(V,) which vertices are in a web or next to it: two fingers move them."""
    whose = np.stack([share.sum(axis=1) for share in shares[1:]], axis=1)
    out: Bools = (whose > 0.0).sum(axis=1) > 1
    ends = edges_of(faces)
    own = np.argmax(whose, axis=1)
    parted = own[ends[:, 0]] != own[ends[:, 1]]
    out[ends[parted & (whose[ends].max(axis=2) > 0.2).all(axis=1)]] = True
    near = ends[out[ends].any(axis=1)]
    out[near] = True
    return out


def soothed(values: Floats, faces: Ints, where: Bools, rounds: int) -> Floats:
    """(V, N) values, at some vertices averaged with those of their neighbours.

    Fingers come so near each other that one vertex can be one finger's and the next
    another's. The skin of a web stretches instead, and is rounded where it is creased.
    """
    ends = edges_of(faces)
    both = np.vstack([ends, ends[:, ::-1]])
    count = 1.0 + np.bincount(both[:, 0], minlength=len(values))
    out = values.copy()
    for _ in range(rounds):
        total = out.copy()
        for k in range(values.shape[1]):
            total[:, k] += np.bincount(both[:, 0], out[both[:, 1], k], len(values))
        out[where] = (total / count[:, None])[where]
    return out


def skin_weights(shares: Floats) -> tuple[Ints, Ints]:
    """(V, 4) bones and shares of `WHOLE_SHARE`, largest first, of (V, 15) shares.

    The hand has the rest.
    """
    rest = np.maximum(1.0 - shares.sum(axis=1, keepdims=True), 0.0)
    full = np.hstack([rest, shares])
    bones = np.argsort(-full, axis=1, kind="stable")[:, :BONES_PER_VERTEX]
    part = np.take_along_axis(full, bones, axis=1)
    part *= WHOLE_SHARE / part.sum(axis=1, keepdims=True)
    weights = np.round(part).astype(np.int64)
    weights[:, 0] = WHOLE_SHARE - weights[:, 1:].sum(axis=1)
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
