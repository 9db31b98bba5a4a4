"""Filled samples put into a take; measured ones come back bit for bit."""

from dataclasses import replace

import numpy as np

from handclean.arrays import Bools, Floats, Ints32
from handclean.recording import Origin, Points, Recording, Trajectories


def with_samples(
    recording: Recording, columns: dict[int, int], places: Floats, sigma: Floats
) -> Recording:
    """Return a take whose samples of some markers are filled where they were not known.

    What an earlier run filled and this one does not is missing again. A rejected sample
    in whose place one is filled goes to the unlabelled points.

    Parameters
    ----------
    columns : column of the take by column of ``places``.
    places : (T, M, 3) [m], NaN where nothing was filled.
    sigma : (T, M) [m] of the filled samples.
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
    replaced = filled & (origin == Origin.REJECTED) & _finite(markers)
    origin[filled] = Origin.FILLED
    return replace(
        recording,
        markers=replace(
            markers,
            positions=positions,
            origin=origin,
            sigma=spread,
            **_cleared(markers, filled),
        ),
        unlabelled=_kept(recording.unlabelled, markers, replaced),
    )


def _finite(markers: Trajectories) -> Bools:
    return np.asarray(np.isfinite(markers.positions).all(axis=2))


def _cleared(markers: Trajectories, filled: Bools) -> dict[str, object]:
    """What the source file said of samples no longer holds where they are filled."""
    cleared: dict[str, object] = {}
    for part, blank in (("source", -1), ("residual", 0.0), ("cameras", 0)):
        array = getattr(markers, part)
        if array is not None:
            array = array.copy()
            array[filled] = blank
            cleared[part] = array
    return cleared


def _kept(points: Points | None, markers: Trajectories, moved: Bools) -> Points | None:
    """Points with those added that gave up their place to a filled sample."""
    if not moved.any():
        return points
    frame, column = np.nonzero(moved)
    parts: dict[str, object] = {}
    for part, kind in (("residual", np.float32), ("cameras", np.uint8)):
        array = getattr(markers, part)
        old = None if points is None else getattr(points, part)
        if points is not None and old is None:
            continue  # the points there are have none
        if array is None:
            if points is None:
                continue
            array = np.zeros(moved.shape, dtype=kind)
        parts[part] = array[frame, column]
    source = markers.source
    added = Points(
        frame=frame.astype(np.int32),
        source=(
            np.full(len(frame), -1) if source is None else source[frame, column]
        ).astype(np.int32),
        positions=markers.positions[frame, column],
        **parts,
    )
    return added if points is None else _joined(points, added)


def _joined(points: Points, added: Points) -> Points:
    """Both, sorted by frame."""
    frames: Ints32 = np.concatenate([points.frame, added.frame])
    order = np.argsort(frames, kind="stable")

    def both(part: str):
        old, new = getattr(points, part), getattr(added, part)
        return None if old is None else np.concatenate([old, new])[order]

    return Points(
        frame=frames[order],
        source=both("source"),
        positions=both("positions"),
        residual=both("residual"),
        cameras=both("cameras"),
    )
