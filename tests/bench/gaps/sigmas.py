"""Whether sigma is true: takes as they are, cut as `fill-gaps --evaluate` does."""

import numpy as np

from gaps.errors import words
from handclean.gaps.cuts import plan_cuts
from handclean.gaps.evaluate import errors_of, judge, named
from handclean.gaps.scores import against
from handclean.gaps.settings import FillConfig

FILLERS = ("ridge", "take", "auto")


def judgements(takes, per_cell, most_rounds):
    """Judge the three fillers on every take."""
    found = []
    for take in takes:
        tracks = take.tracks()
        rounds = plan_cuts(
            tracks, take.fingers, per_cell=per_cell, most_rounds=most_rounds
        )
        take = Remembering(named("take"))
        fillers = {"ridge": named("ridge"), "take": take, "auto": auto_after(take)}
        found.append(judge(tracks, rounds, fillers))
    return found


class Remembering:
    """A filler that keeps what it found, by the gaps it was asked."""

    def __init__(self, fill):
        self._fill = fill
        self.found = {}

    def __call__(self, tracks, gaps):
        self.found[tuple(gaps)] = found = self._fill(tracks, gaps)
        return found


def auto_after(take):
    """The method "auto" without a subject: what `take` found where that is enough.

    It asks the take's regression first, and others only for gaps that are too unsure
    then; where there are none, both are the same.
    """
    fill, enough_m = named("auto"), FillConfig().max_sigma_m

    def auto(tracks, gaps):
        found = take.found[tuple(gaps)]
        if all(one.expected_m <= enough_m for one in found):
            return found
        return fill(tracks, gaps)

    return auto


def coverage(judgements):
    """Rows: share of errors within sigma and q95 sigmas, by length of gaps."""
    table = []
    rows = [row for one in judgements for row in one.rows]
    lengths = sorted({row.cut.length_s for row in rows})
    for name in FILLERS:
        for length in [*lengths, "all"]:
            part = [
                row
                for row in rows
                if row.filler == name
                and not row.refused
                and length in (row.cut.length_s, "all")
            ]
            if part:
                table.append(
                    {
                        "filler": name,
                        "gap s": length,
                        "gaps": len(part),
                        "within sigma": f"{np.mean([r.within for r in part]):.1%}",
                        "within q95": f"{np.mean([r.within_q95 for r in part]):.1%}",
                        "median sigma mm": round(
                            1e3 * float(np.median([r.expected_m for r in part])), 2
                        ),
                    }
                )
    return table


def compared(judgements):
    """Rows: against the ridge, on takes with several gaps at once."""
    table = []
    errors = {
        name: np.concatenate([errors_of(one, name) for one in judgements])
        for name in FILLERS
    }
    for name in FILLERS:
        found = against(errors[name], errors["ridge"], np.random.default_rng(0))
        table.append(
            {
                "filler": name,
                "gaps": f"{found.gaps} of {len(errors[name])}",
                "ratio": words(found.geometric),
                "of means": words(found.of_means),
                "worse than 1.25": f"{found.worse:.1%}",
            }
        )
    return table
