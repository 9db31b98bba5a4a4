"""Two streams of one hand by two clocks: which offset brings them together.

Every rotation of the markers is compared with the reading of its sensor; both are put
on one grid, made zero-mean, and correlated over all offsets. A sensor may read
backwards and be stretched by others, so squares of correlations are added, and the
offset is where their sum peaks, between grid points by a parabola.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError

_LEAST_OVERLAP_S = 2.0
"""[s] the streams overlap by, at least (chosen)."""

_LEAST_CORRELATION = 0.5
"""[-] streams of one motion have a larger root mean square correlation (chosen)."""

_OTHER_PEAK_S = 0.5
"""[s] an offset farther than this from the best one is another peak (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Offset:
    """How two clocks differ.

    Attributes
    ----------
    seconds : what to add to the glove's times to have the markers'.
    correlation : root mean square correlation there, 0 to 1.
    next_best : the highest at an offset at least half a second away.
    """

    seconds: float
    correlation: float
    next_best: float


def find_offset(
    glove_times: Floats,
    readings: Floats,
    marker_times: Floats,
    rotations: Floats,
    most: float,
) -> Offset:
    """Find by how much two clocks differ.

    Parameters
    ----------
    glove_times, readings : (T,) [s], (T, C) readings of C sensors.
    marker_times, rotations : (T',) [s], (T', C) [rad] of the rotations they measure.
    most : [s] largest offset.

    Raises
    ------
    HandcleanError
        If the streams overlap too little, or do not seem to be of one motion.
    """
    step = min(
        float(np.median(np.diff(glove_times))), float(np.median(np.diff(marker_times)))
    )
    one = _even(glove_times, readings, step)
    other = _even(marker_times, rotations, step)
    start = marker_times[0] - glove_times[0]
    reach = int(np.ceil((most + abs(start)) / step))
    lags = np.arange(-reach, reach + 1)
    offsets = start + lags * step
    score = _scores(one, other, lags, int(_LEAST_OVERLAP_S / step))
    score[np.abs(offsets) > most + 0.5 * step] = np.nan
    if not np.isfinite(score).any():
        raise HandcleanError(
            f"streams: overlap less than {_LEAST_OVERLAP_S:g} s at offsets up to "
            f"{most:g} s"
        )
    best = int(np.nanargmax(score))
    correlation = float(np.sqrt(score[best]))
    if correlation < _LEAST_CORRELATION:
        raise HandcleanError(
            f"streams: correlate {correlation:.2f} at best, {offsets[best]:.2f} s "
            "apart; they do not seem to be of the same motion"
        )
    far = np.abs(lags - lags[best]) * step >= _OTHER_PEAK_S
    rest = score[far & np.isfinite(score)]
    return Offset(
        seconds=float(offsets[best] + step * _between(score, best)),
        correlation=correlation,
        next_best=float(np.sqrt(rest.max())) if len(rest) else 0.0,
    )


def _even(times: Floats, values: Floats, step: float) -> Floats:
    """(T, C) values on an even grid from the first time, gaps bridged."""
    grid = np.arange(times[0], times[-1] + 1e-9, step)
    out = np.zeros((len(grid), values.shape[1]))
    for c in range(values.shape[1]):
        good = np.isfinite(values[:, c])
        if good.sum() > 1:
            out[:, c] = np.interp(grid, times[good], values[good, c])
    return out


def _scores(one: Floats, other: Floats, lags: Ints, least: int) -> Floats:
    """(L,) mean squared correlation; sample t of one meets t - lag of the other."""
    out = np.full(len(lags), np.nan)
    for k, lag in enumerate(lags.tolist()):
        # grid time of one + offset = grid time of other: index shifts by -lag
        begin, end = max(0, -lag), min(len(one), len(other) - lag)
        if end - begin < max(least, 3):
            continue
        a = one[begin:end] - one[begin:end].mean(axis=0)
        b = other[begin + lag : end + lag]
        b = b - b.mean(axis=0)
        size = (a**2).sum(axis=0) * (b**2).sum(axis=0)
        moves = size > 1e-20
        if moves.any():
            dots = (a * b).sum(axis=0)[moves]
            out[k] = float((dots**2 / size[moves]).mean())
    return out


def _between(score: Floats, best: int) -> float:
    """Where between grid points a parabola through three scores peaks."""
    if (
        not 0 < best < len(score) - 1
        or not np.isfinite(score[best - 1 : best + 2]).all()
    ):
        return 0.0
    before, here, after = score[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    return float(0.5 * (before - after) / bend) if bend < 0.0 else 0.0


def at_times(times: Floats, values: Floats, wanted: Floats) -> Floats:
    """(N, C) values between frames, NaN outside, at gaps and beside them.

    Parameters
    ----------
    times : (T,) [s]; values : (T, C), NaN where missing; wanted : (N,) [s].
    """
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    share = (wanted - times[after - 1]) / (times[after] - times[after - 1])
    out = values[after - 1] + share[:, None] * (values[after] - values[after - 1])
    outside = (wanted < times[0]) | (wanted > times[-1])
    out[outside] = np.nan
    mixed: Floats = out
    return mixed
