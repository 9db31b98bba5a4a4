"""After tracking: paths of points that are in doubt are judged as wholes.

Frame by frame a ghost beside a hidden marker can stay below the threshold, and a marker
that comes back far from where its finger was frozen can stay above it. Over the life of
a path both show: with a ghost the finger never fits as it usually does; with the right
marker it does in every frame. So such a path is tried, in a few frames spread over its
life, as what it is called now, as nothing, and as each marker that is hidden meanwhile
and near; the alternative that is worth most, by a margin, stands. To what the fit is
worth (`fit_cost`) comes how far the finger must have jumped, at the path's beginning,
from where it was last seen.

Most paths need no trial (`in_doubt`): all their points have the same name, their finger
fits as well as it does in the rest of the take, and no marker that could be meant
instead is hidden beside it all the while, or the finger went on from where it was.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.labels.review.paths import (
    Glance,
    Paths,
    apart,
    begin,
    own_name,
    own_names,
    rename,
)
from handclean.labels.review.suppose import Renaming, judge_path, jump
from handclean.labels.track.fit import MISSING_COST
from handclean.labels.track.state import FrameSequence, FrameState, TrackResult
from handclean.labels.track.tracker import Tracker

SHORTEST = 3
"""Frames that a path of no marker must last to be given a name (chosen)."""

MARGIN = 2.0
"""By how much, in `fit_cost`, another name must be better (chosen)."""

WELL = 6.0
"""A name fits well if the path is worth so much more with it than without (chosen)."""

NEAR, TOUCHING = 0.08, 0.035
"""[m] how far a hidden marker may be from a path that could be its; the same where the
path fits another name well, and between markers that may have changed places
(chosen)."""

RIVALS = 3
"""How many hidden markers a path is tried as (chosen)."""

TROUBLE = 2.0
"""By how much, in `fit_cost`, a finger fits worse than usual to be doubted (chosen)."""

BROKEN = 20
"""Frames that a take's paths last on average below which every finger that fits worse
than usual is doubted: the tracker was then led by the pose alone (chosen)."""

SMOOTH = 1.0
"""Cost of a finger's jump below which it went on from where it was (chosen)."""


class Scene(NamedTuple):
    """What a path is judged by.

    places : (T, M, 3) [m] where the poses put the markers.
    """

    paths: Paths
    sequence: FrameSequence
    state: FrameState
    tracker: Tracker
    result: TrackResult
    places: Floats

    def judge(
        self,
        seen: Glance,
        name: int,
        other: int = -1,
        *,
        bent: bool = False,
        enough: float = 1e6,
        write: bool = False,
    ) -> tuple[float, float]:
        """Return what a path is worth under a name, and the jumps: see `judge_path`."""
        return judge_path(
            seen, Renaming(name, other, bent), enough, write,
            self.sequence, self.state, self.tracker, self.result,
        )  # fmt: skip

    def alike(self, own: int) -> Bools:
        """(M,) markers on other fingers that are as far out."""
        branch, rank = self.tracker.branch, self.tracker.rank
        both = (branch > 0) & (branch[own] > 0)
        found: Bools = both & (branch != branch[own]) & (rank == rank[own])
        return found


def fingers(squares: Floats, tracker: Tracker) -> Floats:
    """(T, B) by how much each finger's fit is worse than it usually is."""
    cost = np.fmin(np.nan_to_num(squares / tracker.variance), MISSING_COST)
    each = np.zeros((len(cost), int(tracker.branch.max(initial=0)) + 1))
    for branch in range(each.shape[1]):
        each[:, branch] = cost[:, tracker.branch == branch].sum(axis=1)
    known = np.isfinite(squares).any(axis=1)
    return each - np.median(each[known], axis=0) if known.any() else each


