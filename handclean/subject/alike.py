"""Whether several takes can be of one hand with the same markers on it.

Markers on the same bone keep their distances however the hand moves, save for what skin
and soft tissue let them slide. So the median distance of each such pair in one take is
compared with that in the first. Measured, root mean square over the pairs: 0.05 to
0.14 mm between simulated takes of one hand, up to 0.4 mm between the thirds of real
ones, where the distances of a pair vary by 0.1 to 0.5 mm within each; 5.5 mm between
two simulated people with the same marker set. Markers on a rigid plate, as on the back
of some gloves, keep their distances on whatever hand: they tell nothing.
"""

from itertools import combinations

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.model import Model
from handclean.remarks import Remark, remark
from handclean.subject.frames import LEAST_FRAMES, Frames

DIFFERENT_RMS_M = 0.0015
"""[m] RMS difference of distances from which on takes are called different (chosen
between the figures above)."""

DIFFERENT_SPREADS = 2.0
"""And how many times more than the distances vary within takes (chosen)."""


def remarks_on_takes(model: Model, frames: Frames) -> list[Remark]:
    """Say which takes are of another hand, or of other markers, than the first.

    Parameters
    ----------
    model : of the hand, with the M markers of the frames.
    """
    pairs = np.array(
        [
            (a, b)
            for a, b in combinations(range(len(model.labels)), 2)
            if model.bone[a] == model.bone[b]
        ],
        dtype=np.int64,
    ).reshape(-1, 2)
    if not len(pairs) or len(frames.rates) < 2:
        return []
    found = [_distances(frames, take, pairs) for take in range(len(frames.rates))]
    first = found[0]
    remarks: list[Remark] = []
    for take, other in enumerate(found[1:], 1):
        away = other[0] - first[0]
        both = np.isfinite(away)
        if not both.any():
            continue
        rms = float(np.sqrt(np.mean(away[both] ** 2)))
        varies = float(np.sqrt(np.mean(np.fmax(other[1], first[1])[both] ** 2)))
        if rms < max(DIFFERENT_RMS_M, DIFFERENT_SPREADS * varies):
            continue
        worst = int(np.nanargmax(np.abs(away)))
        a, b = (model.labels[m] for m in pairs[worst])
        name, other_name = frames.called(0), frames.called(take)
        remarks.append(
            remark(
                "fit",
                f"{other_name} is hardly of the hand of {name}, or its markers were "
                f"moved: distances of markers on the same bone differ by "
                f"{1e3 * rms:.1f} mm RMS; {a} and {b} are "
                f"{1e3 * first[0][worst]:.1f} mm apart in {name}, "
                f"{1e3 * other[0][worst]:.1f} mm in {other_name}; give takes of one "
                "hand, between which no marker was moved",
                take=other_name,
                rms_m=rms,
                markers=[a, b],
            )
        )
    return remarks


def _distances(frames: Frames, take: int, pairs: Ints) -> tuple[Floats, Floats]:
    """(N,) [m] median distance of each pair in a take, and how much it varies.

    NaN where both markers were measured in fewer than `LEAST_FRAMES` frames.
    """
    rows = frames.take == take
    targets, seen = frames.targets[rows], frames.seen[rows]
    middle, varies = np.full(len(pairs), np.nan), np.full(len(pairs), np.nan)
    for n, (a, b) in enumerate(pairs):
        there = seen[:, a] & seen[:, b]
        if there.sum() >= LEAST_FRAMES:
            apart = np.linalg.norm(targets[there, a] - targets[there, b], axis=1)
            middle[n] = np.median(apart)
            varies[n] = 1.4826 * np.median(np.abs(apart - middle[n]))
    return middle, varies
