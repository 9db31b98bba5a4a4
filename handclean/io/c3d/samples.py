"""Point samples of a C3D file: four words to metres, residual, cameras, and back.

A sample is x, y, z and a fourth word, all 16-bit integers or all 32-bit floats::

    integer files   metres = value x SCALE x unit
    float files     metres = value x unit
    fourth word     negative: the point is missing, whatever x, y and z are
                    high byte: camera mask (7 bits), low byte: residual / |SCALE|

In a float file the fourth word is a float that holds the integer; 32768 to 65535 are
the negative integers written without their sign (c3d.org's sample 26 has them), beyond
that or NaN the word means nothing and the point is missing too, as it is when a
coordinate is not finite.

Word 0 says that a point was interpolated, filtered or otherwise computed. It is
believed (`Origin.FILLED`) in files that hold other words as well; where all words are
0, residuals were just not recorded and the points count as measured, but for those
that handclean lists (`handclean.io.c3d.filled_list`).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Bools, Bytes, Floats, Floats32
from handclean.io.c3d.numbers import (
    Processor,
    Shorts,
    Words,
    floats_from_words,
    shorts_from_words,
    words_from_floats,
    words_from_shorts,
)

SHORT_MIN, SHORT_MAX = -32768, 32767
"""Numbers that a 16-bit coordinate can be."""

MISSING_WORD = -1
"""Fourth word of a point that is not there (C3D format)."""

WORD_OF_ORIGIN = np.array([-1, 1, 0, -1, 0], np.int16)
"""Fourth word by `Origin`; a measured point's residual is not known here."""


@dataclass(frozen=True, kw_only=True)
class Coding:
    """How the samples of one file are coded.

    Attributes
    ----------
    scale : magnitude of POINT:SCALE.
    metres : value of the file's unit of length.
    """

    processor: Processor
    is_float: bool
    scale: float
    metres: float

    @property
    def word(self) -> np.dtype[Any]:
        """Type of the words as they lie in the file."""
        return self.processor.word(4 if self.is_float else 2)

    @property
    def step(self) -> float:
        """[m] what 1 stands for in a coordinate."""
        return self.metres if self.is_float else self.metres * self.scale

    def numbers(self, words: Words) -> NDArray[Any]:
        """Native float32 or int16 of file words."""
        if self.is_float:
            return floats_from_words(words, self.processor)
        return shorts_from_words(words, self.processor)

    def words(self, numbers: NDArray[Any]) -> Words:
        """File words of whole or float numbers that fit."""
        if self.is_float:
            return words_from_floats(numbers.astype(np.float32), self.processor)
        return words_from_shorts(np.rint(numbers).astype(np.int16), self.processor)


