"""Measured samples without what is faster than a cut-off: a low-pass without delay.

The usual one of biomechanics: a Butterworth filter of second order, run forwards and
backwards, hence of *effective order four* and of no phase. Run once, its gain at
frequency f is 1 / sqrt(1 + (w / wc)^4) with w = tan(pi f / rate) (bilinear transform);
run twice, the square of it. That has fallen to 1/sqrt 2 where (w / wc)^4 = sqrt 2 - 1,
so that the single pass is given the cut-off wc = w / (sqrt 2 - 1)^(1/4) = w / 0.802:
the *corrected* cut-off of Winter (2009, "Biomechanics and Motor Control of Human
Movement", 4th ed., section 2.3.4.4) and Robertson and Dowling (2003, "Design and
responses of Butterworth and critically damped digital filters", J Electromyogr Kinesiol
13). The gain at the cut-off that a user names is therefore 1/sqrt 2, as he expects.

Every run of measured samples is filtered by itself, never across a gap. It is extended
at both ends, turned about its end sample as `scipy.signal.filtfilt` does, by
`SETTLING_TIMES` of the filter's decay. scipy's own nine frames are too few for low
cut-offs: at 120 Hz the ends of a marker that moves at 1 m/s come out 2 mm off where the
cut-off is 6 Hz and 109 mm where it is 1 Hz; with five time constants 0.1 and 0.5 mm. A
run that is not longer than its extension is left as it is. As runs are turned about
their end samples, these move least: what is filled later meets them.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, expect_shape, runs

ORDER = 2
"""Of one pass; two passes have twice as much."""

PASSES_CORRECTION = (np.sqrt(2.0) - 1.0) ** 0.25
"""[-] cut-off of two passes as a share of that of one: 0.802."""

SETTLING_TIMES = 5.0
"""[-] time constants of the filter by which a run is extended: what the start of the
filter does has fallen to exp(-5), 0.7 % (chosen)."""

MIN_PADDING_FRAMES = 9
"""Extension of `scipy.signal.filtfilt` for this order: three times its coefficients."""


@dataclass(frozen=True, kw_only=True)
class Smoothed:
    """Trajectories without what is faster than a cut-off.

    Attributes
    ----------
    positions : (T, M, 3) [m] as they were but where ``done``.
    done : (T, M) samples that went through the filter.
    """

    positions: Floats
    done: Bools


def smooth(
    positions: Floats, seen: Bools, cutoff_hz: float, rate_hz: float
) -> Smoothed:
    """Smooth every run of measured samples of every marker.

    Parameters
    ----------
    positions : (T, M, 3) [m]
    seen : (T, M) which samples are measured.
    cutoff_hz : where the gain is 1/sqrt 2; below half of ``rate_hz``.
    """
    expect_shape("positions", positions, "T", "M", 3)
    expect_shape("seen", seen, *positions.shape[:2])
    padding = padding_frames(cutoff_hz, rate_hz)
    found, done = positions.copy(), np.zeros(seen.shape, dtype=bool)
    long = [
        (slice(start, stop), m)
        for m in range(seen.shape[1])
        for start, stop in runs(seen[:, m])
        if stop - start > padding
    ]
    if not long:
        return Smoothed(positions=found, done=done)
    from scipy.signal import butter, sosfiltfilt  # 0.3 s, which few takes need

    share = 2.0 / np.pi * np.arctan(_one_pass(cutoff_hz, rate_hz))  # of half the rate
    sections = butter(ORDER, share, output="sos")
    for rows, m in long:
        with np.errstate(over="ignore", invalid="ignore"):
            path = sosfiltfilt(
                sections, positions[rows, m], axis=0, padtype="odd", padlen=padding
            )
        if np.isfinite(path).all():  # not of places beyond all measure
            found[rows, m], done[rows, m] = path, True
    return Smoothed(positions=found, done=done)


def padding_frames(cutoff_hz: float, rate_hz: float) -> int:
    """Frames by which a run is extended at each end; it should have more.

    The poles of one pass decay with the time constant sqrt 2 / (2 pi fc), fc [Hz] being
    the corrected cut-off.
    """
    decay = np.sqrt(2.0) / (2.0 * _one_pass(cutoff_hz, rate_hz))  # [frames]
    return max(MIN_PADDING_FRAMES, int(np.ceil(SETTLING_TIMES * decay)))


def _one_pass(cutoff_hz: float, rate_hz: float) -> float:
    """[-] tan(pi fc / rate) of the corrected cut-off."""
    return float(np.tan(np.pi * cutoff_hz / rate_hz) / PASSES_CORRECTION)
