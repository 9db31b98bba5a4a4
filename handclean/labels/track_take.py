"""A target through a whole take: found, tracked both ways, found again when lost."""

from typing import NamedTuple

import numpy as np

from handclean.labels.points import Cloud
from handclean.labels.review.paths import paths_of
from handclean.labels.review.repair import repair
from handclean.labels.review.review import Scene, refit, review
from handclean.labels.review.suppose import measure, measured, usual_variance
from handclean.labels.search.align import (
    FrameFit,
    SearchEffort,
    is_good_fit,
    search_frame,
)
from handclean.labels.target import TrackTarget
from handclean.labels.track.frames import track_frames
from handclean.labels.track.links import path_links
from handclean.labels.track.state import (
    FrameSequence,
    TrackResult,
    empty_result,
    new_state,
    start_stats,
)
from handclean.labels.track.tracker import Tracker, TrackSetup, make_tracker

MIN_NAME_AGREEMENT = 0.98
"""Share of links between points of one name below which paths are not reviewed, since
they do not tell one point from another. Chosen."""

MAX_REVIEWS = 2
"""How often the paths are reviewed at most. Chosen."""

QUICK_SEARCH = SearchEffort(postures=4, rotations=0, kept=8)
"""What is tried first in every frame that a take may begin with. Chosen."""

THOROUGH_SEARCH = SearchEffort(postures=36, rotations=30, kept=30)
"""What is tried when that found nothing good, and when the target was lost: every mix
of straight and bent fingers, in orientations about 45 degrees apart. Chosen."""

UNFOUND_STRIDE_FACTOR = 4
"""How many times longer each step to the next search is while no search found the
target anywhere: neither those of `find_first_fit`, nor those since. Chosen, so that a
take of another hand ends after few searches."""

FRAMES_PER_START_FRAME = 50
"""Of so many frames one of the fullest may be the first, in long takes. Chosen."""


class Direction(NamedTuple):
    """One of the two ways through a take.

    sequence : its points, with the paths that lead there. stop : the frame after the
    last. by : 1 forwards, -1 backwards.
    """

    sequence: FrameSequence
    stop: int
    by: int