@dataclass(kw_only=True)
class Tally:
    """What was met while decoding, in samples.

    Attributes
    ----------
    computed : fourth word 0; recorded : above 0.
    invalid : negative; with_place : of those, with coordinates all the same.
    strange : fourth word NaN or beyond 16 bits; fractional : not whole.
    unsigned : negative words written without their sign.
    not_finite : NaN or infinite coordinates of points not marked missing.
    zeros : points at (0, 0, 0) not marked missing, by column.
    extreme : integer coordinates at the end of their range.
    believed : whether marks that every point is missing are passed over.
    listed : that `handclean.io.c3d.filled_list` lists as filled; -1 if those are
    others.
    """

    samples: int = 0
    computed: int = 0
    recorded: int = 0
    invalid: int = 0
    with_place: int = 0
    strange: int = 0
    fractional: int = 0
    unsigned: int = 0
    not_finite: int = 0
    extreme: int = 0
    listed: int = 0
    believed: bool = False
    zeros: dict[int, int] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Where a block of decoded samples goes; all (B, M, ...), see `Trajectories`."""

    positions: Floats
    residual: Floats32
    cameras: Bytes
    origin: Bytes


def decode(
    numbers: NDArray[Any],
    coding: Coding,
    out: Samples,
    tally: Tally,
    columns: NDArray[np.intp],
    zeros_are_missing: bool,
) -> Bools:
    """Decode a block of samples.

    Parameters
    ----------
    numbers : (B, M, 4) native numbers of the file.
    out : overwritten in full; `Origin.FILLED` where the word is 0.
    columns : (M,) the file's columns, for the tally of zeros.

    Returns
    -------
    (B, M) which samples are there
    """
    _divide(numbers[..., :3], coding, out.positions)
    word = np.ascontiguousarray(numbers[..., 3])
    if tally.believed:
        word = np.zeros(word.shape, word.dtype)
    here = _believed(word, tally)
    if not here.all():
        places = numbers[~here][:, :3].any(axis=1)
        tally.with_place += int(np.count_nonzero(places))
    bits = np.where(here, word, 0).astype(np.int16)
    total = out.positions[..., 0] + out.positions[..., 1]
    total += out.positions[..., 2]
    if coding.is_float:
        finite = np.isfinite(total)
        if not finite.all():
            tally.not_finite += int(np.count_nonzero(here & ~finite))
            here &= finite
    else:
        ends = np.abs(numbers[..., :3].astype(np.int32)) >= SHORT_MAX
        tally.extreme += int(np.count_nonzero(ends[here]))
    zero = (total == 0) & here
    if zero.any():
        zero &= ~out.positions.any(axis=-1)
        for column, count in zip(columns, zero.sum(axis=0), strict=True):
            if count:
                tally.zeros[int(column)] = tally.zeros.get(int(column), 0) + int(count)
        if zeros_are_missing:
            here &= ~zero
    computed = here & (word == 0)
    tally.computed += int(np.count_nonzero(computed))
    tally.recorded += int(np.count_nonzero(here & (word > 0)))
    np.multiply(bits & 255, np.float32(coding.scale * coding.metres), out=out.residual)
    if tally.believed:
        out.residual[:] = np.nan
    np.right_shift(bits, 8, out=out.cameras, casting="unsafe")
    np.add(here, computed, out=out.origin, dtype=np.uint8)
    gone = ~here
    if gone.any():
        out.positions[gone] = np.nan
        out.residual[gone] = np.nan
        out.cameras[gone] = 0
    return here


def _divide(numbers: NDArray[Any], coding: Coding, out: Floats) -> None:
    """Metres of coordinates; dividing by a whole number keeps decimal digits exact."""
    per_metre = 1.0 / coding.metres
    if coding.is_float and per_metre >= 1.0 and abs(per_metre % 1.0 - 0.5) > 0.4999:
        np.divide(numbers, round(per_metre), out=out, dtype=np.float64)
    else:
        np.multiply(numbers, coding.step, out=out, dtype=np.float64)


def _believed(word: NDArray[Any], tally: Tally) -> Bools:
    """Which fourth words do not say that the point is missing; others are counted."""
    tally.samples += word.size
    here: Bools = word >= 0
    if word.dtype == np.float32:
        here &= word <= SHORT_MAX
        tally.fractional += int(np.count_nonzero(here & (word != np.trunc(word))))
        if not here.all():
            odd = word[~here]
            unsigned = (odd > SHORT_MAX) & (odd < 65536)
            tally.unsigned += int(np.count_nonzero(unsigned))
            tally.strange += int(np.count_nonzero(~(odd < 65536) | (odd < -32768)))
    tally.invalid += word.size - int(np.count_nonzero(here))
    return here


def new_samples(frames: int, columns: int) -> Samples:
    """Room for samples, all missing."""
    return Samples(
        positions=np.empty((frames, columns, 3)),
        residual=np.empty((frames, columns), np.float32),
        cameras=np.empty((frames, columns), np.uint8),
        origin=np.empty((frames, columns), np.uint8),
    )


def block_of(samples: Samples, rows: slice) -> Samples:
    """Views of some frames."""
    return Samples(
        positions=samples.positions[rows],
        residual=samples.residual[rows],
        cameras=samples.cameras[rows],
        origin=samples.origin[rows],
    )


def marked_there(word: NDArray[Any]) -> Bools:
    """(...) fourth words that do not say that the point is missing."""
    there: Bools = (word >= 0) & (word <= SHORT_MAX)
    return there


def valid(numbers: NDArray[Any]) -> Bools:
    """(...) samples (..., 4) that are not marked missing and have finite places."""
    here = marked_there(numbers[..., 3])
    if numbers.dtype.kind == "f":
        for axis in range(3):
            here &= np.isfinite(numbers[..., axis])
    return here


def placed(numbers: NDArray[Any]) -> Bools:
    """(...) samples (..., 4) that are not at (0, 0, 0)."""
    away: Bools = numbers[..., 0] != 0
    for axis in (1, 2):
        away |= numbers[..., axis] != 0
    return away


def fourth_words(coding: Coding, residual: Floats32, cameras: Bytes | None) -> Shorts:
    """Fourth words of measured points: never 0, residuals held at 255 x |SCALE|.

    Parameters
    ----------
    residual : [m], NaN where unknown.
    cameras : masks of 7 bits, or None.
    """
    steps = np.rint(residual / np.float32(coding.scale * coding.metres))
    low = np.clip(np.nan_to_num(steps, nan=1.0, posinf=255.0), 1.0, 255.0)
    words: Shorts = low.astype(np.int16)
    if cameras is not None:
        words |= (cameras & 127).astype(np.int16) << 8
    return words
