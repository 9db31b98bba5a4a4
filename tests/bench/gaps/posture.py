"""Fillers that follow a hand's posture: a subject calibrated from the same take."""

import time

import numpy as np

from gaps.errors import words
from handclean.gaps.cuts import plan_cuts
from handclean.gaps.evaluate import errors_of, judge, named
from handclean.gaps.fill import fill, hands_of
from handclean.gaps.scores import against
from handclean.gaps.settings import POSTURE_METHODS, FillConfig
from handclean.ik.settings import SolveConfig


def hands(recording, subject, prior, method):
    """The hand of a take as a method bridges it."""
    settings = FillConfig(method=method)
    found = hands_of(recording, {"hand": subject}, prior, settings, SolveConfig())
    return list(found.values())


def rows(name, take, recording, subject, prior, per_cell, most_rounds):
    """Rows: errors of each method, by pattern, on the same gaps."""
    tracks = take.tracks()
    rounds = plan_cuts(tracks, take.fingers, per_cell=per_cell, most_rounds=most_rounds)
    fillers = {"ridge": named("ridge"), "take": named("take")}
    for method in (*POSTURE_METHODS, "auto"):
        own = hands(recording, subject, prior, method)
        fillers[method] = named(method, own)
    found = judge(tracks, rounds, fillers)
    cuts = [cut for part in rounds for cut in part]
    patterns = list(dict.fromkeys(cut.pattern for cut in cuts))
    table = []
    for method in fillers:
        errors, ridge = errors_of(found, method), errors_of(found, "ridge")
        ratio = against(errors, ridge, np.random.default_rng(0))
        row = {"take": name, "filler": method, "gaps": f"{ratio.gaps} of {len(cuts)}"}
        row["ratio"] = words(ratio.geometric)
        for pattern in patterns:
            at = np.array([cut.pattern == pattern for cut in cuts])
            known = errors[at][np.isfinite(errors[at])]
            row[f"{pattern}, mm"] = (
                round(1e3 * float(known.mean()), 2) if len(known) else ""
            )
        row["ms a gap"] = round(1e3 * found.seconds[method] / len(cuts), 1)
        table.append(row)
    return table


def speed(takes, prior):
    """Rows: frames per second, solve and fill with the prior, of takes as they are."""
    table = []
    for name, part in takes.items():
        fill(part[0][0], part[0][1], prior=prior)
        for method in (*POSTURE_METHODS, "auto"):
            frames, begun = 0, time.process_time()
            for take, subject in part:
                fill(take, subject, prior=prior, settings=FillConfig(method=method))
                frames += take.frames
            spent = time.process_time() - begun
            row = {"takes": name, "method": method, "frames": frames}
            table.append({**row, "frames/s": round(frames / spent)})
    return table
