"""What the other markers show in each frame, seen from the body they move with.

Markers near-rigid with the hidden one count most ::

    w_i = 1 / (d_i^2 + (0.3 median d + 0.05 mm)^2)

with d_i the standard deviation of the distance between marker i and the hidden one over
the frames in which both are known, scaled to at most 1 and at least 0.001. Each frame
is laid onto one posture by all features, weight w^2 (Procrustes); the features are the
markers' places then, less their means.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints, runs
from handclean.gaps.body import Motion, motion_onto
from handclean.gaps.noise import noise_of
from handclean.gaps.regression.covariance import CLOCK_HZ
from handclean.gaps.tracks import Tracks
from handclean.kernels.body_frames import smooth_present

SMOOTHINGS = (1.0, 0.0)
"""[1/120 s] standard deviation of the mean in time that takes the noise of features
down before they are laid onto one posture; that is taken which leaves the hidden marker
less noise. A mean helps where markers are noisy one by one (1 mm: ratio to the ridge
0.73 instead of 0.79), none where all of them shake together, as points of a solved body
do (0.75 instead of 1.51)."""

ROWS_OF_DISTANCE, ROWS_OF_IMPUTING = 2000, 300
"""Rows that distances between markers, and rules of imputing, are taken from, about
(chosen)."""

SHRINK = 0.002
"""Of a feature's variance, added when markers missing for a while are imputed."""


@dataclass(frozen=True, kw_only=True)
class Window:
    """Part of a take about one hidden marker, W frames, seen from the body.

    Attributes
    ----------
    first : row of the take that its first row is.
    features : (W, P) [m] places of the other markers less their means.
    weight : (P,) how near-rigid with the hidden marker each is, at most 1.
    target : (W, 3) [m] the hidden marker, NaN where not measured.
    known : (W,) rows that can be learnt from.
    motion : from the laboratory to the body.
    noise : [m^2] variance of the hidden marker's noise per axis; 0 where it is not
        known.
    smoothing : [1/120 s] one of `SMOOTHINGS`.
    """

    first: int
    features: Floats
    weight: Floats
    target: Floats
    known: Bools
    motion: Motion
    noise: float
    smoothing: float


def gaussian(deviation: float) -> Floats:
    """(2 R + 1,) weights of a Gaussian mean, cut at four standard deviations."""
    if deviation == 0.0:
        return np.ones(1)
    reach = int(4.0 * deviation + 0.5)
    weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
    return np.asarray(weight / weight.sum())


def rigidity(positions: Floats, column: int, others: Ints) -> Floats:
    """(V,) w of the module's formula, for other markers of (T, M, 3) positions."""
    away = np.linalg.norm(
        positions[:, others] - positions[:, [column]], axis=2
    )  # NaN where either is missing
    with np.errstate(invalid="ignore"):
        spread = np.sqrt(_variance(away))
    known = np.isfinite(spread)
    if not known.any():
        return np.ones(len(others))
    usual = np.median(spread[known])
    spread = np.where(known, spread, spread[known].max())
    weight = 1.0 / (spread**2 + (0.3 * usual + 5e-5) ** 2)
    weight = weight / weight.max() + 1e-3
    return np.asarray(weight / weight.max())


def _variance(values: Floats) -> Floats:
    """(V,) variance of each column of (T, V) over the rows that are not NaN."""
    there = np.isfinite(values)
    count = there.sum(axis=0)
    known = np.where(there, values, 0.0)
    mean = known.sum(axis=0) / np.maximum(count, 1)
    square = np.where(there, (values - mean) ** 2, 0.0).sum(axis=0)
    return np.asarray(np.where(count > 1, square / np.maximum(count, 1), np.nan))


@dataclass(frozen=True, kw_only=True)
class Seen:
    """A hidden marker and what tells of it, in part of a take.

    Attributes
    ----------
    column : the hidden marker.
    features : (V,) the markers that tell of it.
    always : (A,) those of them that are seen in every row that counts; the others are
        imputed from these where they are missing.
    weight : (V,) how near-rigid with the hidden marker each is, see `rigidity`.
    rows : of the take.
    """

    column: int
    features: Ints
    always: Ints
    weight: Floats
    rows: slice


