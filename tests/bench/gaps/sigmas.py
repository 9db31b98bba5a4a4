"""Whether sigma is true: takes as they are, cut as `fill-gaps --evaluate` does."""

import numpy as np

from gaps.errors import words
from handclean.gaps.cuts import plan_cuts
from handclean.gaps.evaluate import errors_of, judge, named
from handclean.gaps.scores import against

FILLERS = ("ridge", "take", "auto")


def judgements(takes, per_cell, most_rounds):
    """Judge the three fillers on every take."""
    found = []
    for take in takes:
        tracks = take.tracks()
        rounds = plan_cuts(
            tracks, take.fingers, per_cell=per_cell, most_rounds=most_rounds
        )
        fillers = {name: named(name) for name in FILLERS}
        found.append(judge(tracks, rounds, fillers))
    return found


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
        spent = sum(one.seconds[name] for one in judgements)
        table.append(
            {
                "filler": name,
                "gaps": f"{found.gaps} of {len(errors[name])}",
                "ratio": words(found.geometric),
                "of means": words(found.of_means),
                "worse than 1.25": f"{found.worse:.1%}",
                "ms a gap": round(1e3 * spent / len(errors[name]), 1),
            }
        )
    return table
