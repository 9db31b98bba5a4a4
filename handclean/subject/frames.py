"""Which frames a calibration learns from, and which it is measured on.

Only measured samples count: whatever stands where nothing was measured is never
looked at. Frames are kept aside in blocks of time, so that no frame the hand was
learnt from has its neighbours among those it is judged by. Frames to learn from are
spread by choosing, again and again, the one whose marker configuration (without the
root's motion) is farthest from all chosen ones (Gonzalez 1985); when the farthest is
nearer than what counts as new, the rest teaches nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.errors import TAKE, HandcleanError, TakeNumber, UnknownNameError
from handclean.recording import Numbering, Recording

LEAST_FRAMES = 10
"""Fewer frames with enough markers are no range-of-motion take (chosen)."""

LEAST_MARKER_SHARE = 0.6
"""Share of a set's markers a frame needs to be of use (chosen)."""

_FOURTH_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class Frames:
    """The measured samples of one or several takes, of one marker set.

    Attributes
    ----------
    targets : (T, M, 3) [m], 0 where nothing was measured.
    seen : (T, M) what was measured.
    take : (T,) which take a frame is from; frame : (T,) its row there, from 0.
    rates : [Hz] of each take; numberings : how its source numbers its frames;
        names : what remarks call the takes; "take 1", "take 2" where there are none.
    """

    targets: Floats
    seen: Bools
    take: Ints
    frame: Ints
    rates: tuple[float, ...]
    numberings: tuple[Numbering, ...]
    names: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.take)

    def called(self, take: int) -> str:
        """Return what remarks call a take."""
        return self.names[take] if self.names else f"take {take + 1}"

    def only(self, rows: Ints | Bools) -> "Frames":
        """Return some of the frames, in their order."""
        return Frames(
            targets=self.targets[rows],
            seen=self.seen[rows],
            take=self.take[rows],
            frame=self.frame[rows],
            rates=self.rates,
            numberings=self.numberings,
            names=self.names,
        )


def gather(
    takes: Sequence[Recording], labels: Sequence[str], names: Sequence[str] = ()
) -> Frames:
    """Collect what was measured of the markers of a hand.

    Parameters
    ----------
    names : what remarks call the takes.

    Raises
    ------
    UnknownNameError
        If a take lacks one of the markers.
    HandcleanError
        If there is no take, or one without labelled markers.
    """
    if not takes:
        raise HandcleanError("calibrate-hand: no take; give at least one labelled take")
    targets, seen, take, frame = [], [], [], []
    for number, recording in enumerate(takes):
        where = TAKE if len(takes) == 1 else TakeNumber(number)
        if recording.markers is None:
            raise HandcleanError("no labelled markers; label it first", where=where)
        for label in labels:
            if label not in recording.markers.labels:
                known = recording.markers.labels
                raise UnknownNameError(where, "marker", label, known)
        columns = [recording.markers.index(label) for label in labels]
        there = recording.markers.measured[:, columns]
        place = recording.markers.positions[:, columns]
        there = there & np.isfinite(place).all(axis=2)
        targets.append(np.where(there[:, :, None], place, 0.0))
        seen.append(there)
        take.append(np.full(len(there), number, dtype=np.int64))
        frame.append(np.arange(len(there), dtype=np.int64))
    return Frames(
        targets=np.concatenate(targets),
        seen=np.concatenate(seen),
        take=np.concatenate(take),
        frame=np.concatenate(frame),
        rates=tuple(recording.rate for recording in takes),
        numberings=tuple(recording.numbering for recording in takes),
        names=tuple(names),
    )


def usable(frames: Frames) -> Frames:
    """Return the frames with enough measured markers to learn from.

    Raises
    ------
    HandcleanError
        If there are too few.
    """
    markers = frames.seen.shape[1]
    least = max(ceil(LEAST_MARKER_SHARE * markers), min(4, markers))
    enough = frames.only(frames.seen.sum(axis=1) >= least)
    if len(enough) < LEAST_FRAMES:
        raise HandcleanError(
            f"calibrate-hand: {len(enough)} of {len(frames)} frames hold {least} or "
            f"more of the {markers} markers; {LEAST_FRAMES} or more are needed"
        )
    return enough


def kept_aside(frames: Frames, share: float, block_s: float) -> Bools:
    """(T,) which frames to judge by: every so many blocks of time, one.

    Blocks shorten until there are twice as many as needed to keep one aside; a take
    begins a new block.
    """
    out = np.zeros(len(frames), dtype=bool)
    if share <= 0.0:
        return out
    every = max(round(1.0 / share), 2)
    longest = max(ceil(len(frames) / (2 * every)), 1)
    number = 0
    for take, rate in enumerate(frames.rates):
        rows = np.flatnonzero(frames.take == take)
        count = ceil(len(rows) / min(max(round(block_s * rate), 1), longest))
        for block in np.array_split(rows, max(count, 1)):
            out[block] = number % every == every // 2
            number += 1
    return out


def thinned(frames: Frames, count: int) -> Ints:
    """Up to ``count`` rows, evenly through the frames."""
    if len(frames) <= count:
        return np.arange(len(frames))
    return np.linspace(0, len(frames) - 1, count).round().astype(np.int64)


def farthest(points: Floats, count: int, novel: float) -> tuple[Ints, float]:
    """Choose points far from each other.

    Parameters
    ----------
    points : (T, N)
    count : how many at most; novel : nearest distance that still counts as new.

    Returns
    -------
    Rows of the chosen points, ascending, and how far the farthest other is from them.
    """
    first = int(np.argmax(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))
    chosen, nearest = [first], np.full(len(points), np.inf)
    while True:
        step = np.sqrt(np.sum((points - points[chosen[-1]]) ** 2, axis=1))
        nearest = np.minimum(nearest, step)
        row = int(np.argmax(nearest))
        if len(chosen) >= count or nearest[row] <= novel:
            return np.array(sorted(chosen), dtype=np.int64), float(nearest[row])
        chosen.append(row)


def camera_noise(frames: Frames) -> float:
    """[m] noise of a marker, each way, that changes from frame to frame.

    From the median fourth difference of neighbouring samples, which smooth motion
    leaves alone; 0 if nowhere five frames follow each other.
    """
    found = []
    for take in range(len(frames.rates)):
        rows = np.flatnonzero(frames.take == take)
        breaks = np.flatnonzero(np.diff(frames.frame[rows]) != 1) + 1
        edges = [0, *breaks.tolist(), len(rows)]
        for start, stop in pairwise(edges):
            run = rows[start:stop]
            if len(run) < len(_FOURTH_DIFFERENCE):
                continue
            last = len(run) - len(_FOURTH_DIFFERENCE) + 1
            windows = [run[k : k + last] for k in range(len(_FOURTH_DIFFERENCE))]
            there = np.all([frames.seen[window] for window in windows], axis=0)
            change = sum(
                weight * frames.targets[window]
                for weight, window in zip(_FOURTH_DIFFERENCE, windows, strict=True)
            )
            found.append(np.abs(np.asarray(change)[there]).ravel())
    every = np.concatenate(found) if found else np.zeros(0)
    if len(every) == 0:
        return 0.0
    return float(np.median(every) / 0.67449 / np.sqrt(np.sum(_FOURTH_DIFFERENCE**2)))
