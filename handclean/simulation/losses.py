"""Markers lost for no visible reason, and tracks that change their number.

Besides what stands in the way, real systems lose markers to merging images, rejected
rays and thresholds. These losses come as a Poisson process, their lengths are
log-normal with a heavy tail: half last under 0.05 s, 90 % under 0.3 s, 1 % over a
second. Pavllo et al. 2019 (figure 13) found 90 % of all occlusions under 0.36 s.
"""

from itertools import pairwise

import numpy as np

from handclean.arrays import Bools, Ints, runs

_MEDIAN_LOSS_S, _LOG_LOSS_SD = 0.05, 1.35
"""Lengths of losses: the median and the standard deviation of the logarithm (see
above)."""

_COMPLETE_START_S = 0.1
"""[s] at the start of a take in which every marker is there, as maycock2015 demands
(chosen)."""

_BREAKS_PER_S = 0.02
"""Of a marker's track, which goes on under another number (chosen)."""


def dropouts(
    seen: Bools, rate_hz: float, per_s: float, rng: np.random.Generator
) -> Bools:
    """(T, M) what is left of (T, M) sightings after random losses.

    Parameters
    ----------
    rate_hz : frames per second.
    per_s : losses per marker and second.
    """
    left = seen.copy()
    frames, markers = seen.shape
    for m in range(markers):
        for start in rng.uniform(0.0, frames, rng.poisson(per_s * frames / rate_hz)):
            lasts = rate_hz * _MEDIAN_LOSS_S * rng.lognormal(0.0, _LOG_LOSS_SD)
            left[int(start) : int(start + max(lasts, 1.0)), m] = False
    return left


def first_frames(rate_hz: float) -> int:
    """Frames at the start of a take that nothing disturbs."""
    return max(int(_COMPLETE_START_S * rate_hz), 1)


def tracks(seen: Bools, rate_hz: float, rng: np.random.Generator) -> Ints:
    """(N, 3) marker, first frame and frame after the last of each unbroken track."""
    rows = []
    for m in range(seen.shape[1]):
        for start, stop in runs(seen[:, m]):
            length = stop - start
            breaks = rng.poisson(_BREAKS_PER_S * length / rate_hz)
            cuts = np.sort(rng.integers(start, stop, breaks))
            ends = np.unique(np.concatenate([[start], cuts, [stop]]))
            rows += [(m, a, b) for a, b in pairwise(ends)]
    return np.array(rows, dtype=np.int64).reshape(-1, 3)
