"""One gap of one marker filled by a Gaussian process over frames."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.gaps.regression.covariance import (
    CLOCK_HZ,
    FAST_SLOPE,
    MIDDLE_SLOPE,
    Rows,
    Scale,
    covariance,
    own_variance,
)
from handclean.gaps.regression.features import Window, gaussian
from handclean.kernels.body_frames import weighted_means

MIDDLE = 4.0
"""[1/120 s] features slower than a Gaussian mean of this deviation are slow."""

NEAR, ALIKE, SPREAD = 40, 150, 150
"""Frames learnt from: [1/120 s] all so near to an end; how many alike in posture to
the gap; how many spread evenly."""

RESIDUALS = (1.0, 0.3, 0.05)
"""Factors of the residuals' variance to choose from, by their likelihood."""

JUDGED = 120
"""Frames that the likelihood is taken of (chosen)."""

AT_ONCE = 300
"""Frames of a gap guessed at once, so that memory does not grow with its square."""

EXTRA_NOISE_M2 = 3e-9
"""[m^2] added to twice the measured noise."""


class Guess(NamedTuple):
    """Places (N, 3) [m] in the body's frame, (N,) [m] standard deviation per axis."""

    places: Floats
    deviation: Floats


@dataclass(frozen=True, kw_only=True)
class Scales:
    """What all gaps of a window share.

    posture : (W, P) features by weight, of total variance 1; variance : [m^2] of the
    features per marker.
    """

    posture: Floats
    variance: float


def scales_of(window: Window, residual: float = 1.0) -> Scales:
    """Scale the postures of a window.

    Parameters
    ----------
    residual : one of `RESIDUALS`.
    """
    spread = window.features[window.known].var(axis=0)
    weighed = window.features * np.sqrt(window.weight)
    total = float(np.sum(spread * window.weight))
    return Scales(
        posture=weighed / np.sqrt(max(total, 1e-18)),
        variance=residual * float(3.0 * np.sum(spread) / len(spread)),
    )


def likeliest_residual(window: Window, rate: float) -> float:
    """Return the factor of the residuals that makes what is known most likely.

    The likelihood of a Gaussian process (Rasmussen and Williams 2006, equation 5.8)
    whose overall scale is the likeliest, too.
    """
    known = np.flatnonzero(window.known)
    learn = known[np.linspace(0, len(known) - 1, min(JUDGED, len(known))).astype(int)]
    clock, noise = CLOCK_HZ / rate, 2.0 * window.noise + EXTRA_NOISE_M2
    off = window.target[learn] - window.target[learn].mean(axis=0)
    least = []
    for residual in RESIDUALS:
        scales = scales_of(window, residual)
        rows = rows_at(window, scales, learn, clock)
        scale = Scale(rows.slow.mean(axis=0), scales.variance, clock)
        square = covariance(rows, rows, scale, lower=True)
        square[np.diag_indices(len(learn))] += noise
        told = half_solved(square, off.T, noise)
        root = np.linalg.cholesky(square).diagonal()
        least.append(0.5 * np.log(np.mean(told**2)) + np.mean(np.log(root)))
    return RESIDUALS[int(np.argmin(least))]