def fewest_points(target: TrackTarget) -> int:
    """How many points a frame needs for a target to be looked for in it."""
    return max(4, len(target.sigma) // 2)


def find_first_fit(
    cloud: Cloud, target: TrackTarget, setup: TrackSetup
) -> FrameFit | None:
    """Find the target in the best of the frames with the most points.

    Returns
    -------
    the fit with the least score; None if no frame has enough points, or no fit is found

    References
    ----------
    Maycock et al. (2015), section III-A and equation 2.
    """
    counts = np.diff(cloud.start)
    least = fewest_points(target)
    if cloud.frames == 0 or counts.max() < least:
        return None
    start_frames = setup.labelling.start_frames
    many = max(start_frames, len(counts) // FRAMES_PER_START_FRAME)
    full = np.sort(counts)[-min(many, len(counts))]
    rows = np.flatnonzero(counts >= max(full, least))
    tried = min(start_frames, len(rows))
    spread = np.linspace(0, len(rows) - 1, tried).astype(int)
    best: FrameFit | None = None
    for effort in (QUICK_SEARCH, THOROUGH_SEARCH):
        for frame in np.unique(rows[spread]):
            fit = find_in_frame(cloud, target, int(frame), setup, effort)
            if fit is not None and (best is None or fit.score < best.score):
                best = fit
            if best is not None and is_good_fit(best):
                return best
    return best


def find_in_frame(
    cloud: Cloud,
    target: TrackTarget,
    frame: int,
    setup: TrackSetup,
    effort: SearchEffort,
) -> FrameFit | None:
    """Find the target in one frame, without knowing anything."""
    points = cloud.at[cloud.start[frame] : cloud.start[frame + 1]]
    effort = effort._replace(postures=min(effort.postures, len(target.starts)))
    fits = search_frame(points, target, frame, setup, effort)
    return fits[0] if fits else None


def track_take(cloud: Cloud, found: FrameFit, setup: TrackSetup) -> TrackResult:
    """Track a target from where it was found to both ends of the take.

    What was tracked is then repaired and reviewed, where the settings ask for it.
    """
    target = found.target
    tracker = make_tracker(target, setup)
    result = empty_result(cloud.frames, len(target.sigma), len(target.mean))
    after, before = path_links(cloud, setup.labelling, setup.rate)
    forwards = FrameSequence(cloud.at, cloud.start, before)
    backwards = FrameSequence(cloud.at, cloud.start, after)
    for direction in (
        Direction(forwards, cloud.frames, 1),
        Direction(backwards, -1, -1),
    ):
        _track_direction(cloud, direction, found, setup, tracker, result)
    if not result.tracked.any():
        return result
    if setup.labelling.repair:
        repair((forwards, backwards), target, tracker, setup, result)
    if setup.labelling.review:
        _review(cloud, forwards, backwards, tracker, result)
    return result


def _track_direction(
    cloud: Cloud,
    direction: Direction,
    found: FrameFit,
    setup: TrackSetup,
    tracker: Tracker,
    result: TrackResult,
) -> None:
    """Track a target from where it was found to one end of the take.

    Where it is lost it is looked for in the frames that follow, with growing steps.
    Where it was not found well, and nothing could be tracked from there, it is looked
    for in few more frames (`UNFOUND_STRIDE_FACTOR`).
    """
    target, stop, by = found.target, direction.stop, direction.by
    longest_stride = max(int(setup.rules.lost_after), 1)
    here: FrameFit | None = found
    frame, stride = found.frame, 1
    while frame != stop:
        if here is not None:
            lost = _track_until_lost(direction, here, frame, setup, tracker, result)
            frame = lost if lost != frame else frame + by
            here = None
            if frame == stop:
                break
        points = cloud.start[frame + 1] - cloud.start[frame]
        if points >= fewest_points(target):
            here = find_in_frame(cloud, target, frame, setup, THOROUGH_SEARCH)
        if here is not None and not is_good_fit(here):
            here = None
        if here is not None:
            stride = 1
            continue
        if is_good_fit(found) or result.tracked.any():
            stride = min(stride + 1, longest_stride)
        else:
            stride = UNFOUND_STRIDE_FACTOR * stride
        frame = min(frame + stride, stop) if by > 0 else max(frame - stride, -1)


def _track_until_lost(
    direction: Direction,
    found: FrameFit,
    first: int,
    setup: TrackSetup,
    tracker: Tracker,
    result: TrackResult,
) -> int:
    """Track a target from one find until it is lost; return where."""
    target = found.target
    state = new_state(len(target.sigma), len(target.mean))
    state.pose[:] = found.pose
    stats = start_stats(target, setup.rules, (found.chosen < 0).astype(np.int64))
    sequence, stop, by = direction
    return int(track_frames(sequence, first, stop, by, state, stats, tracker, result))


def _review(
    cloud: Cloud,
    forwards: FrameSequence,
    backwards: FrameSequence,
    tracker: Tracker,
    result: TrackResult,
) -> None:
    """Judge the points' paths as wholes, if paths tell anything in this take."""
    after = backwards.previous
    paths = paths_of(cloud, after, forwards.previous, result)
    rows = np.flatnonzero((after >= 0) & (paths.name >= 0))
    if len(rows) == 0:
        return
    if np.mean(paths.name[after[rows]] == paths.name[rows]) < MIN_NAME_AGREEMENT:
        return
    places, squares = measured(forwards, tracker, result)
    tracker = tracker._replace(variance=usual_variance(squares, tracker))
    state = new_state(result.chosen.shape[1], len(tracker.mean))
    scene = Scene(paths, forwards, state, tracker, result, places)
    for _ in range(MAX_REVIEWS):
        if review(scene, squares) == 0:
            break
        refit(scene)
        measure(forwards, tracker, result, places, squares)
