"""Readings without their noise: a low-pass filter that does not shift in time.

A sensor's noise changes from frame to frame, fingers do not. Every reading is replaced
by what a parabola through its neighbours, by least squares with Gaussian weights of
their distance in time, says there: a low-pass filter without delay, flat to the fourth
order, that bears uneven times, blank readings and ends (where a filter of fixed weights
would lag behind the motion). Streams go through in chunks with their neighbours on both
sides, so that how they are cut changes nothing.
"""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from handclean.arrays import Bools, Floats

_HALF_POWER = 1.4692
"""[-] omega s at which (1 + x) exp(-x), x = (omega s)^2 / 2, has fallen to 1/sqrt 2
(solved)."""

_REACH_SD = 4.5
"""[-] standard deviations s within which neighbours count (chosen)."""

_LEAST_DETERMINANT_SHARE = 1e-7
"""[-] share of its diagonal's product below which a determinant counts as zero
(chosen)."""


def width(cutoff_hz: float) -> float:
    """[s] standard deviation of the weights of a filter with this cutoff."""
    return _HALF_POWER / (2.0 * np.pi * cutoff_hz)


Judge = Callable[[Floats], Bools]
"""Of (T, S) readings, which are wrong."""


def smoothed(
    times: Floats, values: Floats, cutoff_hz: float, wrong: Judge | None = None
) -> Floats:
    """(T, S) readings without what is faster than the cutoff.

    Parameters
    ----------
    times : (T,) [s], rising; values : (T, S), nan where blank (and so it stays).
    cutoff_hz : where the gain is 1/sqrt 2; 0 leaves readings as they are.
    wrong : tells readings that say nothing of their neighbours; they stay as they are.
    """
    stream = smoothed_chunks([(times, values)], cutoff_hz, wrong)
    parts = [part for _, _, part in stream]
    return np.concatenate(parts) if parts else values.copy()


def smoothed_chunks(
    chunks: Iterable[tuple[Floats, Floats]],
    cutoff_hz: float,
    wrong: Judge | None = None,
) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Go through times, readings and smoothed readings of a stream.

    Parameters
    ----------
    chunks : (t,) [s] times and (t, S) readings, in order.
    cutoff_hz, wrong : see `smoothed`.

    Yields
    ------
    (t,) [s], (t, S) as they were, (t, S) smoothed. Chunks are cut where neighbours of
    their last frames are still to come; together they are what went in.
    """
    if cutoff_hz <= 0.0:
        for times, values in chunks:
            yield times, values, values
        return
    reach = _REACH_SD * width(cutoff_hz)
    before = 0  # leading frames that were given out, and are here as neighbours
    held: tuple[Floats, Floats] | None = None
    for times, values in chunks:
        if held is not None:
            times = np.concatenate([held[0], times])
            values = np.concatenate([held[1], values])
        ready = int(np.searchsorted(times, times[-1] - reach))
        if ready > before:
            done = _filtered(times, values, cutoff_hz, wrong)
            rows = slice(before, ready)
            yield times[rows], values[rows], done[rows]
            first = int(np.searchsorted(times, times[ready] - reach))
            times, values = times[first:], values[first:]
            before = ready - first
        held = times, values
    if held is not None and len(held[0]) > before:
        times, values = held
        done = _filtered(times, values, cutoff_hz, wrong)
        yield times[before:], values[before:], done[before:]


def _filtered(
    times: Floats, values: Floats, cutoff_hz: float, wrong: Judge | None
) -> Floats:
    """(T, S) parabolas' values at every frame."""
    size = width(cutoff_hz)
    there = np.isfinite(values)
    if wrong is not None:
        there &= ~wrong(values)
    plain = np.where(there, values, 0.0)
    moments = np.zeros((5, *values.shape))  # sums of w u^0 .. w u^4
    sums = np.zeros((3, *values.shape))  # sums of w y u^0 .. w y u^2
    _add(moments, sums, np.zeros(len(times)), there, plain, slice(None), slice(None))
    for lag in range(1, len(times)):
        apart = (times[lag:] - times[:-lag]) / size
        if apart.min() > _REACH_SD:
            break
        early, late = slice(None, -lag), slice(lag, None)
        _add(moments, sums, apart, there, plain, early, late)
        _add(moments, sums, -apart, there, plain, late, early)
    at_zero, safe = _parabola(moments, sums)
    return np.where(there & safe, at_zero, values)


def _add(
    moments: Floats,
    sums: Floats,
    apart: Floats,
    there: Bools,
    plain: Floats,
    here: slice,
    other: slice,
) -> None:
    """Let the frames ``other`` count as neighbours of the frames ``here``."""
    weight = np.where(np.abs(apart) <= _REACH_SD, np.exp(-0.5 * apart**2), 0.0)[:, None]
    for power in range(5):
        term = weight * apart[:, None] ** power
        moments[power, here] += term * there[other]
        if power < 3:
            sums[power, here] += term * plain[other]


def _parabola(m: Floats, y: Floats) -> tuple[Floats, Bools]:
    """Value at zero of the parabola with these sums, by Cramer; whether it has one."""
    a = m[2] * m[4] - m[3] ** 2
    b = m[1] * m[4] - m[2] * m[3]
    c = m[1] * m[3] - m[2] ** 2
    whole = m[0] * a - m[1] * b + m[2] * c
    safe = whole > _LEAST_DETERMINANT_SHARE * m[0] * m[2] * m[4]
    value = (y[0] * a - y[1] * b + y[2] * c) / np.where(safe, whole, 1.0)
    return value, safe
