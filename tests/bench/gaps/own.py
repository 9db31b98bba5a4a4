"""The gaps that recordings come with: how many are filled, by what, how sure."""

from collections import Counter
from dataclasses import replace

import numpy as np

from handclean.arrays import runs
from handclean.gaps import pseudo
from handclean.gaps.fill import fill, hands_of
from handclean.gaps.fill_tracks import fill_tracks
from handclean.gaps.hand import bridge_hand
from handclean.gaps.settings import FillConfig
from handclean.hand.model import marker_positions
from handclean.ik.settings import SolveConfig
from handclean.recording import Origin

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


def from_the_hand(name, recording, subject, prior):
    """Rows: filled samples against the solved hand's markers, by length of gaps.

    The hand is solved from what is measured alone. Distances are per axis, in units of
    both sigmas: that of the sample, and the calibrated residual of the hand's marker.
    Only frames whose posture is trusted count. What the hand itself leaves open while
    its marker is hidden is in neither sigma.
    """
    filled, _ = fill(recording, subject, prior=prior)
    markers, model = filled.markers, subject.model
    (motion,) = filled.motions.values()
    solved = marker_positions(model, motion.poses)
    residual = subject.marker_sigma / np.sqrt(3.0)
    of_length = {}
    for own, label in enumerate(model.labels):
        if label not in markers.labels:
            continue
        column = markers.labels.index(label)
        for start, stop in runs(markers.origin[:, column] == Origin.FILLED):
            rows = np.arange(start, stop)[motion.trusted[start:stop]]
            away = np.abs(markers.positions[rows, column] - solved[rows, own])
            sigma = np.hypot(markers.sigma[rows, column], residual[own])
            kind = min(
                pseudo.LENGTHS_S,
                key=lambda s, n=stop - start: abs(np.log(s * filled.rate / n)),
            )
            if len(rows):
                of_length.setdefault(kind, []).append((away, away / sigma[:, None]))
    table = []
    for length in sorted(of_length):
        away, ratio = (
            np.concatenate([part[i].ravel() for part in of_length[length]])
            for i in (0, 1)
        )
        table.append(
            {
                "take": name,
                "gap s": length,
                "gaps": len(of_length[length]),
                "samples": len(away) // 3,
                "mean mm": round(1e3 * float(away.mean()), 2),
                "0.68 quantile, sigmas": round(float(np.quantile(ratio, 0.68)), 2),
                "0.95 quantile, sigmas": round(float(np.quantile(ratio, 0.95)), 2),
            }
        )
    return table
