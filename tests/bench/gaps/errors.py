"""Errors of fillers at the gaps of the fifteen cells, and figures of these."""

import time
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np

from gaps.cells import LENGTHS_S, PATTERNS
from handclean.gaps.runs import Gap
from handclean.gaps.scores import against
from handclean.gaps.tracks import Refused

YARDSTICK = "ridge"


@dataclass
class Errors:
    """Errors [m] at N gaps, NaN where a filler refuses.

    mean, last : by filler, over the gap and on its last frame. bend : [m] root mean
    square second difference at both edges, by filler and "truth". seconds : of
    processor time by filler, preparing among it.
    """

    holes: list = field(default_factory=list)
    mean: dict = field(default_factory=lambda: defaultdict(list))
    last: dict = field(default_factory=lambda: defaultdict(list))
    bend: dict = field(default_factory=lambda: defaultdict(list))
    seconds: dict = field(default_factory=lambda: defaultdict(float))

    def add(self, other):
        """Put those of other gaps behind these."""
        self.holes += other.holes
        for mine, theirs in (
            (self.mean, other.mean),
            (self.last, other.last),
            (self.bend, other.bend),
        ):
            for name, values in theirs.items():
                mine[name] += values
        for name, spent in other.seconds.items():
            self.seconds[name] += spent

    def where(self, test):
        """(N,) which gaps a test holds for."""
        return np.array([test(hole) for hole in self.holes])


def punched(take, hole):
    """A take without what a gap hides."""
    places = take.positions.copy()
    places[hole.first : hole.stop, hole.hidden] = np.nan
    return take.tracks(places)


def paths(prepare, tracks, hole):
    """(N, k, 3) [m] what a filler puts into a gap; raises `Refused`."""
    fill = prepare(tracks)
    gaps = [Gap(column=m, start=hole.first, stop=hole.stop) for m in hole.hidden]
    return np.stack([fill(gap).places for gap in gaps], axis=1)


def judged(take, holes, fillers):
    """Errors of fillers (functions ``prepare`` by name) at gaps of a take."""
    found = Errors(holes=list(holes))
    for hole in holes:
        tracks, truth = punched(take, hole), _truth(take, hole)
        found.bend["truth"].append(_bend(take, hole, truth))
        for name, prepare in fillers.items():
            begun = time.process_time()
            try:
                filled = paths(prepare, tracks, hole)
            except Refused:
                filled = None
            found.seconds[name] += time.process_time() - begun
            note(found, name, take, hole, filled)
    return found


def note(found, name, take, hole, filled):
    """Note errors of what was filled into a gap, (N, k, 3) [m] or None."""
    truth = _truth(take, hole)
    places = np.full(truth.shape, np.nan) if filled is None else filled
    away = np.linalg.norm(places - truth, axis=2)
    found.mean[name].append(float(away.mean()))
    found.last[name].append(float(away[-1].mean()))
    found.bend[name].append(_bend(take, hole, places))


def _truth(take, hole):
    return take.positions[hole.first : hole.stop, hole.hidden]


def _bend(take, hole, filled):
    """[m] root mean square second difference about the first and the last edge."""
    around = take.positions[hole.first - 2 : hole.stop + 2, hole.hidden].copy()
    around[2:-2] = filled
    second = np.diff(around, 2, axis=0)
    edges = np.concatenate([second[:2], second[-2:]])
    return float(np.sqrt(np.mean(np.sum(edges**2, axis=2))))


def compared(errors, name, test=lambda hole: True):
    """A filler against the yardstick at those gaps that a test holds for."""
    at = errors.where(test)
    mine, theirs = (np.array(errors.mean[n])[at] for n in (name, YARDSTICK))
    return against(mine, theirs, np.random.default_rng(0))


def words(interval):
    """A figure with its interval."""
    return f"{interval.value:.3f} [{interval.low:.3f}, {interval.high:.3f}]"


def overall(errors):
    """Rows: each filler against the yardstick, over all cells."""
    table = []
    for name in errors.mean:
        found = compared(errors, name)
        mean = np.array(errors.mean[name])
        row = {"filler": name, "gaps": f"{found.gaps} of {len(mean)}"}
        if found.gaps:
            row["ratio"] = words(found.geometric)
            row["of means"] = words(found.of_means)
            row["worse than 1.25"] = f"{found.worse:.1%}"
            row["mean mm"] = round(1e3 * float(np.nanmean(mean)), 2)
        row["ms a gap"] = round(1e3 * errors.seconds[name] / len(mean), 1)
        table.append(row)
    return table


def by_take(errors, names):
    """Rows: geometric ratio in each take."""
    table = []
    for take in dict.fromkeys(hole.take for hole in errors.holes):
        row = {"recording": take}
        for name in names:
            found = compared(errors, name, lambda hole, t=take: hole.take == t)
            row[name] = words(found.geometric) if found.gaps else ""
            if name == names[0]:
                row = {"recording": take, "gaps": found.gaps, **row}
        table.append(row)
    return table


def by_cell(errors, name):
    """Rows: geometric ratio with its interval in the fifteen cells."""
    table = []
    for pattern in PATTERNS:
        row = {"hidden": pattern}
        for length in LENGTHS_S:
            cell = (pattern, length)
            found = compared(errors, name, lambda hole, c=cell: hole.cell == c)
            row[f"{length} s"] = words(found.geometric) if found.gaps else ""
        table.append(row)
    return table


def millimetres(errors):
    """Rows: mean error [mm] of each filler by pattern and length."""
    table = []
    for name in errors.mean:
        mean = 1e3 * np.array(errors.mean[name])
        if not np.isfinite(mean).any():
            continue
        row = {"filler": name}
        for pattern in PATTERNS:
            for length in LENGTHS_S:
                at = errors.where(lambda hole, c=(pattern, length): hole.cell == c)
                known = mean[at][np.isfinite(mean[at])]
                row[f"{pattern}: {length} s"] = (
                    round(float(known.mean()), 2) if len(known) else ""
                )
        table.append(row)
    return table


def ends(errors):
    """Rows: second differences [mm] at the edges of gaps, truth's first."""
    table = []
    for name in ("truth", *errors.mean):
        bend = 1e3 * np.array(errors.bend[name])
        if not np.isfinite(bend).any():
            continue
        row = {"filler": name, "median": round(float(np.nanmedian(bend)), 3)}
        row["mean"] = round(float(np.nanmean(bend)), 3)
        row["95 %"] = round(float(np.nanpercentile(bend, 95)), 3)
        table.append(row)
    return table
