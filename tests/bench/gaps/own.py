"""The gaps that recordings come with: how many are filled, by what, how sure."""

from collections import Counter
from dataclasses import replace

import numpy as np

from handclean.gaps.fill import hands_of
from handclean.gaps.fill_tracks import fill_tracks
from handclean.gaps.hand import bridge_hand
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig

LEAST_SEEN = 0.2
MAX_SIGMAS_M = (FillConfig().max_sigma_m, 0.01)


def rows(take, recording, subject, prior):
    """Rows: own gaps with the default and with 10 mm, with and without a subject."""
    table = []
    tracks = take.tracks()
    seen = tracks.seen.mean(axis=0)
    for whose, subjects in (("none", {}), ("calibrated", {"hand": subject})):
        if subject is None and subjects:
            continue
        settings = FillConfig()
        hands = hands_of(recording, subjects, prior, settings, SolveConfig())
        bridged = [bridge_hand(hand, tracks) for hand in hands.values()]
        for max_sigma_m in MAX_SIGMAS_M:
            done = fill_tracks(
                tracks, bridged, replace(settings, max_sigma_m=max_sigma_m)
            )
            table.append(_row(take, done, seen, whose, max_sigma_m))
    return table


def _row(take, done, seen, whose, max_sigma_m):
    asked = [one for one in done.gaps if seen[one.gap.column] >= LEAST_SEEN]
    filled = [one for one in asked if not one.gap.refused]
    samples = sum(one.gap.frames for one in asked)
    by = Counter(one.source for one in filled)
    open_ = [one for one in asked if one.gap.refused]
    rare = [one for one in done.gaps if seen[one.gap.column] < LEAST_SEEN]
    expected = [1e3 * one.expected_m for one in filled]
    why = Counter(one.gap.refused.split(" =")[0] for one in open_)
    return {
        "take": take.name,
        "subject": whose,
        "max sigma mm": 1e3 * max_sigma_m,
        "gaps": len(asked),
        "filled": f"{len(filled) / max(len(asked), 1):.1%}",
        "samples filled": (
            f"{sum(one.gap.frames for one in filled) / max(samples, 1):.1%}"
        ),
        "by": ", ".join(f"{name} {n}" for name, n in by.most_common()),
        "sigma mm: median, largest": (
            f"{np.median(expected):.2f}, {max(expected):.2f}" if expected else ""
        ),
        "open": "; ".join(f"{n}: {text}" for text, n in why.most_common(3)),
        "of rarely seen markers": (
            f"{sum(not one.gap.refused for one in rare)} of {len(rare)} filled"
        ),
    }
