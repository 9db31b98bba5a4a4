"""A C3D file read twice: by handclean's codec and by the ``c3d`` package.

Both are asked what is stored, before anything is decided about it: points at (0, 0, 0)
are there, lengths stay in the file's unit. Frames are compared in the order in which
they are stored, and named by their numbers as handclean counts them.

Numbers are equal when they differ by no more than a few steps of a 32-bit float, since
the package keeps places and residuals as such. Residuals and cameras are compared where
both say that a point is there.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Bools
from handclean.io.c3d.analog import read_analog
from handclean.io.c3d.events import events_as_stored
from handclean.io.c3d.read import stated_rate
from handclean.io.c3d.samples import Coding, Samples, Tally, decode, new_samples
from handclean.io.c3d.scale import settle_scale
from handclean.io.c3d.structure import Structure, open_c3d
from handclean.io.c3d.verdict import Part, Verdict
from handclean.io.c3d.witness import UnreadError, Witness, read_witness
from handclean.recording import Analog

_EQUAL_SHARE = 4.0 * float(np.finfo(np.float32).eps)
"""[-] share by which equal numbers may differ: 4 steps of 32-bit floats, as both round
a product of two such."""

_ZERO_BELOW = 1e-37
"""Smaller numbers are 0 to one of the two: subnormal floats, and those of a DEC (the
smallest normal float is 1.2e-38)."""

_BLOCK_SAMPLES = 2**16
"""Samples that are compared at once (chosen; memory)."""

_LISTED_RUNS = 10
"""Runs of frames that are listed (chosen)."""

_MISSING_RESIDUAL = -1.0
"""The package's residual of a missing point."""


def verify_c3d(path: Path) -> Verdict:
    """Compare what handclean and the ``c3d`` package read in a file.

    Raises
    ------
    FileError
        If handclean cannot read it.
    """
    structure = open_c3d(path, lenient=True, needs_points=False)
    try:
        witness = read_witness(path, structure.layout.held)
    except UnreadError as error:
        return Verdict(unread=str(error))
    analog = read_analog(structure, 1.0)
    return Verdict(
        parts=(
            *_counts(structure, witness),
            *_points(structure, witness),
            *_analog(structure, analog, witness),
            *_events(structure, witness),
        )
    )


def _counts(structure: Structure, witness: Witness) -> list[Part]:
    layout = structure.layout
    points = witness.points.shape[1] if len(witness.points) else layout.points
    return [
        _single("rate", stated_rate(structure), witness.rate, "Hz"),
        _single("frames", layout.held, witness.frames),
        _single("first frame", layout.first_frame, witness.first_frame),
        _single("points per frame", layout.points, points),
        _texts("labels", structure.head.labels(layout.points), witness.labels),
    ]


def _single(name: str, ours: float, theirs: float, unit: str = "") -> Part:
    same = bool(_equal(np.array(ours), np.array(theirs)))
    if same:
        return Part(name=name, compared=1)
    return Part(
        name=name, compared=1, differing=1, unit=unit, ours=_plain(ours),
        theirs=_plain(theirs),
    )  # fmt: skip


def _plain(value: float) -> float | str:
    """JSON holds no NaN and no infinity."""
    return value if np.isfinite(value) else str(value)


def _texts(name: str, ours: Sequence[str], theirs: Sequence[str] | None) -> Part:
    """Compare labels one by one; those that the package does not give are blank."""
    given = list(theirs or [])[: len(ours)]
    given += [""] * (len(ours) - len(given))
    differing = sum(a.strip() != b for a, b in zip(ours, given, strict=True))
    return Part(name=name, compared=len(ours), differing=differing)


def _points(structure: Structure, witness: Witness) -> list[Part]:
    count = min(structure.layout.held, len(witness.points))
    if not structure.points or witness.points.shape[1] != structure.points:
        return []
    unit = structure.head.unit or "mm"
    missing = _Differences("missing samples", counted=True)
    places, residuals = _Differences("points", unit), _Differences("residuals", unit)
    cameras = _Differences("cameras")
    coding, _ = settle_scale(structure, 1.0)
    for rows in _blocks(count, structure.points):
        samples, here = _decoded(structure, coding, rows)
        theirs = witness.points[rows]
        there = theirs[..., 3] != _MISSING_RESIDUAL
        missing.add(here, there, np.arange(rows.start, rows.stop))
        both = here & there
        frames = np.nonzero(both)[0] + rows.start
        places.add(samples.positions[both], theirs[..., :3][both], frames)
        residuals.add(samples.residual[both], theirs[..., 3][both], frames)
        cameras.add(samples.cameras[both], theirs[..., 4][both], frames)
    first = structure.layout.first_frame
    return [part.part(first) for part in (missing, places, residuals, cameras)]


