"""A model through a whole take: found, followed both ways, found again when lost."""

import numpy as np

from handclean.arrays import Ints
from handclean.ik.settings import SolveConfig
from handclean.labels.points import Cloud
from handclean.labels.review.paths import paths_of
from handclean.labels.review.repair import repair
from handclean.labels.review.review import Scene, refit, review
from handclean.labels.review.suppose import measure, measured, usual_variance
from handclean.labels.search.align import Found, good, search
from handclean.labels.settings import LabelConfig
from handclean.labels.target import Sought
from handclean.labels.track.frames import follow
from handclean.labels.track.links import path_links
from handclean.labels.track.tracker import (
    Kit,
    Rules,
    Trace,
    Way,
    kit_of,
    make_trace,
    new_book,
    new_state,
)

STEADFAST = 0.98
"""Share of links between points of one name below which paths are not reviewed."""

REVIEWS = 2
"""How often the paths are reviewed at most."""

EFFORTS = ((4, 0, 8), (36, 30, 30))
"""Postures, orientations, and how many of them are bent: at first, and when needed."""


HOPELESS = 4
"""How many times longer each step to the next search is while no search found the hand
anywhere: neither those of `first_fit`, nor those since."""


def first_fit(
    cloud: Cloud,
    thing: Sought,
    rules: Rules,
    settings: LabelConfig,
    solving: SolveConfig,
) -> Found | None:
    """Find the model in the best of the frames with the most points."""
    counts = np.diff(cloud.start)
    least = max(4, len(thing.sigma) // 2)
    if cloud.frames == 0 or counts.max() < least:
        return None
    many = max(settings.start_frames, len(counts) // 50)
    full = np.sort(counts)[-min(many, len(counts))]
    rows = np.flatnonzero(counts >= max(full, least))
    tried = min(settings.start_frames, len(rows))
    spread = np.linspace(0, len(rows) - 1, tried).astype(int)
    best: Found | None = None
    for effort in EFFORTS:
        for frame in np.unique(rows[spread]):
            one = find(cloud, thing, int(frame), rules, settings, solving, effort)
            if one is not None and (best is None or one.score < best.score):
                best = one
            if best is not None and good(best):
                return best
    return best


def find(
    cloud: Cloud,
    thing: Sought,
    frame: int,
    rules: Rules,
    settings: LabelConfig,
    solving: SolveConfig,
    effort: tuple[int, int, int],
) -> Found | None:
    """Find the model in one frame, without knowing anything."""
    ways = search(
        cloud.at[cloud.start[frame] : cloud.start[frame + 1]],
        thing,
        frame,
        rules=rules,
        alpha=settings.alpha,
        solving=solving,
        postures=min(effort[0], len(thing.starts)),
        rotations=effort[1],
        keep=effort[2],
    )
    return ways[0] if ways else None


def pursue(
    cloud: Cloud,
    found: Found,
    rules: Rules,
    settings: LabelConfig,
    solving: SolveConfig,
) -> Trace:
    """Follow a model from where it was found to both ends of the take.

    Where it was not found well, and nothing could be followed from there, it is looked
    for in few more frames (see `HOPELESS`).
    """
    thing = found.thing
    most = max(int(rules.patience), 1)
    kit = kit_of(thing, rules, solving)
    trace = make_trace(cloud.frames, len(thing.sigma), len(thing.mean))
    after, before = path_links(cloud, settings, 4.0 * rules.patience)
    ways = (
        Way(cloud.at, cloud.start, before),
        Way(cloud.at, cloud.start, after),
    )
    for way, stop, by in zip(ways, (cloud.frames, -1), (1, -1), strict=True):
        here: Found | None = found
        first, stride = found.frame, 1
        while first != stop:
            if here is not None:
                lost = _run(way, here, kit, rules, first, stop, by, trace)
                first = lost if lost != first else first + by
                here = None
                if first == stop:
                    break
            points = cloud.start[first + 1] - cloud.start[first]
            if points >= max(4, len(thing.sigma) // 2):
                here = find(cloud, thing, first, rules, settings, solving, EFFORTS[1])
            if here is not None and not good(here):
                here = None
            if here is None:
                hopeless = not (good(found) or trace.known.any())
                stride = HOPELESS * stride if hopeless else min(stride + 1, most)
                first = min(first + stride, stop) if by > 0 else max(first - stride, -1)
            else:
                stride = 1
    if not trace.known.any():
        return trace
    repair(ways, thing, kit, settings, solving, trace)
    _review(cloud, after, before, kit, trace)
    return trace


def _review(cloud: Cloud, after: Ints, before: Ints, kit: Kit, trace: Trace) -> None:
    """Judge the points' paths as wholes, if paths tell anything in this take."""
    paths = paths_of(cloud, after, before, trace)
    rows = np.flatnonzero((after >= 0) & (paths.name >= 0))
    if len(rows) == 0:
        return
    if np.mean(paths.name[after[rows]] == paths.name[rows]) < STEADFAST:
        return
    way = Way(cloud.at, cloud.start, before)
    places, squares = measured(way, kit, trace)
    kit = kit._replace(variance=usual_variance(squares, kit))
    state = new_state(trace.chosen.shape[1], len(kit.mean))
    scene = Scene(paths, way, state, kit, trace, places)
    for _ in range(REVIEWS):
        if review(scene, squares) == 0:
            break
        refit(scene)
        measure(way, kit, trace, places, squares)


def _run(
    way: Way,
    found: Found,
    kit: Kit,
    rules: Rules,
    first: int,
    stop: int,
    by: int,
    trace: Trace,
) -> int:
    """Follow a model from one find until it is lost; return where."""
    thing = found.thing
    state = new_state(len(thing.sigma), len(thing.mean))
    state.pose[:] = found.pose
    book = new_book(thing, rules, (found.chosen < 0).astype(np.int64))
    return int(follow(way, first, stop, by, state, book, kit, trace))