def guess(
    window: Window, scales: Scales, gap: slice, known: Bools, rate: float
) -> Guess:
    """Guess where the hidden marker is in a gap.

    Parameters
    ----------
    gap : rows of the window.
    known : (W,) rows to learn from; none in the gap.
    rate : [Hz]
    """
    clock = CLOCK_HZ / rate
    learn = choose(scales.posture, gap, known, clock)
    inside = np.arange(gap.start, gap.stop)
    here, there = (rows_at(window, scales, at, clock) for at in (learn, inside))
    scale = Scale(there.slow.mean(axis=0), scales.variance, clock)
    square = covariance(here, here, scale, lower=True)
    noise = 2.0 * window.noise + EXTRA_NOISE_M2
    square[np.diag_indices(len(learn))] += noise
    mean = window.target[learn].mean(axis=0)
    off = (window.target[learn] - mean).T
    places, left = np.empty((len(inside), 3)), own_variance(there, scale)
    for first in range(0, len(inside), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        cross = covariance(_part_of(there, part), here, scale)
        solved = half_solved(square, np.vstack([off, cross]), noise)
        told, half = solved[:3].T, solved[3:]
        places[part] = mean + half @ told
        left[part] -= np.sum(half**2, axis=1)
    usual = np.sum(told**2) / told.size
    deviation = np.sqrt((np.maximum(left, 0.0) + noise) * usual)
    return Guess(places=places, deviation=deviation)


def half_solved(square: Floats, rows: Floats, least: float) -> Floats:
    """(M, N) rows times the inverse of the transposed Cholesky factor of a square.

    The factor of a larger matrix, with the rows below the square and enough on the
    diagonal beside them, has them in the rows' place. (numpy has no triangular solver;
    loading scipy's takes longer than the gaps of a short take do.)

    Parameters
    ----------
    square : (N, N) positive definite; its lower triangle is read.
    rows : (M, N)
    least : no eigenvalue of the square is less.
    """
    size, more = len(square), len(rows)
    whole = np.zeros((size + more, size + more))
    whole[:size, :size] = square
    whole[size:, :size] = rows
    whole[size:, size:] = np.eye(more) * (1.0 + np.sum(rows**2) / least)
    return np.asarray(np.linalg.cholesky(whole)[size:, :size])


def rows_at(window: Window, scales: Scales, at: Ints, clock: float) -> Rows:
    """Return rows (N,) of a window as the covariance sees them."""
    root = np.sqrt(window.weight)
    slow, slower = (np.empty((len(at), len(root))) for _ in range(2))
    weighted_means(window.features, at, gaussian(window.smoothing / clock), slow)
    weighted_means(window.features, at, gaussian(MIDDLE / clock), slower)
    middle, fast = slow - slower, window.features[at] - slow
    quick = np.hstack([np.sqrt(MIDDLE_SLOPE) * middle, np.sqrt(FAST_SLOPE) * fast])
    return Rows(
        posture=scales.posture[at],
        slow=slow * root,
        quick=quick * np.hstack([root, root]),
        frame=at,
    )


def _part_of(rows: Rows, part: slice) -> Rows:
    return Rows(
        posture=rows.posture[part],
        slow=rows.slow[part],
        quick=rows.quick[part],
        frame=rows.frame[part],
    )


def choose(posture: Floats, gap: slice, known: Bools, clock: float) -> Ints:
    """(N,) rows to learn from: near the gap, alike in posture, spread evenly.

    Parameters
    ----------
    posture : (W, P); known : (W,); clock : [1/120 s] a frame.
    """
    near = np.zeros(len(known), dtype=bool)
    reach = round(NEAR / clock)
    near[max(gap.start - reach, 0) : gap.start] = True
    near[gap.stop : gap.stop + reach] = True
    far = np.flatnonzero(known & ~near)
    near_rows = np.flatnonzero(known & near)
    if len(far) > ALIKE + SPREAD:
        middle = (gap.start + gap.stop) // 2
        ends = max(gap.start - 1, 0), middle, min(gap.stop, len(posture) - 1)
        away = np.min(
            [np.sum((posture[far] - posture[t]) ** 2, axis=1) for t in ends], axis=0
        )
        time = np.minimum(abs(far - gap.start), abs(far - gap.stop)) * clock / 600.0
        order = np.argsort(away + 0.3 * np.median(away) * time, kind="stable")
        alike = np.sort(far[order[: 2 * ALIKE]])[::2]
        rest = np.setdiff1d(far, alike)
        rest = rest[np.linspace(0, len(rest) - 1, SPREAD).astype(np.int64)]
        far = np.concatenate([alike, rest])
    return np.sort(np.concatenate([near_rows, far]))
