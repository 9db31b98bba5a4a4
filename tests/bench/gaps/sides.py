"""Gaps with one end, which open or close a take, against holding the last place."""

from dataclasses import replace

import numpy as np

from handclean.gaps.runs import Gap
from handclean.gaps.scores import against
from handclean.gaps.tracks import Refused, Tracks


def cropped(take, hole):
    """A take that ends, or begins, with a gap: its longer side stays."""
    if hole.first >= len(take.positions) - hole.stop:
        kept, first = slice(0, hole.stop), hole.first
    else:
        kept, first = slice(hole.first, None), 0
    part = replace(take, positions=take.positions[kept])
    return part, first, first + hole.stop - hole.first


def turned(tracks):
    """A take backwards, so that a causal filler holds the place after a gap."""
    return Tracks(
        positions=tracks.positions[::-1].copy(), rate=tracks.rate, bones=tracks.bones
    )


def error(take, hole, prepare):
    """[m] mean error of a filler, NaN where it refuses."""
    part, first, stop = cropped(take, hole)
    places = part.positions.copy()
    places[first:stop, hole.hidden] = np.nan
    tracks, truth = part.tracks(places), part.positions[first:stop, hole.hidden]
    backwards = first == 0
    try:
        if prepare is held:
            place = part.positions[stop if backwards else first - 1, hole.hidden]
            filled = np.broadcast_to(place, truth.shape)
        else:
            fill = prepare(tracks)
            filled = np.stack(
                [
                    fill(Gap(column=m, start=first, stop=stop)).places
                    for m in hole.hidden
                ],
                axis=1,
            )
    except Refused:
        return float("nan")
    return float(np.linalg.norm(filled - truth, axis=2).mean())


def held():
    """Stands for holding the only measured place beside a gap."""


def rows(takes, holes_of, fillers):
    """Rows: mean error [mm] by length of gaps with one end."""
    names = {"hold": held, **fillers}
    found = {name: [] for name in names}
    lengths = []
    for take in takes:
        for hole in holes_of(take):
            lengths.append(hole.length_s)
            for name, prepare in names.items():
                found[name].append(error(take, hole, prepare))
    table = []
    for name, values in found.items():
        mine, ridge = np.array(values), np.array(found["ridge"])
        row = {"filler": name, "gaps": int(np.isfinite(mine).sum())}
        for length in sorted(set(lengths)):
            at = np.array(lengths) == length
            if np.isfinite(mine[at]).any():
                row[f"{length} s"] = round(1e3 * float(np.nanmean(mine[at])), 2)
        ratio = against(mine, ridge, np.random.default_rng(0)).geometric
        row["ratio to ridge"] = f"{ratio.value:.3f} [{ratio.low:.3f}, {ratio.high:.3f}]"
        table.append(row)
    return table