def in_doubt(scene: Scene, squares: Floats) -> Ints:
    """Return the paths that need a trial, rising.

    Parameters
    ----------
    squares : (T, M) [m^2] distances of the points from their places, NaN none.
    """
    paths, tracker, result = scene.paths, scene.tracker, scene.result
    own, votes = own_names(paths, len(tracker.branch))
    named = own >= 0
    trouble = fingers(squares, tracker)
    where = tracker.branch[own[paths.number]]
    sums = np.bincount(
        paths.number, trouble[paths.frame, where], minlength=len(paths.length)
    )
    broken = len(paths.number) < BROKEN * len(paths.length)
    bad = named & (sums > (0.0 if broken else TROUBLE) * paths.length)
    rows = paths.samples
    frames = paths.frame[rows]
    hidden: Bools = np.all(result.chosen[frames] < 0, axis=1)
    hidden[named, own[named]] = False
    doubt = bad | (named & (votes < paths.length))
    for n in np.flatnonzero(~doubt & hidden.any(axis=1)):
        some = np.flatnonzero(hidden[n])
        away = apart(
            scene.places[frames[n]][:, some], scene.sequence.at[rows[n]][:, None]
        ).min(axis=0)
        if named[n]:
            touching = scene.alike(own[n])[some] & (away < TOUCHING)
            doubt[n] = touching.any() and _jumped(int(n), int(own[n]), scene)
        else:
            doubt[n] = paths.length[n] >= SHORTEST and (away < NEAR).any()
    for n in np.flatnonzero(~doubt & ~named & (paths.length >= SHORTEST)):
        doubt[n] = len(_displaceable(paths.glance(int(n)), scene)) > 0
    return np.flatnonzero(doubt)


def _jumped(n: int, own: int, scene: Scene) -> bool:
    """Whether a path's finger is not where it was before or will be afterwards."""
    seen, result = scene.paths.glance(n), scene.result
    for at, by in ((0, -1), (-1, 1)):
        t = int(seen.frames[at])
        if jump(t, by, own, result.pose[t], scene.tracker, result) > SMOOTH:
            return True
    return False


def rivals(seen: Glance, own: int, well: bool, scene: Scene) -> list[int]:
    """Return the hidden markers nearest to a path, the nearest first.

    Parameters
    ----------
    own, well : the path's name, -1 none, and whether it fits well. Then only markers
        on other fingers, as far out and very near, are rivals.
    """
    able: Bools = np.all(scene.result.chosen[seen.frames] < 0, axis=0)
    if own >= 0:
        able[own] = False
    if well:
        able &= scene.alike(own)
    some = np.flatnonzero(able)
    here = scene.sequence.at[seen.rows][:, None]
    away = apart(scene.places[seen.frames][:, some], here).min(axis=0)
    order = np.argsort(away, kind="stable")
    most = TOUCHING if well else NEAR
    return [int(some[i]) for i in order[:RIVALS] if away[i] < most]


def review_path(n: int, scene: Scene) -> bool:
    """Judge one path; rename it if it is worth more as something else.

    Returns
    -------
    Whether it was renamed.
    """
    paths, result = scene.paths, scene.result
    own, votes = own_name(n, paths, len(scene.tracker.branch))
    if own < 0 and paths.length[n] < SHORTEST:
        return False
    seen = paths.glance(n)
    nothing = scene.judge(seen, -1)[0]
    name, best, well = -1, math.inf, False
    if own >= 0:
        cost, jumps = scene.judge(seen, own)
        if cost == math.inf:  # the name is another's in some of its frames
            return False
        well = cost < nothing - WELL
        if cost < nothing + MARGIN:
            name, best = own, cost + jumps - MARGIN
    others = rivals(seen, own, well, scene)
    if own >= 0 and others:  # as much trouble for it as for its rivals
        cost, jumps = scene.judge(seen, own, bent=True)
        best = min(best, cost + jumps - MARGIN)
    for m in others:
        enough = min(nothing - MARGIN, best)
        cost, jumps = scene.judge(seen, m, bent=True, enough=enough)
        if cost < enough and cost + jumps < best:
            name, best = m, cost + jumps
    if name < 0 and displace(seen, nothing, scene):
        return True
    if name == own:
        if own < 0:
            return False
        if change_places(seen, own, scene):
            return True
        if votes == paths.length[n]:
            return False
    rename(int(seen.rows[0]), name, paths, result)
    return True


