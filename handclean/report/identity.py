"""Which reference marker each labelled sample of another take really is.

Two takes of one recording hold the same points under names of their own. Where both say
which raw column a sample came from, and those columns mean the same (samples of one
frame and column lie at one place), the column tells. Otherwise the place does: the
nearest reference sample of the frame, if it is nearer than a tolerance.
"""

import numpy as np

from handclean.arrays import Bools, Floats, Ints, Ints32
from handclean.recording import Trajectories

NOBODY = -1
"""A sample that is none of the reference's: a ghost, or a point nobody named there."""

CHUNK_FRAMES = 2000
"""Frames whose distances are held at once (chosen; memory)."""

LEAST_AGREEING_SHARE = 0.99
"""[-] share of samples of one frame and column that lie at one place (chosen)."""


def who_is_who(
    reference: Trajectories, test: Trajectories, tolerance_m: float
) -> tuple[Ints, str]:
    """(T, M) column of the reference that each measured sample of a test is.

    Returns
    -------
    The columns, `NOBODY` for a sample that is no marker of the reference or is not
    measured; and what told: "source" or "position".
    """
    seen_there, seen = reference.measured, test.measured
    if reference.source is not None and test.source is not None:
        there = np.where(seen_there, reference.source, NOBODY)
        here = np.where(seen, test.source, NOBODY)
        found = _by_source(there, here)
        if _agree(reference.positions, test.positions, found, tolerance_m):
            unsaid = seen & (test.source < 0)
            if not unsaid.any() and not (seen_there & (reference.source < 0)).any():
                return found, "source"
    places_there = np.where(seen_there[:, :, None], reference.positions, np.nan)
    places = np.where(seen[:, :, None], test.positions, np.nan)
    return _by_place(places_there, places, tolerance_m), "position"


def _by_source(there: Ints32, here: Ints32) -> Ints:
    """(T, M) where in each frame of ``there`` the columns of ``here`` stand."""
    found = np.full(here.shape, NOBODY, dtype=np.int64)
    for column in range(there.shape[1]):
        same = (here == there[:, [column]]) & (here >= 0)
        found[same] = column
    return found


def _agree(there: Floats, here: Floats, found: Ints, tolerance_m: float) -> bool:
    """Whether samples of one source lie at one place."""
    frame, column = np.nonzero(found != NOBODY)
    if len(frame) == 0:
        return False
    away = there[frame, found[frame, column]] - here[frame, column]
    near = np.linalg.norm(away, axis=1) <= tolerance_m
    return bool(np.mean(near) >= LEAST_AGREEING_SHARE)


def _by_place(there: Floats, here: Floats, tolerance_m: float) -> Ints:
    """(T, M) nearest of ``there`` within the tolerance, each at most once a frame."""
    found = np.full(here.shape[:2], NOBODY, dtype=np.int64)
    if there.shape[1] == 0:
        return found
    for start in range(0, len(here), CHUNK_FRAMES):
        rows = slice(start, start + CHUNK_FRAMES)
        away = there[rows, None, :, :] - here[rows, :, None, :]
        distance = np.nan_to_num(np.sum(away * away, axis=3), nan=np.inf)
        nearest = np.argmin(distance, axis=2)
        least = np.min(distance, axis=2)
        found[rows] = np.where(_first(nearest, least, tolerance_m**2), nearest, NOBODY)
    return found


def _first(nearest: Ints, least: Floats, limit: float) -> Bools:
    """(T, M) whether a sample is near enough, and the nearest of those to its point."""
    near = least <= limit
    order = np.argsort(np.where(near, least, np.inf), axis=1, kind="stable")
    taken = np.zeros((len(nearest), nearest.max(initial=0) + 1), dtype=bool)
    rows = np.arange(len(nearest))
    for rank in range(order.shape[1]):
        column = order[:, rank]
        point = nearest[rows, column]
        near[rows, column] &= ~taken[rows, point]
        taken[rows, point] |= near[rows, column]
    return near
