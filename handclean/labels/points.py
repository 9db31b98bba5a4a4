"""The measured points of a take as one flat list, whatever their names were.

Within a frame the points are put in the order of their coordinates. Everything later
sees only that order, so that labels cannot depend on the order in which a file happens
to list them.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bytes, Floats, Floats32, Ints, Ints32
from handclean.kernels import jit
from handclean.recording import Origin, Points, Recording, frame_slices

_MEASURED = (Origin.MEASURED, Origin.REJECTED, Origin.SMOOTHED)


@dataclass(frozen=True, kw_only=True)
class Cloud:
    """P measured points of T frames.

    Attributes
    ----------
    start : (T + 1,) where each frame's points begin.
    at : (P, 3) [m]
    frame : (P,) int32; column : (P,) int32, raw column of the source, -1 none.
    residual, cameras : (P,) as the source had them, or None.
    """

    start: Ints
    at: Floats
    frame: Ints32
    column: Ints32
    residual: Floats32 | None
    cameras: Bytes | None

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self.start) - 1

    def points(self, rows: Ints) -> Points:
        """Return some of the points (rising rows) as a recording has them."""
        return Points(
            frame=self.frame[rows],
            source=self.column[rows],
            positions=self.at[rows],
            residual=None if self.residual is None else self.residual[rows],
            cameras=None if self.cameras is None else self.cameras[rows],
        )


@jit
def sort_frames(start: Ints, at: Floats, order: Ints) -> None:
    """Sort the rows of each frame by x, then y, then z, in place in ``order``."""
    for t in range(start.shape[0] - 1):
        for i in range(start[t] + 1, start[t + 1]):
            row = order[i]
            x, y, z = at[row, 0], at[row, 1], at[row, 2]
            j = i - 1
            while j >= start[t]:
                other = order[j]
                u, v, w = at[other, 0], at[other, 1], at[other, 2]
                if u < x or (u == x and (v < y or (v == y and w <= z))):
                    break
                order[j + 1] = other
                j -= 1
            order[j + 1] = row


def cloud_of(recording: Recording) -> Cloud:
    """Collect what was measured: unlabelled points, and markers that are not filled.

    What was smoothed is there as it was measured.

    Returns
    -------
    the P points, frame by frame; those of a frame sorted by x, then y, then z
    """
    parts = [part for part in (_markers(recording), recording.unlabelled) if part]
    frame = np.concatenate([_NONE, *(part.frame for part in parts)]).astype(np.int32)
    at = np.concatenate([np.zeros((0, 3)), *(part.positions for part in parts)])
    order = np.argsort(frame, kind="stable")
    frame = frame[order]
    start = frame_slices(frame, recording.frames)
    sort_frames(start, at, order)
    column = np.concatenate([_NONE, *(part.source for part in parts)]).astype(np.int32)
    residual = cameras = None
    if any(part.residual is not None for part in parts):
        each = [np.zeros(0), *(_or_zeros(part.residual, part) for part in parts)]
        residual = np.concatenate(each).astype(np.float32)[order]
    if any(part.cameras is not None for part in parts):
        each = [np.zeros(0), *(_or_zeros(part.cameras, part) for part in parts)]
        cameras = np.concatenate(each).astype(np.uint8)[order]
    return Cloud(
        start=start,
        at=np.ascontiguousarray(at[order]),
        frame=frame,
        column=column[order],
        residual=residual,
        cameras=cameras,
    )


_NONE = np.zeros(0, dtype=np.int32)


def _markers(recording: Recording) -> Points | None:
    """Return the measured samples of the named markers as points without names."""
    markers = recording.markers
    if markers is None:
        return None
    seen = np.isin(markers.origin, _MEASURED)
    seen &= np.isfinite(markers.positions).all(axis=2)
    frame, column = (index.astype(np.int32) for index in np.nonzero(seen))
    return Points(
        frame=frame,
        source=column if markers.source is None else markers.source[seen],
        positions=markers.as_measured[seen],
        residual=None if markers.residual is None else markers.residual[seen],
        cameras=None if markers.cameras is None else markers.cameras[seen],
    )


def _or_zeros(values: Floats32 | Bytes | None, part: Points) -> Floats:
    """Return what a source says of its points; zeros stand for nothing."""
    if values is None:
        return np.zeros(len(part.frame))
    return values.astype(np.float64)
