"""The paths of points through a take, and the names that their points have."""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.labels.points import Cloud
from handclean.labels.track.state import ABSENT, FOLLOWED, RETURNED, TrackResult

SAMPLES = 6
"""Frames of a path that are looked at (chosen)."""


class Glance(NamedTuple):
    """Some points of a path, spread over its life: rows and frames, both (n,)."""

    rows: Ints
    frames: Ints


class Paths(NamedTuple):
    """N paths through P points.

    length (N,) how many points; samples (N, SAMPLES) rows spread over the life of each,
    in short ones the last again and again; after, before (P,) row of the next, the last
    point, -1 none; number (P,) of the path, frame (P,); name (P,) marker, -1 none;
    changed (T,) frames in which points got another name.
    """

    length: Ints
    samples: Ints
    after: Ints
    before: Ints
    number: Ints
    frame: Ints
    name: Ints
    changed: Bools

    def glance(self, n: int) -> Glance:
        """Return some points of path n."""
        rows = self.samples[n, : min(SAMPLES, self.length[n])]
        return Glance(rows, self.frame[rows])


def paths_of(cloud: Cloud, after: Ints, before: Ints, result: TrackResult) -> Paths:
    """Collect the paths, and the names that a result gives their points."""
    first = np.flatnonzero(before < 0)
    length = np.zeros(len(first), dtype=np.int64)
    number = np.full(len(after), -1)
    samples = np.zeros((len(first), SAMPLES), dtype=np.int64)
    _walk(first, after, number, length, samples)
    name = np.full(len(after), -1)
    frames, markers = np.nonzero(result.chosen >= 0)
    name[result.chosen[frames, markers]] = markers
    return Paths(
        length=length,
        samples=samples,
        after=after,
        before=before,
        number=number,
        frame=cloud.frame.astype(np.int64),
        name=name,
        changed=np.zeros(cloud.frames, dtype=bool),
    )


@jit
def _walk(first: Ints, after: Ints, number: Ints, length: Ints, samples: Ints) -> None:
    """Write which path each point is on, how long each is, and its samples."""
    for n in range(first.shape[0]):
        row, count = first[n], 0
        while row >= 0:
            number[row] = n
            row = after[row]
            count += 1
        length[n] = count
        row, k = first[n], 0
        size = min(samples.shape[1], count)
        for i in range(count):
            while k < size and i == (k * (count - 1)) // max(size - 1, 1):
                samples[n, k:] = row
                k += 1
            row = after[row]


def own_names(paths: Paths, markers: int) -> tuple[Ints, Ints]:
    """(N,) the name that most points of each path have, -1 none; and how many do."""
    size = len(paths.length)
    has = np.flatnonzero(paths.name >= 0)
    where = paths.number[has] * markers + paths.name[has]
    votes = np.bincount(where, minlength=size * markers).reshape(size, markers)
    best = votes.argmax(axis=1)
    most = votes[np.arange(size), best]
    return np.where(most > 0, best, -1), most


def own_name(n: int, paths: Paths, markers: int) -> tuple[int, int]:
    """Return the name that most points of a path have, -1 none; and how many do."""
    names = paths.name[_rows(int(paths.samples[n, 0]), paths)]
    votes = np.bincount(names[names >= 0], minlength=markers)
    best = int(votes.argmax())
    return (best, int(votes[best])) if votes[best] > 0 else (-1, 0)


def _rows(row: int, paths: Paths) -> Ints:
    """Rows of a path from one on."""
    out = []
    while row >= 0:
        out.append(row)
        row = int(paths.after[row])
    return np.array(out)


def rename(first: int, name: int, paths: Paths, result: TrackResult) -> None:
    """Give all points of a path from one on a name, where no other point has it."""
    rows = _rows(first, paths)
    t, old = paths.frame[rows], paths.name[rows]
    go = (old != name) & result.tracked[t]
    if name >= 0:
        go &= result.chosen[t, name] < 0
    lose = go & (old >= 0)
    result.chosen[t[lose], old[lose]] = -1
    result.outcome[t[lose], old[lose]] = ABSENT
    result.confidence[t[lose], old[lose]] = 0.0
    if name >= 0:
        result.chosen[t[go], name] = rows[go]
        result.outcome[t[go], name] = FOLLOWED
        if go[0]:
            result.outcome[t[0], name] = RETURNED
        result.confidence[t[go], name] = 0.9
    paths.name[rows[go]] = name
    paths.changed[t[go]] = True


def begin(row: int, paths: Paths) -> int:
    """Return the first point of the part of a path that has the same name."""
    name = paths.name[row]
    while paths.before[row] >= 0 and paths.name[paths.before[row]] == name:
        row = int(paths.before[row])
    return row


def apart(a: Floats, b: Floats) -> Floats:
    """[m] distances of places (..., 3)."""
    away = a - b
    found: Floats = np.sqrt(np.einsum("...n,...n->...", away, away))
    return found
