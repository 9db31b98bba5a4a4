"""Figures of fillers at the same gaps, with intervals.

Errors of two fillers at the same N gaps give two ratios: the geometric mean of the
gaps' own ratios, in which every gap counts alike, and the ratio of their mean errors,
in which bad gaps count most. Intervals are of the bootstrap over gaps: N gaps are drawn
with replacement again and again, and 95 % of the ratios lie between the bounds (Efron
and Tibshirani, An Introduction to the Bootstrap, 1993, section 13.3).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats
from handclean.gaps.cuts import AT_ONCE, FINGER, OWN
from handclean.gaps.evaluate import YARDSTICK, Judged, Judgement

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


FILLED_AS_MUCH = 0.9
"""A filler can win a cell if it fills this share, at least, of the gaps that the one
that fills most of them fills (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """A filler at all gaps, or at those of one cell.

    Attributes
    ----------
    gaps : how many there are; refused : share that it cannot fill.
    unsure : share that it fills and whose expected error is over ``max_sigma_m``.
    mean_m, last_m : [m] mean error over a gap and on its last frame.
    against : compared with the yardstick.
    within, within_q95 : share of errors per axis within sigma, and q95 sigmas.
    """

    filler: str
    gaps: int
    refused: float
    unsure: float
    mean_m: float
    last_m: float
    against: Against
    within: float
    within_q95: float


class Cell(NamedTuple):
    """Pattern and length [s] of gaps."""

    pattern: str
    length_s: float


def cells_of(judgement: Judgement) -> list[Cell]:
    """List the cells that have gaps, by pattern, then by length."""
    found = {Cell(row.cut.pattern, row.cut.length_s) for row in judgement.rows}
    order = [*map(str, AT_ONCE), FINGER, OWN]
    return sorted(found, key=lambda cell: (order.index(cell.pattern), cell.length_s))


def score(
    judgement: Judgement,
    filler: str,
    max_sigma_m: float,
    cells: Collection[Cell] | None = None,
) -> Score:
    """Score a filler at the gaps of some cells; of all cells if none are named.

    Parameters
    ----------
    max_sigma_m : [m] expected error up to which ``fill-gaps`` fills a gap.
    """
    rows = _rows(judgement, filler, cells)
    errors, yardstick = (
        np.array([row.mean_m for row in part])
        for part in (rows, _rows(judgement, YARDSTICK, cells))
    )
    return Score(
        filler=filler,
        gaps=len(rows),
        refused=mean([bool(row.refused) for row in rows]),
        unsure=mean([row.expected_m > max_sigma_m for row in rows]),
        mean_m=mean(errors),
        last_m=mean([row.last_m for row in rows]),
        against=against(errors, yardstick, np.random.default_rng(0)),
        within=mean([row.within for row in rows]),
        within_q95=mean([row.within_q95 for row in rows]),
    )


def winner(scores: Sequence[Score]) -> Score | None:
    """Return the score of the least mean error of those that fill enough gaps."""
    most = max((1.0 - one.refused for one in scores), default=0.0)
    able = [one for one in scores if 1.0 - one.refused >= FILLED_AS_MUCH * most > 0.0]
    return min(able, key=lambda one: one.mean_m, default=None)


def _rows(
    judgement: Judgement, filler: str, cells: Collection[Cell] | None
) -> list[Judged]:
    return [
        row
        for row in judgement.rows
        if row.filler == filler
        and (cells is None or (row.cut.pattern, row.cut.length_s) in cells)
    ]


def mean(values: Sequence[float] | Floats) -> float:
    """Mean of those that are numbers; NaN of none."""
    all_of = np.asarray(values, dtype=np.float64)
    known = all_of[np.isfinite(all_of)]
    return float(known.mean()) if len(known) else float("nan")
