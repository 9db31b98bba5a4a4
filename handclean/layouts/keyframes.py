"""A few postures that stand for a motion: farthest-point optimisation.

Schloemer, Heck and Deussen, Farthest-point optimized point sets with maximized minimum
distance, HPG 2011: point after point is taken out and put where it is farthest from
all others, until that changes nothing. Here the places are the motion's frames and the
distance is that of joint angles. It begins with the frame farthest from the mean, and
goes on with the frame farthest from all chosen so far.
"""

from collections.abc import Sequence

import numpy as np

from handclean.arrays import Floats, Ints, expect_shape
from handclean.errors import HandcleanError

_MOST_FRAMES = 20_000
"""Frames among which keyframes are sought, at most (chosen; memory)."""

_MOST_ROUNDS = 50
"""Rounds over all keyframes, at most (chosen)."""


def keyframes(takes: Sequence[Floats], count: int) -> Floats:
    """(F, D) [rad] angles of the keyframes of all takes.

    Parameters
    ----------
    takes : (T, D) [rad] angles each; frames with an unknown angle are left out.
    count : F.

    Raises
    ------
    HandcleanError
        If there are fewer known frames than keyframes, or fewer that differ.
    """
    angles = known_frames(takes, _MOST_FRAMES)
    if len(angles) < count:
        raise HandcleanError(
            f"motion: {len(angles)} frames have all angles, for {count} keyframes; "
            "take fewer keyframes or a longer motion"
        )
    chosen, least = farthest(angles, count)
    if not least > 0.0:
        raise HandcleanError(
            f"motion: has fewer than {count} postures that differ, for as many "
            "keyframes; take fewer keyframes or a motion that moves"
        )
    out: Floats = angles[np.sort(chosen)]
    return out


def known_frames(takes: Sequence[Floats], most: int) -> Floats:
    """(T, D) [rad] frames of all takes in which all angles are known.

    Parameters
    ----------
    most : of more frames than this, evenly spread ones are taken.
    """
    for take in takes:
        expect_shape("angles", take, "T", takes[0].shape[1])
    angles = np.concatenate(list(takes), dtype=np.float64)
    angles = angles[np.isfinite(angles).all(axis=1)]
    if len(angles) <= most:
        return np.asarray(angles)
    return angles[np.linspace(0, len(angles) - 1, most).round().astype(np.int64)]


def farthest(angles: Floats, count: int) -> tuple[Ints, float]:
    """Choose rows that are far apart, and say how far the two closest are.

    Parameters
    ----------
    angles : (T, D)
    """
    squares = np.empty((count, len(angles)))
    chosen = np.zeros(count, dtype=np.int64)
    start = _square(angles, angles.mean(axis=0))
    for n in range(count):
        chosen[n] = start.argmax() if n == 0 else squares[:n].min(axis=0).argmax()
        squares[n] = _square(angles, angles[chosen[n]])
    for _ in range(_MOST_ROUNDS):
        changed = False
        for n in range(count if count > 1 else 0):
            far = np.delete(squares, n, axis=0).min(axis=0)
            best = int(far.argmax())
            if far[best] > far[chosen[n]]:
                chosen[n], changed = best, True
                squares[n] = _square(angles, angles[best])
        if not changed:
            break
    apart = squares[:, chosen][~np.eye(count, dtype=bool)]
    return chosen, float(np.sqrt(apart.min(initial=np.inf)))


def _square(angles: Floats, place: Floats) -> Floats:
    out: Floats = ((angles - place) ** 2).sum(axis=1)
    return out