def _blocks(frames: int, width: int) -> Iterator[slice]:
    """Go through frames, so many at a time that their samples are few."""
    step = max(_BLOCK_SAMPLES // max(width, 1), 1)
    for begin in range(0, frames, step):
        yield slice(begin, min(begin + step, frames))


def _decoded(
    structure: Structure, coding: Coding, rows: slice
) -> tuple[Samples, Bools]:
    """Return all points of some frames in the file's unit, and which are there."""
    words = structure.frames[rows, : 4 * structure.points]
    samples = new_samples(len(words), structure.points)
    with np.errstate(all="ignore"):
        here = decode(
            coding.numbers(words.reshape(-1, structure.points, 4)),
            coding,
            samples,
            Tally(),
            np.arange(structure.points),
            zeros_are_missing=False,
        )
    return samples, here


def _analog(
    structure: Structure, analog: Analog | None, witness: Witness
) -> list[Part]:
    """Compare analog channels, which were read with one frame per second."""
    per_second = 0.0 if analog is None else analog.rate * stated_rate(structure)
    found = [_single("analog rate", per_second, witness.analog_rate, "Hz")]
    if analog is None:
        return found
    found.append(_texts("analog labels", analog.labels, witness.analog_labels))
    frames = structure.layout.held
    ours = analog.values.reshape(frames, -1)
    if witness.analog.shape[1] != ours.shape[1]:
        words, theirs = ours.shape[1], witness.analog.shape[1]
        return [*found, _single("analog values per frame", words, theirs)]
    values = _Differences("analog values")
    for rows in _blocks(min(frames, len(witness.analog)), ours.shape[1]):
        numbers = np.arange(rows.start, rows.stop)
        values.add(ours[rows], witness.analog[rows], numbers)
    return [*found, values.part(structure.layout.first_frame)]


class _Differences:
    """Counts how values of one part differ, a block of frames at a time."""

    def __init__(self, name: str, unit: str = "", *, counted: bool = False) -> None:
        self._name, self._unit, self._counted = name, unit, counted
        self._compared = self._differing = 0
        self._largest = 0.0
        self._frames: list[NDArray[np.intp]] = []

    def add(
        self, ours: NDArray[Any], theirs: NDArray[Any], frames: NDArray[np.intp]
    ) -> None:
        """Compare (N, ...) values, of N frames counted from 0."""
        differs = ~_equal(ours, theirs)
        self._compared += differs.size
        if not differs.any():
            return
        self._differing += int(np.count_nonzero(differs))
        with np.errstate(all="ignore"):
            apart = np.abs(ours[differs].astype(float) - theirs[differs].astype(float))
        self._largest = max(
            self._largest, float(apart[np.isfinite(apart)].max(initial=0.0))
        )
        rows = differs.reshape(len(differs), -1).any(axis=1)
        self._frames.append(np.unique(frames[rows]))

    def part(self, first: int) -> Part:
        """Return what was counted; frames get their numbers."""
        return Part(
            name=self._name,
            compared=self._compared,
            differing=self._differing,
            largest=None if self._counted or not self._differing else self._largest,
            unit=self._unit if self._differing else "",
            frames=_runs(self._frames, first),
        )


def _equal(ours: NDArray[Any], theirs: NDArray[Any]) -> Bools:
    with np.errstate(all="ignore"):
        one, other = ours.astype(float), theirs.astype(float)
        room = _EQUAL_SHARE * np.maximum(np.abs(one), np.abs(other)) + _ZERO_BELOW
        same: Bools = np.abs(one - other) <= room
    same |= (one == other) | (np.isnan(one) & np.isnan(other))
    return same


def _runs(
    frames: Sequence[NDArray[np.intp]], first: int
) -> tuple[tuple[int, int], ...]:
    """First and last number of the first runs of frames."""
    if not frames:
        return ()
    used = np.unique(np.concatenate(frames))
    parts = np.split(used, np.flatnonzero(np.diff(used) > 1) + 1)[:_LISTED_RUNS]
    return tuple((int(part[0]) + first, int(part[-1]) + first) for part in parts)


def _events(structure: Structure, witness: Witness) -> list[Part]:
    header, group = events_as_stored(structure.head)
    return [
        _same_events("header events", header, witness.header_events),
        _same_events("events of the EVENT group", group, witness.group_events),
    ]


def _same_events(
    name: str, ours: Sequence[tuple[float, str]], theirs: Sequence[tuple[float, str]]
) -> Part:
    known = [event for event in theirs if np.isfinite(event[0])]
    differing = abs(len(ours) - len(known))
    for (time, label), (other, called) in zip(ours, known, strict=False):
        same = bool(_equal(np.array(time), np.array(other))) and label.strip() == called
        differing += not same
    return Part(name=name, compared=max(len(ours), len(known)), differing=differing)