def review(scene: Scene, squares: Floats) -> int:
    """Judge every path in doubt, see `review_path`; return how many were renamed."""
    return sum(review_path(int(n), scene) for n in in_doubt(scene, squares))


def _displaceable(seen: Glance, scene: Scene) -> list[tuple[int, int]]:
    """Pairs of a marker whose name a path could have, and a hidden one near it.

    The first is seen all the while the path is, on another.
    """
    tracker, result, t = scene.tracker, scene.result, int(seen.frames[0])
    places = scene.places[t]
    held = (result.chosen[seen.frames] >= 0).all(axis=0) & (tracker.branch > 0)
    held &= apart(places, scene.sequence.at[seen.rows[0]]) <= NEAR
    hidden = np.flatnonzero(result.chosen[t] < 0)
    pairs = []
    for m in np.flatnonzero(held) if len(hidden) else ():
        there = scene.sequence.at[result.chosen[t, m]]
        near = hidden[apart(places[hidden], there) <= NEAR]
        pairs += [(int(m), int(n)) for n in near]
    return pairs


def displace(seen: Glance, nothing: float, scene: Scene) -> bool:
    """Give a path of no marker another path's name, and that path a hidden marker's.

    Where two fingertips are hidden in turns, the first to come back may have been taken
    for the other; it shows when the other comes back, too.

    Parameters
    ----------
    nothing : what the path is worth as no marker.

    Returns
    -------
    Whether that was better, by the margin, and was done.
    """
    best, name, to = nothing - 2.0 * MARGIN, -1, -1
    for m, n in _displaceable(seen, scene):
        found = scene.judge(seen, m, n, bent=True, enough=best)[0]
        if found < best:
            best, name, to = found, m, n
    if name < 0:
        return False
    there = int(scene.result.chosen[seen.frames[0], name])
    rename(begin(there, scene.paths), to, scene.paths, scene.result)
    rename(int(seen.rows[0]), name, scene.paths, scene.result)
    return True


def change_places(seen: Glance, own: int, scene: Scene) -> bool:
    """Let a path and one on another finger, as far out, change names if that is better.

    Only the frames in which both are seen can tell.

    Returns
    -------
    Whether that was better, by the margin, and was done.
    """
    result, at = scene.result, scene.sequence.at
    best, name, there = 0.5 * MARGIN, -1, -1
    mine = result.tracked[seen.frames] & (result.chosen[seen.frames, own] == seen.rows)
    for m in np.flatnonzero(scene.alike(own)):
        rows = result.chosen[seen.frames, m]
        both = mine & (rows >= 0) & (apart(at[rows], at[seen.rows]) <= TOUCHING)
        if not both.any():
            continue
        some = Glance(seen.rows[both], seen.frames[both])
        now = scene.judge(some, own, int(m), bent=True)[0]
        after = scene.judge(some, int(m), own, bent=True, enough=now)[0]
        if now - after > best:
            best, name, there = now - after, int(m), int(rows[both][-1])
    if name < 0:
        return False
    other = begin(there, scene.paths)
    rename(int(seen.rows[0]), -1, scene.paths, result)
    rename(other, own, scene.paths, result)
    rename(int(seen.rows[0]), name, scene.paths, result)
    return True


def refit(scene: Scene) -> None:
    """Solve the frames whose names changed anew, from the poses they had."""
    changed, result = scene.paths.changed, scene.result
    enough = (result.chosen >= 0).sum(axis=1) >= 4
    frames = np.flatnonzero(changed & enough)
    changed[:] = False
    if len(frames) > 0:
        scene.judge(Glance(np.full(len(frames), -1), frames), -1, write=True)
