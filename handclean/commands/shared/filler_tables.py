"""What was found of fillers, as text, as rows and as figures."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handclean.gaps.evaluate import YARDSTICK, Judgement
from handclean.gaps.scores import Against, Cell, Interval, Score, winner
from handclean.recording import Numbering

PAVLLO = {"last": "LK", "average": "MA", "affine": "AC"}
"""Baselines of Pavllo et al. 2019, table 3, by the names they have here."""

FOREMOST = (YARDSTICK, "take", "auto")
"""Fillers that are always shown beside them."""

COLUMNS = (
    "number",
    "pattern",
    "length_s",
    "markers",
    "first_frame",
    "last_frame",
    "filler",
    "filled_by",
    "mean_mm",
    "last_mm",
    "sigma_mm",
    "within_sigma",
    "within_q95",
    "refused",
)
"""Of ``evaluation.csv``, which has a line for each gap and filler."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """Scores of fillers on one take.

    Attributes
    ----------
    labels : the take's markers; frames : how many of its frames were looked at.
    numbering : how its source numbers them.
    overall : by filler; by_cell : by cell and filler.
    """

    judgement: Judgement
    labels: Sequence[str]
    frames: int
    numbering: Numbering
    overall: Mapping[str, Score]
    by_cell: Mapping[Cell, Mapping[str, Score]]

    @property
    def best(self) -> Score | None:
        """The score of the filler that wins over all gaps, if any fills any."""
        return winner(list(self.overall.values()))

    @property
    def gap_ms(self) -> dict[str, float]:
        """[ms] of processor time a gap, by filler."""
        return {
            name: 1e3 * self.judgement.seconds[name] / max(one.gaps, 1)
            for name, one in self.overall.items()
        }


def figures(found: Found) -> dict[str, Any]:
    """Return plain values of all scores."""
    return {
        "fillers": {
            name: {**_figures(one), "gap_ms": found.gap_ms[name]}
            for name, one in found.overall.items()
        },
        "cells": [
            {
                "pattern": cell.pattern,
                "length_s": cell.length_s,
                "won_by": won.filler if (won := winner(list(of.values()))) else None,
                "fillers": {name: _figures(one) for name, one in of.items()},
            }
            for cell, of in found.by_cell.items()
        ],
    }


def _figures(one: Score) -> dict[str, Any]:
    return {
        "gaps": one.gaps,
        "refused": one.refused,
        "unsure": one.unsure,
        "mean_mm": 1e3 * one.mean_m,
        "last_mm": 1e3 * one.last_m,
        "within_sigma": one.within,
        "within_q95": one.within_q95,
        **_ratios(one.against),
    }


def _ratios(found: Against) -> dict[str, Any]:
    return {
        "ratio": found.geometric.value,
        "ratio_95": [found.geometric.low, found.geometric.high],
        "ratio_of_means": found.of_means.value,
        "ratio_of_means_95": [found.of_means.low, found.of_means.high],
        "worse_than_1_25": found.worse,
    }


def in_text(found: Found) -> str:
    """Write the tables that everybody wants to see."""
    few = [name for name in (*PAVLLO, *FOREMOST) if name in found.overall]
    if len(found.overall) <= len(few) + 1:
        few = list(found.overall)
    return "\n\n".join([_overall(found), _winners(found), _last_frames(found, few)])


def at_length(found: Found) -> str:
    """Write all tables."""
    last = _last_frames(found, list(found.overall))
    return "\n\n".join([_overall(found), _winners(found), last, _cells(found)])


def _overall(found: Found) -> str:
    lines = [
        "all gaps: error against the ridge's, in the geometric mean and of means, with "
        "95 % intervals",
        f"{'filler':<16} {'ratio':<18} {'of means':<18} >1.25  {'mean':>7} "
        f"{'open':>9} {'sigma':>9} {'ms':>5}",
    ]
    for name, one in found.overall.items():
        ratio = one.against
        lines.append(
            f"{name:<16} {_interval(ratio.geometric)} {_interval(ratio.of_means)} "
            f"{_share(ratio.worse)}  {_mm(one.mean_m)} "
            f"{_share(one.refused)}{_share(one.unsure)} "
            f"{_share(one.within)}{_share(one.within_q95)} {found.gap_ms[name]:5.0f}"
        )
    lines += [
        "  >1.25: gaps with more than 1.25 times the ridge's error; mean: [mm]; open: "
        "refused, and",
        "  too unsure for --max-sigma-m; sigma: errors per axis within sigma, within "
        "q95 sigmas;",
        "  ms: processor time a gap, what is learnt from pseudo-gaps in it",
    ]
    return "\n".join(lines)


def _winners(found: Found) -> str:
    lengths = sorted({cell.length_s for cell in found.by_cell})
    lines = ["filler of the least mean error [mm]"]
    lines.append("hidden " + "".join(f"{length:>11} s" for length in lengths))
    for pattern in dict.fromkeys(cell.pattern for cell in found.by_cell):
        line = f"{pattern:<7}"
        for length in lengths:
            scores = found.by_cell.get(Cell(pattern, length))
            won = winner(list(scores.values())) if scores else None
            text = "" if won is None else f"{won.filler[:7]}{_mm(won.mean_m, 5)}"
            line += f"{text:>13}"
        lines.append(line.rstrip())
    return "\n".join(lines)


def _last_frames(found: Found, names: Sequence[str]) -> str:
    """Write table 3 of Pavllo et al. 2019 for this take, in its form."""
    cells = [cell for cell in found.by_cell if cell.pattern.isdigit()]
    lengths = sorted({cell.length_s for cell in cells})
    lines = [
        "error on the last frame [cm] (Pavllo et al. 2019, table 3)",
        f"{'method':<16} occlusions" + "".join(f"{s:>8} s" for s in lengths),
    ]
    for name in names:
        lines += _last_frames_of(found, name, lengths)
    return "\n".join(lines)


def _last_frames_of(found: Found, name: str, lengths: Sequence[float]) -> list[str]:
    lines = []
    for pattern in sorted({c.pattern for c in found.by_cell if c.pattern.isdigit()}):
        of = [found.by_cell.get(Cell(pattern, length)) for length in lengths]
        lines.append(
            f"{PAVLLO.get(name, name):<16} {pattern:<10}"
            + "".join(
                f"{_cm(scores[name].last_m if scores else None)}" for scores in of
            )
        )
    return lines


def _cells(found: Found) -> str:
    lengths = sorted({cell.length_s for cell in found.by_cell})
    lines = [
        "mean error over the gap [mm]",
        f"{'filler':<16} hidden " + "".join(f"{s:>8} s" for s in lengths),
    ]
    for name in found.overall:
        for pattern in dict.fromkeys(cell.pattern for cell in found.by_cell):
            of = [found.by_cell.get(Cell(pattern, length)) for length in lengths]
            line = f"{name:<16} {pattern:<7}"
            line += "".join(
                f"{_mm(scores[name].mean_m, 10) if scores else '':>10}" for scores in of
            )
            lines.append(line.rstrip())
    return "\n".join(lines)


def _interval(found: Interval) -> str:
    if found.value != found.value:
        return f"{'-':<18}"
    value, low, high = map(_ratio, found)
    return f"{f'{value} [{low}, {high}]':<18}"


def _ratio(value: float) -> str:
    """Write a number with three figures or so."""
    decimals = 2 if value < 9.995 else 1 if value < 99.95 else 0
    return f"{value:.{decimals}f}"


def _share(value: float) -> str:
    return "    -" if value != value else f"{100 * value:4.0f}%"


def _mm(value: float, wide: int = 7) -> str:
    return f"{'-':>{wide}}" if value != value else f"{1e3 * value:{wide}.2f}"


def _cm(value: float | None) -> str:
    if value is None or value != value:
        return f"{'-':>10}"
    return f"{100.0 * value:10.3f}"


def write_rows(path: Path, found: Found) -> None:
    """Write a line for each gap and filler as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(COLUMNS)
        out.writerows(_csv_rows(found))


def _csv_rows(found: Found) -> Iterable[tuple[object, ...]]:
    rows = found.judgement.rows
    count = len(rows) // max(len(found.overall), 1)
    for number, row in enumerate(rows):
        gap = row.cut.parts[0].gap
        numbers = (
            1e3 * row.mean_m,
            1e3 * row.last_m,
            1e3 * row.expected_m,
            row.within,
            row.within_q95,
        )
        yield (
            number % count + 1,
            row.cut.pattern,
            row.cut.length_s,
            " ".join(found.labels[column] for column in row.cut.columns),
            *found.numbering.span(gap.start, gap.stop),
            row.filler,
            row.by,
            *("" if row.refused else f"{value:.6g}" for value in numbers),
            row.refused,
        )
