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

Where the source's fourth words are all 0 (residuals were not recorded), so are those of
all points, and `handclean.io.c3d.filled_list` lists what was filled.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Bools
from handclean.errors import FileError
from handclean.io.c3d.columns import angles_of, as_slice, plan_columns
from handclean.io.c3d.draft import (
    BLOCK_SAMPLES,
    Source,
    Writing,
    is_silent,
    smoothed,
    source_of,
    untrusted,
)
from handclean.io.c3d.new import new_file
from handclean.io.c3d.numbers import Shorts, Words
from handclean.io.c3d.parameters import BLOCK_BYTES
from handclean.io.c3d.rewrite import same_file
from handclean.io.c3d.samples import (
    MISSING_WORD,
    SHORT_MAX,
    WORD_OF_ORIGIN,
    fourth_words,
    placed,
    valid,
)
from handclean.recording import Origin, Recording


def plan_writing(recording: Recording, where: Path | str) -> Writing:
    """Decide on everything but the samples.

    Raises
    ------
    FileError
        If there are no points, or they do not fit the format.
    """
    if recording.frames < 1:
        raise FileError(where, "nothing to write: the take has no frames")
    angles = angles_of(recording)
    source = source_of(recording, where)
    if source is None:
        columns = plan_columns(recording, angles, (), set(), {}, where)
        writing = new_file(recording, columns, angles, where)
    else:
        labels, outputs = source.head.labels(source.points), source.head.outputs()
        loose = {int(c): is_silent(source, int(c)) for c in source.loose}
        columns = plan_columns(recording, angles, labels, outputs, loose, where)
        writing = same_file(recording, source, columns, angles, where)
    told = (*writing.remarks, *untrusted(recording), *smoothed(recording))
    return replace(writing, remarks=told)


def encode_c3d(writing: Writing) -> Iterator[bytes]:
    """Yield the bytes of a C3D file, piece by piece."""
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
    yield b"\0" * (-size % BLOCK_BYTES) if writing.tail is None else writing.tail


def _analog_words(writing: Writing, rows: slice) -> Words | None:
    if writing.analog is not None:
        return writing.analog[rows]
    if writing.source is None or not writing.source.analog_words:
        return None
    assert writing.source.frames is not None
    return writing.source.frames[rows, 4 * writing.source.points :]


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


def _point_words(writing: Writing, rows: slice) -> Words:
    """(B, C, 4) words of the points of some frames."""
    block = _gather(writing, rows)
    if writing.source is None:
        return _encoded(writing, rows, block, np.ones(block.word.shape, bool))
    raw = _raw_words(writing.source, rows, block)
    old = writing.source.coding.numbers(raw)
    outputs = writing.columns.raw
    if writing.coding != writing.source.coding:
        words = _encoded(writing, rows, block, np.ones(block.word.shape, bool))
        words[:, outputs] = _rescaled(writing, old[:, outputs])
        return words
    change = ~_unchanged(block, old)
    change[:, outputs] = False
    if not change.any():
        return raw
    words = raw.copy()
    words[change] = _encoded(writing, rows, block, change)[change]
    return words


def _encoded(writing: Writing, rows: slice, block: _Block, which: Bools) -> Words:
    """(B, C, 4) words made from scratch; only ``which`` samples have their residual."""
    _put_residuals(writing, rows, block, which)
    if writing.unrecorded:
        block.word[block.word > 0] = 0
    block.numbers[..., 3] = block.word
    block.numbers[block.word < 0] = (0.0, 0.0, 0.0, MISSING_WORD)
    return writing.coding.words(block.numbers)


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
    numbers = markers.positions[rows][:, chosen] * (1.0 / coding.step)
    if not coding.is_float:
        np.rint(numbers, out=numbers)
    block.numbers[:, columns, :3] = numbers
    origin = markers.origin[rows][:, chosen]
    word = WORD_OF_ORIGIN[np.minimum(origin, len(WORD_OF_ORIGIN) - 1)]
    total = numbers[..., 0] + numbers[..., 1] + numbers[..., 2]
    word[~np.isfinite(total)] = MISSING_WORD
    block.word[:, columns] = word
    block.measured[:, columns] = origin == Origin.MEASURED
    if markers.source is not None and writing.source is not None:
        source = markers.source[rows][:, chosen]
        home = block.home[:, columns]
        inside = (source >= 0) & (source < writing.source.points)
        block.home[:, columns] = np.where(inside, source, home)


def _put_residuals(writing: Writing, rows: slice, block: _Block, which: Bools) -> None:
    """Fill in residual and cameras of some measured markers, where they are known."""
    markers = writing.recording.markers
    if markers is None or markers.residual is None:
        return
    at, index = writing.columns.markers
    wanted = which[:, at] & block.measured[:, at] & (block.word[:, at] >= 0)
    frame, slot = np.nonzero(wanted)
    residual = markers.residual[rows][frame, index[slot]]
    cameras = None
    if markers.cameras is not None:
        cameras = markers.cameras[rows][frame, index[slot]]
    block.word[frame, at[slot]] = fourth_words(writing.coding, residual, cameras)


def _put_points(writing: Writing, rows: slice, block: _Block) -> None:
    """Fill in the unlabelled points of some frames."""
    points = writing.recording.unlabelled
    assert points is not None
    ends = np.array([rows.start, rows.stop], points.frame.dtype)
    begin, end = np.searchsorted(points.frame, ends)
    some = slice(int(begin), int(end))
    at = (points.frame[some] - rows.start, writing.columns.point_column[some])
    numbers = points.positions[some] * (1.0 / writing.coding.step)
    if not writing.coding.is_float:
        np.rint(numbers, out=numbers)
    block.numbers[(*at, slice(3))] = numbers
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


def _raw_words(source: Source, rows: slice, block: _Block) -> Words:
    """(B, C, 4) the source's words of the samples that each sample came from."""
    whole = source.words(rows)
    home = block.home
    if home.shape[1] == whole.shape[1] and (home == np.arange(whole.shape[1])).all():
        return whole
    return whole[np.arange(len(home))[:, None], np.maximum(home, 0)]


def _unchanged(block: _Block, old: NDArray[Any]) -> Bools:
    """(B, C) samples that say what the source's samples ``old`` say."""
    word = old[..., 3]
    same: Bools = (word >= 0) & (word <= SHORT_MAX) & (block.measured | (word == 0))
    for axis in range(3):
        same &= old[..., axis] == block.numbers[..., axis]
    gone = block.word < 0
    if gone.any():
        some = old[gone]
        same[gone] = ~(valid(some) & placed(some))
    return same & (block.home >= 0)


def _rescaled(writing: Writing, old: NDArray[Any]) -> Words:
    """Words of integer samples in the coding to write."""
    assert writing.source is not None
    ratio = writing.source.coding.scale / writing.coding.scale
    numbers = old * ratio
    word = old[..., 3].astype(np.int32)
    residual = np.rint((word & 255) * ratio).astype(np.int32)
    numbers[..., 3] = np.where(word < 0, word, (word & ~255) | residual)
    return writing.coding.words(numbers)
