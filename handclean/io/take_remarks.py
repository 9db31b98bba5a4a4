"""What is odd about the samples of a take, whatever file they are from.

Nothing is changed; these are remarks for ``inspect``.
"""

from collections.abc import Iterator

import numpy as np

from handclean.arrays import Floats, Ints, runs
from handclean.io.shared.adult_size import size_of
from handclean.io.shared.reading import finite
from handclean.recording import Points, Recording, Trajectories
from handclean.remarks import Remark, length_in_words, listed, remark

FROZEN_S, FROZEN_FRAMES = 0.25, 10
"""[s], frames: what does not change its last digit for so long stands still
(chosen)."""

MOVE_M = 0.005
"""[m] by which the other markers, in the middle, move meanwhile for that to be odd
(chosen)."""

STILL_SHARE = 0.5
"""Share of points that stay where they were, to the last digit, in a still take
(chosen)."""

ODD_SIZE_RATIOS = 0.5, 2.0
"""Sizes against an adult's; beyond them a unit is wrong more likely than a person
(chosen)."""

SPOT_M = 0.02
"""[m] four points or more that never span more are no hand's (chosen)."""

MEASURED_FRAMES = 200
"""Frames that are measured, evenly through the take (chosen)."""

FAR_FROM_MIDDLE_M = 100.0
"""[m] farther from the middle of all points than cameras see (chosen)."""

_NAMED_MARKERS = 8
"""Markers that a remark names (chosen)."""


def remarks_on_samples(take: Recording) -> list[Remark]:
    """Remark on what is odd about the samples of a take: missing, far away, frozen."""
    remarks: list[Remark] = []
    seen = 0
    empty = np.ones(take.frames, dtype=bool)
    columns = take.markers is not None and bool(take.markers.labels)
    if take.markers is not None:
        there = finite(take.markers.positions)
        seen += int(there.sum())
        empty &= ~there.any(axis=1)
        counts = there.sum(axis=0).tolist()
        named = zip(take.markers.labels, counts, strict=True)
        if never := [label for label, count in named if not count]:
            remarks.append(
                remark(
                    "unseen",
                    f"never there: {listed(never, _NAMED_MARKERS)}",
                    markers=never,
                )
            )
    if take.unlabelled is not None:
        columns = True
        here = finite(take.unlabelled.positions)
        seen += int(here.sum())
        empty[take.unlabelled.frame[here]] = False
    if not columns:
        return []
    if not seen:
        text = "not a single point is there: all samples are missing"
        return [remark("unseen", text)]
    remarks += _far(take) or wrong_size(take)
    least = max(FROZEN_FRAMES, int(np.ceil(FROZEN_S * take.rate)))
    if blind := [(start, stop) for start, stop in runs(empty) if stop - start >= least]:
        frames = sum(stop - start for start, stop in blind)
        first = take.numbering.of(blind[0][0])
        remarks.append(
            remark(
                "unseen",
                f"not a point is there in {frames} frames, from frame {first} on",
                count=frames,
            )
        )
    if take.markers is not None:
        remarks += _frozen(take.markers, least)
    if take.unlabelled is not None:
        remarks += _frozen_points(take.unlabelled, take.frames, least)
    return remarks


def wrong_size(take: Recording) -> list[Remark]:
    """Remark that a take is not as large as its names or any room let expect.

    Named markers are measured against an adult's, else all points of a frame together.
    """
    if not take.frames:
        return []
    frames = np.unique(
        np.linspace(0, take.frames - 1, MEASURED_FRAMES).astype(np.int64)
    )
    if take.markers is not None:
        found = size_of(take.markers.labels, take.markers.positions[frames])
        if not ODD_SIZE_RATIOS[0] <= found.ratio <= ODD_SIZE_RATIOS[1] and np.isfinite(
            found.ratio
        ):
            adult = length_in_words(found.length / found.ratio)
            text = (
                f"{found.words} is {length_in_words(found.length)}, an adult's is "
                f"about {adult}: is the unit right? (--unit)"
            )
            return [remark("unit", text, ratio=found.ratio)]
    spans = [_span(points) for points in _of_frames(take, frames) if len(points) > 3]
    span = float(np.median(spans)) if spans else 0.0
    if span == 0.0 or SPOT_M <= span <= FAR_FROM_MIDDLE_M:
        return []
    span_m = length_in_words(span)
    text = f"the points of a frame span {span_m}: is the unit right? (--unit)"
    return [remark("unit", text, span_m=span)]


