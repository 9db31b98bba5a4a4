"""Figures of fillers at the same gaps, with intervals.

Errors of two fillers at the same N gaps give two ratios: the geometric mean of the
gaps' own ratios, in which every gap counts alike, and the ratio of their mean errors,
in which bad gaps count most. Intervals are of the bootstrap over gaps: N gaps are drawn
with replacement again and again, and 95 % of the ratios lie between the bounds (Efron
and Tibshirani, An Introduction to the Bootstrap, 1993, section 13.3).
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats

DRAWS = 1000
"""Of the bootstrap (chosen; the bounds then move by 1 % of their distance)."""

CLEARLY_WORSE = 1.25
"""Times the yardstick's error from which a gap counts as clearly worse (chosen)."""

LEAST_M = 1e-7
"""[m] errors count as this much at least, so that ratios are numbers (chosen)."""


class Interval(NamedTuple):
    """A figure and the bounds of its 95 % interval."""

    value: float
    low: float
    high: float


class Against(NamedTuple):
    """A filler against the yardstick, at the gaps that both fill.

    geometric, of_means : ratios; worse : share of gaps whose error is more than
    `CLEARLY_WORSE` times the yardstick's; gaps : how many both fill.
    """

    geometric: Interval
    of_means: Interval
    worse: float
    gaps: int


_NONE = Interval(float("nan"), float("nan"), float("nan"))


def against(errors: Floats, yardstick: Floats, rng: np.random.Generator) -> Against:
    """Compare a filler with the yardstick.

    Parameters
    ----------
    errors, yardstick : (N,) [m] at the same gaps; NaN where refused.
    rng : of the bootstrap.
    """
    both = np.isfinite(errors) & np.isfinite(yardstick)
    mine, theirs = (np.maximum(e[both], LEAST_M) for e in (errors, yardstick))
    count = len(mine)
    if count == 0:
        return Against(_NONE, _NONE, float("nan"), 0)
    logs = np.log(mine / theirs)
    drawn = rng.integers(count, size=(DRAWS, count))
    geometric = np.exp(logs[drawn].mean(axis=1))
    of_means = mine[drawn].sum(axis=1) / theirs[drawn].sum(axis=1)
    return Against(
        geometric=_interval(float(np.exp(logs.mean())), geometric),
        of_means=_interval(float(mine.sum() / theirs.sum()), of_means),
        worse=float(np.mean(mine > CLEARLY_WORSE * theirs)),
        gaps=count,
    )


def _interval(value: float, drawn: Floats) -> Interval:
    low, high = np.percentile(drawn, [2.5, 97.5])
    return Interval(value, float(low), float(high))


def mean(values: Floats) -> float:
    """Mean of those that are numbers; NaN of none."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")
