"""Time of a gap against length of the take and number of gaps, and memory."""

import time
import tracemalloc

import numpy as np

from handclean.gaps.fill_tracks import fill_tracks
from handclean.gaps.settings import FillConfig

GAP_S = 0.2


def longer(take, frames, rng):
    """A take played forwards and backwards until it is long enough, with new noise."""
    once = take.positions
    both = np.concatenate([once, once[::-1]])
    places = np.concatenate([both] * (frames // len(both) + 1))[:frames]
    return places + rng.normal(scale=2e-5, size=places.shape)


def cut(places, rate, count, rng):
    """Cut gaps of one marker into a take."""
    places, n = places.copy(), round(GAP_S * rate)
    for start in np.linspace(2 * n, len(places) - 3 * n, count).astype(int):
        places[start : start + n, rng.integers(places.shape[1])] = np.nan
    return places


def rows(take, sizes, methods=("take", "auto")):
    """Rows: milliseconds of processor time a gap, and the most memory."""
    table = []
    for frames, count in sizes:
        rng = np.random.default_rng([101, frames, count])
        places = cut(longer(take, frames, rng), take.rate, count, rng)
        tracks = take.tracks(places)
        for method in methods:
            begun = time.process_time()
            done = fill_tracks(tracks, [], FillConfig(method=method))
            spent = time.process_time() - begun
            row = {"method": method, "frames": frames, "gaps": len(done.gaps)}
            row["ms a gap"] = round(1e3 * spent / len(done.gaps), 1)
            row["us a frame"] = round(1e6 * spent / frames, 1)
            table.append(row)
        tracemalloc.start()
        fill_tracks(tracks, [], FillConfig(method=methods[0]))
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        table[-len(methods)]["MB beside the take"] = round(most / 1e6, 1)
    return table
