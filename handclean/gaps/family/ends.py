"""Both ends of a gap: leading a path onto them, and how doubt grows away from them."""

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.gaps.runs import AT_END, AT_START, THROUGHOUT, Gap
from handclean.gaps.tracks import Refused, Tracks

LEAST_SPREAD_M = 1e-5
"""[m] no filled sample is surer than this (chosen; the noise of a good system)."""

RECENT_S = 1.0 / 3.0
"""[s] how far back the recent movement of a marker reaches: Pavllo 2019 section 3.2.1,
20 frames at 60 Hz."""


def expect_both_ends(tracks: Tracks, gap: Gap) -> None:
    """Refuse a gap that is open at an end, for fillers that need both."""
    expect_start(tracks, gap)
    if not tracks.has_end(gap):
        raise Refused(f"it {AT_END}")


def expect_start(tracks: Tracks, gap: Gap) -> None:
    """Refuse a gap with nothing before it."""
    if not tracks.has_start(gap):
        raise Refused(THROUGHOUT if not tracks.has_end(gap) else f"it {AT_START}")


def expect_an_end(tracks: Tracks, gap: Gap) -> None:
    """Refuse a gap with nothing on either side of it."""
    if not (tracks.has_start(gap) or tracks.has_end(gap)):
        raise Refused(THROUGHOUT)


def frames_of(tracks: Tracks, gap: Gap) -> Ints:
    """(N,) frames of a gap and of the ends it has."""
    first = gap.start - tracks.has_start(gap)
    return np.arange(first, gap.stop + tracks.has_end(gap))


def onto_ends(tracks: Tracks, gap: Gap, path: Floats) -> Floats:
    """(N, 3) [m] a path, led onto the measured samples beside a gap.

    Its error at both ends is carried linearly through the gap, or as it is where one
    end is missing.

    Parameters
    ----------
    path : [m] of the frames of `frames_of`.
    """
    frames = frames_of(tracks, gap)
    off = tracks.positions[frames[[0, -1]], gap.column] - path[[0, -1]]
    inside = (frames >= gap.start) & (frames < gap.stop)
    if tracks.has_start(gap) and tracks.has_end(gap):
        share = shares(gap)
        carried = (1.0 - share) * off[0] + share * off[1]
    else:
        expect_an_end(tracks, gap)
        carried = off[0] if tracks.has_start(gap) else off[1]
    return np.asarray(path[inside] + carried)


def shares(gap: Gap) -> Floats:
    """(N, 1) 0 at the last frame before a gap, 1 at the first after it."""
    return np.asarray(np.arange(1, gap.frames + 1)[:, None] / (gap.frames + 1.0))


def away(tracks: Tracks, gap: Gap) -> Floats:
    """(N,) [s] how far the frames of a gap are from what is measured beside it.

    With a and b the times to its ends this is a b / (a + b), to which the variance of a
    Brownian bridge is in proportion; with one end, the time to that.
    """
    before = np.arange(1, gap.frames + 1) / tracks.rate
    after = before[::-1]
    if not tracks.has_end(gap):
        return before
    if not tracks.has_start(gap):
        return after
    return np.asarray(before * after / (before + after))


def away_since(tracks: Tracks, gap: Gap) -> Floats:
    """(N,) [s] how long ago the marker was seen, in the frames of a gap."""
    return np.asarray(np.arange(1, gap.frames + 1) / tracks.rate)


def speed_before(tracks: Tracks, gap: Gap) -> float:
    """[m/s] root mean square velocity per axis in the last third of a second before."""
    return root_mean_square(steps_before(tracks, gap)) * tracks.rate


def speed_beside(tracks: Tracks, gap: Gap) -> float:
    """[m/s] root mean square velocity per axis, a third of a second on both sides."""
    after = slice(gap.stop, gap.stop + _recent_frames(tracks) + 1)
    steps = [steps_before(tracks, gap), _steps(tracks, gap, after)]
    return root_mean_square(np.concatenate(steps)) * tracks.rate


def steps_before(tracks: Tracks, gap: Gap) -> Floats:
    """(K, 3) [m] steps from frame to frame in the last third of a second before."""
    first = max(gap.start - 1 - _recent_frames(tracks), 0)
    return _steps(tracks, gap, slice(first, gap.start))


def root_mean_square(values: Floats) -> float:
    """Root mean square of all numbers; 0 of none."""
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _recent_frames(tracks: Tracks) -> int:
    return max(round(RECENT_S * tracks.rate), 1)


def _steps(tracks: Tracks, gap: Gap, rows: slice) -> Floats:
    steps = np.diff(tracks.positions[rows, gap.column], axis=0)
    return np.asarray(steps[np.isfinite(steps).all(axis=1)])


def with_floor(spread: Floats) -> Floats:
    """(N,) [m] a spread that is nowhere less than any measured sample's."""
    return np.asarray(np.hypot(LEAST_SPREAD_M, spread))
