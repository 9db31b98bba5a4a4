"""Filled samples put into a take; measured ones come back bit for bit."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.gaps.runs import seen_in
from handclean.recording import Origin, Points, Recording, Trajectories

_BLANK = {"source": -1, "residual": 0.0, "cameras": 0}
"""What a filled sample has of what a source file says of measured ones."""


def with_samples(
    recording: Recording,
    columns: Mapping[int, int],
    places: Floats,
    sigma: Floats,
    q95: Floats | None = None,
) -> Recording:
    """Return a take whose samples of some markers are filled where they were missing.

    What an earlier run filled and this one does not is missing again. A rejected sample
    in whose place one is filled goes to the unlabelled points.

    Parameters
    ----------
    columns : the take's column of each column of ``places``.
    places : (T, M, 3) [m], NaN where nothing was filled.
    sigma : (T, M) [m] of the filled samples per axis, NaN where it is not known.
    q95 : (K, 2) length of gaps [s] and how many sigmas hold 95 % of the errors.
    """
    markers = recording.markers
    assert markers is not None
    origin, positions = markers.origin.copy(), markers.positions.copy()
    spread = np.full(origin.shape, np.nan, dtype=np.float32)
    if markers.sigma is not None:
        spread[:] = markers.sigma
    filled, measured = np.zeros(origin.shape, dtype=bool), markers.measured
    for theirs, ours in columns.items():
        again = origin[:, ours] == Origin.FILLED
        positions[again, ours], origin[again, ours] = np.nan, Origin.MISSING
        spread[again, ours] = np.nan
        new = np.isfinite(places[:, theirs, 0]) & ~measured[:, ours]
        filled[new, ours] = True
        positions[new, ours] = places[new, theirs]
        spread[new, ours] = sigma[new, theirs]
    moved = filled & (origin == Origin.REJECTED) & seen_in(markers.positions)
    origin[filled] = Origin.FILLED
    parts: dict[str, Any] = {
        "positions": positions,
        "origin": origin,
        "sigma": spread,
        "q95": q95,
    }
    for part, blank in _BLANK.items():
        if (array := getattr(markers, part)) is not None:
            parts[part] = np.where(filled, np.array(blank, array.dtype), array)
    return replace(
        recording,
        markers=replace(markers, **parts),
        unlabelled=_joined(recording.unlabelled, markers, moved),
    )


def _joined(
    points: Points | None, markers: Trajectories, moved: Bools
) -> Points | None:
    """Points and, in order of frames, those that gave up their place as a sample."""
    frame, column = np.nonzero(moved)
    if len(frame) == 0:
        return points
    empty = np.zeros(0, dtype=np.int32)
    old = points or Points(frame=empty, source=empty, positions=np.zeros((0, 3)))
    order = np.argsort(np.concatenate([old.frame, frame]), kind="stable")

    def both(part: str, blank: float, kind: type) -> Any:
        new, was = getattr(markers, part), getattr(old, part)
        if was is None and (points is not None or new is None):
            return None  # what some points lack, none has
        was = np.zeros(len(old.frame), dtype=kind) if was is None else was
        given = np.full(len(frame), blank) if new is None else new[frame, column]
        return np.concatenate([was, given])[order].astype(kind)

    places = np.concatenate([old.positions, markers.positions[frame, column]])
    return Points(
        frame=np.concatenate([old.frame, frame])[order].astype(np.int32),
        source=both("source", -1, np.int32),
        positions=places[order],
        residual=both("residual", 0.0, np.float32),
        cameras=both("cameras", 0, np.uint8),
    )