def _of_frames(take: Recording, frames: Ints) -> Iterator[Floats]:
    """Yield the points (P, 3) [m] of some frames, named and nameless."""
    if take.unlabelled is not None:
        starts = np.searchsorted(take.unlabelled.frame, [frames, frames + 1])
    for n, frame in enumerate(frames.tolist()):
        parts = [np.zeros((0, 3))]
        if take.markers is not None:
            parts.append(take.markers.positions[frame])
        if take.unlabelled is not None:
            parts.append(take.unlabelled.positions[slice(*starts[:, n])])
        points = np.concatenate(parts)
        yield points[finite(points)]


def _span(points: Floats) -> float:
    """[m] the longest side of the box around points."""
    return float(np.ptp(points, axis=0).max())


def _far(take: Recording) -> list[Remark]:
    """Points where no camera sees; a wrong unit makes such, too."""
    markers, points = take.markers, take.unlabelled
    parts = [np.zeros((0, 3))]
    if markers is not None:
        parts.append(markers.positions.reshape(-1, 3))
    if points is not None:
        parts.append(points.positions)
    middle = np.nanmedian(np.concatenate(parts), axis=0)
    names: list[str] = []
    away = np.zeros(0)
    with np.errstate(over="ignore", invalid="ignore"):
        if markers is not None:
            far = np.linalg.norm(markers.positions - middle, axis=2)
            hit = (far > FAR_FROM_MIDDLE_M).any(axis=0).tolist()
            names += [
                x for x, is_hit in zip(markers.labels, hit, strict=True) if is_hit
            ]
            away = far[far > FAR_FROM_MIDDLE_M]
        if points is not None:
            far = np.linalg.norm(points.positions - middle, axis=1)
            if np.any(far > FAR_FROM_MIDDLE_M):
                names.append("points without a name")
            away = np.concatenate([away, far[far > FAR_FROM_MIDDLE_M]])
    if not len(away):
        return []
    text = (
        f"{len(away)} samples lie more than {FAR_FROM_MIDDLE_M:g} m, up to "
        f"{away.max():.3g} m, from the middle of all "
        f"({listed(names, _NAMED_MARKERS)}): is the unit right?"
    )
    return [remark("implausible", text, markers=names, samples=len(away))]


def _frozen(markers: Trajectories, least: int) -> list[Remark]:
    """Markers whose places are the same to the last digit while others move."""
    frames, names = 0, []
    at = markers.positions
    same = (at[1:] == at[:-1]).all(axis=2)
    for column, label in enumerate(markers.labels):
        if np.count_nonzero(same[:, column]) < least - 1:
            continue
        held = [(a, b + 1) for a, b in runs(same[:, column]) if b + 1 - a >= least]
        found = sum(b - a for a, b in held if _moves(at, column, a, b))
        if found:
            frames += found
            names.append(label)
    if not names:
        return []
    text = (
        f"{listed(names, _NAMED_MARKERS)}: the same to the last digit for {frames} "
        "frames in which others move; held, not measured?"
    )
    return [remark("implausible", text, markers=names, count=frames)]


def _moves(positions: Floats, column: int, start: int, stop: int) -> bool:
    """Whether the other markers move in some frames, in the middle."""
    others = np.delete(positions[start:stop], column, axis=1)
    others = others[:, finite(others).sum(axis=0) > 1]
    if not others.shape[1]:
        return False
    span = np.nanmax(others, axis=0) - np.nanmin(others, axis=0)
    return bool(np.median(np.linalg.norm(span, axis=1)) > MOVE_M)


def _frozen_points(points: Points, frames: int, least: int) -> list[Remark]:
    """Points without a name that stay in one place while most do not."""
    if not len(points.frame):
        return []
    order = np.lexsort(points.positions.T)  # stable: equal places in order of frames
    at, frame = points.positions[order], points.frame[order].astype(np.int64)
    again = np.zeros(len(at), dtype=bool)
    again[1:] = (at[1:] == at[:-1]).all(axis=1) & (np.diff(frame) == 1)
    everywhere = np.bincount(frame, minlength=frames)
    staying = np.bincount(frame[again], minlength=frames)
    share = staying / np.maximum(everywhere, 1)
    count, held = 0, 0
    for start, stop in runs(again):
        rows: Ints = frame[start - 1 : stop]
        if len(rows) >= least and np.median(share[rows[1:]]) < STILL_SHARE:
            count += 1
            held += len(rows)
    if not count:
        return []
    what = (
        "a point without a name stays" if count == 1 else f"{count} times a point stays"
    )
    text = (
        f"{what} the same to the last digit, for {held} frames in all, while most do "
        "not; held, not measured?"
    )
    return [remark("implausible", text, points=count)]