def look(tracks: Tracks, seen: Seen, smoothing: float | None = None) -> Window:
    """Look at part of a take from the body that a marker moves with.

    Parameters
    ----------
    smoothing : one of `SMOOTHINGS`; by default the one that leaves least noise.
    """
    if smoothing is None:
        found = [look(tracks, seen, one) for one in SMOOTHINGS]
        return min(found, key=lambda window: window.noise)
    positions = tracks.positions[seen.rows]
    points = np.ascontiguousarray(positions[:, seen.features])
    index = np.flatnonzero(np.isin(seen.features, seen.always))
    there = tracks.seen[seen.rows]
    whole = np.asarray(there[:, seen.always].all(axis=1))
    smooth = points
    if smoothing > 0.0:
        smooth = np.empty(points.shape)
        taps = gaussian(smoothing * tracks.rate / CLOCK_HZ)
        smooth_present(points, taps, smooth)
    motion = _body(smooth, seen.weight, whole)
    body = motion.to_body(smooth)
    target = motion.to_body(positions[:, [seen.column]])[:, 0]
    known = there[:, seen.column] & whole
    values = without_holes(impute(body, index, whole).reshape(len(body), -1))
    return Window(
        first=seen.rows.start,
        features=values - values[known].mean(axis=0),
        weight=np.repeat(seen.weight, 3),
        target=target,
        known=known,
        motion=motion,
        noise=float(np.nan_to_num(noise_of(np.where(known[:, None], target, np.nan))))
        ** 2,
        smoothing=smoothing,
    )


def _body(points: Floats, weight: Floats, whole: Bools) -> Motion:
    """Find the motions that lay each frame onto one with most features.

    Parameters
    ----------
    points : (W, V, 3); weight : (V,); whole : (W,) rows that show what is always seen.
    """
    there = np.isfinite(points[:, :, 0])
    reference = points[np.argmax(whole & there.all(axis=1))]
    known = np.isfinite(reference).all(axis=1)
    if not known.all():
        reference = points[np.argmax(whole)]
        known = np.isfinite(reference).all(axis=1)
    rest = np.where(known[:, None], reference, 0.0)
    return motion_onto(points, rest, np.where(known, weight**2, 0.0))


def without_holes(values: Floats) -> Floats:
    """(W, P) columns with straight lines through what is missing, for means in time."""
    out = values.copy()
    rows = np.arange(len(values))
    for column in np.flatnonzero(np.isnan(values).any(axis=0)):
        there = np.isfinite(values[:, column])
        out[:, column] = np.interp(rows, rows[there], values[there, column])
    return out


def impute(body: Floats, always: Ints, whole: Bools) -> Floats:
    """(W, V, 3) [m] places with those that are missing guessed from the others.

    A ridge regression on the markers ``always`` (A,) that are there; its error at the
    ends of what is missing is carried through linearly.

    Parameters
    ----------
    whole : (W,) rows in which all of ``always`` are there.
    """
    out = body.copy()
    predictors = body[:, always].reshape(len(body), -1)
    for m in range(body.shape[1]):
        there = np.isfinite(body[:, m, 0])
        wanted = whole & ~there
        if not wanted.any():
            continue
        learn = np.flatnonzero(whole & there)
        learn = learn[:: max(1, len(learn) // ROWS_OF_IMPUTING)]
        x, y = predictors[learn], body[learn, m]
        centre, mean = x.mean(axis=0), y.mean(axis=0)
        x = x - centre
        square = x.T @ x
        square[np.diag_indices(len(square))] += (
            SHRINK * np.trace(square) / len(square) + 1e-18
        )
        slopes = np.linalg.solve(square, x.T @ (y - mean))
        guess = (predictors - centre) @ slopes + mean
        off = body[:, m] - guess
        for start, stop in runs(wanted):
            ends = [t for t in (start - 1, stop) if 0 <= t < len(body) and there[t]]
            rows = np.arange(start, stop)
            carried = (
                np.stack([np.interp(rows, ends, off[ends, i]) for i in range(3)], 1)
                if ends
                else 0.0
            )
            out[rows, m] = guess[rows] + carried
    return out
