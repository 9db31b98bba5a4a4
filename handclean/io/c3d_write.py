"""Writing a recording as C3D, changing no byte that handclean does not own.

From a recording that was read from C3D the file is written as it was: processor,
integers or floats, parameters, events, analog words, model outputs, padding. handclean
owns labels and descriptions, the number of points, where the data begin, and
POINT:SCALE where an integer file must hold a larger coordinate (all points are rescaled
then; analog words have scales of their own). Anything else becomes a file of its own:
Intel floats in mm.

What the fourth word says (residual as a byte of |SCALE|, camera mask above it):

=========  ====================================================================
measured   the source's own four words where the position has not changed; else
           its residual (1 at least, 0 would say "computed") and cameras
filled,    0: residual 0, no cameras
smoothed
missing,   the source's own words where the source has no point either; else
rejected   -1 with zeros for coordinates
=========  ====================================================================
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Bools
from handclean.io.c3d_columns import as_slice
from handclean.io.c3d_numbers import Shorts, Words
from handclean.io.c3d_parameters import BLOCK
from handclean.io.c3d_plan import BLOCK_SAMPLES, Writing, plan_writing
from handclean.io.c3d_samples import (
    MISSING_WORD,
    WORD_OF_ORIGIN,
    fourth_words,
    placed,
    valid,
)
from handclean.recording import Origin, Recording, Trajectories


def encode_c3d(recording: Recording, where: Path | str = "C3D") -> Iterator[bytes]:
    """Yield the bytes of a C3D file, piece by piece.

    Raises
    ------
    FileError
        Before the first piece: if there are no points, or they do not fit the format.
    """
    return _pieces(plan_writing(recording, where))


def _pieces(writing: Writing) -> Iterator[bytes]:
    """Yield the file."""
    yield writing.head
    count = len(writing.columns.columns)
    frames = writing.recording.frames
    step = max(BLOCK_SAMPLES // count, 1)
    size = 0
    for begin in range(0, frames, step):
        rows = slice(begin, min(begin + step, frames))
        with np.errstate(all="ignore"):
            words = _point_words(writing, rows).reshape(-1, 4 * count)
        analog = _analog_words(writing, rows)
        if analog is not None:
            parts = [words, analog]
            words = np.concatenate(parts, axis=1, dtype=words.dtype)
        size += words.nbytes
        yield words.tobytes()
    yield b"\0" * (-size % BLOCK) if writing.tail is None else writing.tail


def _analog_words(writing: Writing, rows: slice) -> Words | None:
    if writing.analog is not None:
        return writing.analog[rows]
    if writing.source is None or not writing.source.analog_words:
        return None
    assert writing.source.frames is not None
    return writing.source.frames[rows, 4 * writing.source.points :]


def _point_words(writing: Writing, rows: slice) -> Words:
    """(B, C, 4) words of the points of some frames."""
    block = _gather(writing, rows)
    block.numbers[..., 3] = block.word
    block.numbers[block.word < 0] = (0.0, 0.0, 0.0, MISSING_WORD)
    if not writing.coding.is_float:
        np.rint(block.numbers, out=block.numbers)
    words = writing.coding.words(block.numbers)
    if writing.source is not None:
        _copy_unchanged(writing, rows, block, words)
    return words


@dataclass(frozen=True, kw_only=True)
class _Block:
    """Samples to write; (B, C, ...).

    Attributes
    ----------
    numbers : (B, C, 4) as the file counts them: float32, or float64 to be rounded.
    word : (B, C) the fourth word, negative where there is no point.
    measured : (B, C) whether the point is as it was measured.
    home : (B, C) the source's column it came from, -1 if none.
    """

    numbers: NDArray[Any]
    word: Shorts
    measured: Bools
    home: NDArray[np.int32]


def _gather(writing: Writing, rows: slice) -> _Block:
    """Bring the points of some frames into their columns."""
    columns, coding = writing.columns, writing.coding
    shape = (rows.stop - rows.start, len(columns.columns))
    block = _Block(
        numbers=np.zeros((*shape, 4), np.float32 if coding.is_float else np.float64),
        word=np.full(shape, MISSING_WORD, np.int16),
        measured=np.zeros(shape, bool),
        home=np.full(shape, -1, np.int32),
    )
    at, home = columns.homes
    block.home[:, at] = home
    if writing.recording.markers is not None:
        _put_markers(writing, rows, block)
    if writing.recording.unlabelled is not None:
        _put_points(writing, rows, block)
    at, output = columns.outputs
    turned = writing.angles.values[rows][:, output] * writing.turn
    block.numbers[:, at, :3] = turned if coding.is_float else turned / coding.scale
    block.word[:, at] = np.where(np.isfinite(turned).all(axis=2), 0, MISSING_WORD)
    return block


def _put_markers(writing: Writing, rows: slice, block: _Block) -> None:
    """Fill in markers: coordinates, fourth words, and where each sample came from."""
    markers, coding = writing.recording.markers, writing.coding
    assert markers is not None
    at, index = writing.columns.markers
    if not len(index):
        return
    columns, chosen = as_slice(at), as_slice(index)
    positions = markers.positions[rows][:, chosen]
    numbers = positions * (1.0 / coding.step)
    block.numbers[:, columns, :3] = numbers
    total = numbers[..., 0] + numbers[..., 1] + numbers[..., 2]
    origin = markers.origin[rows][:, chosen]
    measured = origin == Origin.MEASURED
    word = WORD_OF_ORIGIN[np.minimum(origin, len(WORD_OF_ORIGIN) - 1)]
    known = _known(writing, markers, rows, chosen)
    if known is not None:
        np.copyto(word, known, where=measured)
    word[~np.isfinite(total)] = MISSING_WORD
    block.word[:, columns] = word
    block.measured[:, columns] = measured
    if markers.source is not None and writing.source is not None:
        source = markers.source[rows][:, chosen]
        home = block.home[:, columns]
        inside = (source >= 0) & (source < writing.source.points)
        block.home[:, columns] = np.where(inside, source, home)


def _known(
    writing: Writing,
    markers: Trajectories,
    rows: slice,
    chosen: slice | NDArray[np.intp],
) -> Shorts | None:
    """Fourth words of measured markers by their residual and cameras, if known."""
    if markers.residual is None:
        return None
    residual = markers.residual[rows][:, chosen]
    cameras = None if markers.cameras is None else markers.cameras[rows][:, chosen]
    return fourth_words(writing.coding, residual, cameras)


def _put_points(writing: Writing, rows: slice, block: _Block) -> None:
    """Fill in the unlabelled points of some frames."""
    points = writing.recording.unlabelled
    assert points is not None
    begin, end = np.searchsorted(points.frame, [rows.start, rows.stop])
    some = slice(int(begin), int(end))
    at = (points.frame[some] - rows.start, writing.columns.point_column[some])
    block.numbers[(*at, slice(3))] = points.positions[some] / writing.coding.step
    block.word[at] = 1
    if points.residual is not None:
        cameras = None if points.cameras is None else points.cameras[some]
        block.word[at] = fourth_words(writing.coding, points.residual[some], cameras)
    block.measured[at] = True
    gone = ~np.isfinite(points.positions[some]).all(axis=1)
    block.word[at[0][gone], at[1][gone]] = MISSING_WORD
    if writing.source is not None:
        source = points.source[some]
        inside = (source >= 0) & (source < writing.source.points)
        block.home[at] = np.where(inside, source, block.home[at])


def _copy_unchanged(
    writing: Writing,
    rows: slice,
    block: _Block,
    words: Words,
) -> None:
    """Put the source's own words where a sample says what it said.

    Parameters
    ----------
    words : (B, C, 4) what is to be written; changed in place.
    """
    source = writing.source
    assert source is not None
    whole = source.words(rows)
    home = block.home
    if (home == np.arange(home.shape[1])).all() and home.shape[1] == whole.shape[1]:
        raw = whole
    else:
        raw = whole[np.arange(len(home))[:, None], np.maximum(home, 0)]
    old = source.coding.numbers(raw)
    outputs = writing.columns.raw
    if writing.coding != source.coding:
        words[:, outputs] = _rescaled(writing, old[:, outputs])
        return
    same = valid(old)
    here = same & placed(old)
    for axis in range(3):
        same &= old[..., axis] == block.numbers[..., axis]
    same &= block.measured | (old[..., 3] == block.word)
    keep = np.where(block.word < 0, ~here, same) & (home >= 0)
    keep[:, outputs] = True
    if keep.all():
        words[...] = raw
    else:
        np.copyto(words, raw, where=keep[..., None])


def _rescaled(writing: Writing, old: NDArray[Any]) -> Words:
    """Words of integer samples in the coding to write."""
    assert writing.source is not None
    ratio = writing.source.coding.scale / writing.coding.scale
    numbers = old * ratio
    word = old[..., 3].astype(np.int32)
    residual = np.rint((word & 255) * ratio).astype(np.int32)
    numbers[..., 3] = np.where(word < 0, word, (word & ~255) | residual)
    return writing.coding.words(numbers)
