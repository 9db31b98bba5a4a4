"""Analog channels of a C3D file.

Each frame holds, behind its points, some samples of every channel, one sample of all
channels after another. A stored value v stands for::

    (v - OFFSET) x SCALE x GEN_SCALE    in UNITS

with one offset, scale and unit per channel, in float files too. With ANALOG:FORMAT
"UNSIGNED" integers and offsets run from 0 to 65535.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.io.c3d.head import Head
from handclean.io.c3d.layout import analog_ratio, count
from handclean.io.c3d.numbers import Words, floats_from_words, shorts_from_words
from handclean.io.c3d.parameters import Section
from handclean.io.c3d.structure import Structure
from handclean.recording import Analog

BLOCK_SAMPLES = 1 << 16
"""Analog values read at once (chosen: they stay in the cache)."""


@dataclass(frozen=True, kw_only=True)
class Gains:
    """How values are stored: value = (stored - offset) x scale; (C,) each."""

    offset: Floats
    scale: Floats
    unsigned: bool


def channels_of(head: Head, words: int) -> int:
    """Analog channels, given the analog words of a frame; 0 if it does not divide."""
    if not words:
        return 0
    used = count(head.section, "ANALOG", "USED") or 0
    if used and words % used == 0:
        return used
    per_frame = analog_ratio(head.header, head.section)
    return words // per_frame if per_frame and words % per_frame == 0 else 0


def gains_of(section: Section, channels: int) -> Gains:
    """Return offset and scale of every channel; missing ones are 0 and 1."""
    said = section.strings("ANALOG", "FORMAT")
    unsigned = bool(said) and said[0].upper() == "UNSIGNED"
    general = section.numbers("ANALOG", "GEN_SCALE")
    scale = _filled(_list(section, "SCALE", False), channels, 1.0)
    return Gains(
        offset=_filled(_list(section, "OFFSET", unsigned), channels, 0.0),
        scale=scale * (general[0] if general.size else 1.0),
        unsigned=unsigned,
    )


def _list(section: Section, name: str, unsigned: bool) -> Floats:
    """Values of a parameter and its continuations NAME2, NAME3 ..."""
    parts = [section.numbers("ANALOG", name, unsigned)]
    while parts[-1].size and len(parts) < 65536 // 255:
        parts.append(section.numbers("ANALOG", f"{name}{len(parts) + 1}", unsigned))
    return np.concatenate(parts)


def _filled(values: Floats, channels: int, default: float) -> Floats:
    full = np.full(channels, default)
    some = values[:channels]
    full[: len(some)] = some
    return full


def read_analog(structure: Structure, rate: float) -> Analog | None:
    """Return the analog channels in their units, None if there are none.

    Parameters
    ----------
    rate : [Hz] of the points.
    """
    words = structure.layout.analog_words
    channels = channels_of(structure.head, words)
    if not channels:
        return None
    section = structure.head.section
    gains = gains_of(section, channels)
    per_frame = words // channels
    frames = structure.layout.held
    values = np.empty((frames * per_frame, channels))
    step = max(BLOCK_SAMPLES // words, 1)
    with np.errstate(all="ignore"):
        for begin in range(0, frames, step):
            raw = structure.frames[begin : begin + step, 4 * structure.points :]
            stored = _stored(raw, structure, gains.unsigned).reshape(-1, channels)
            rows = slice(begin * per_frame, begin * per_frame + len(stored))
            np.subtract(stored, gains.offset, out=values[rows])
            values[rows] *= gains.scale
    labels = section.strings("ANALOG", "LABELS")[:channels]
    units = section.strings("ANALOG", "UNITS")[:channels]
    return Analog(
        values=values,
        labels=tuple(labels) + ("",) * (channels - len(labels)),
        units=tuple(units) + ("",) * (channels - len(units)),
        rate=rate * per_frame,
    )


def _stored(raw: Words, structure: Structure, unsigned: bool) -> Floats:
    processor = structure.head.processor
    if structure.layout.is_float:
        return floats_from_words(raw, processor).astype(np.float64)
    shorts = shorts_from_words(raw, processor)
    return (shorts.view(np.uint16) if unsigned else shorts).astype(np.float64)


def analog_rows(
    analog: Analog, frames: int, gains: Gains, is_float: bool, where: Path | str
) -> Floats:
    """(T, samples x C) stored numbers of analog values, one row per frame.

    Raises
    ------
    FileError
        If there is no whole number of samples per frame, or a value does not fit.
    """
    samples = len(analog.values)
    if samples % frames:
        wrong = f"{samples} analog samples do not divide into {frames} frames"
        raise FileError(where, wrong, "a whole number per frame is needed")
    stored = analog.values / gains.scale + gains.offset
    if not is_float:
        stored = np.rint(stored)
        low, high = (0, 65535) if gains.unsigned else (-32768, 32767)
        if not ((stored >= low) & (stored <= high)).all():
            raise FileError(where, "an analog value does not fit 16 bits")
        stored = np.where(stored > 32767, stored - 65536, stored)
    else:
        _expect_floats(analog, stored, where)
    return stored.reshape(frames, -1)


def _expect_floats(analog: Analog, stored: Floats, where: Path | str) -> None:
    """Expect finite numbers to be such as 32 bits hold."""
    beyond = np.isfinite(stored) & (np.abs(stored) > np.finfo(np.float32).max)
    if beyond.any():
        row, column = np.argwhere(beyond)[0]
        wrong = (
            f"analog channel '{analog.labels[column]}' holds {stored[row, column]:g}"
        )
        raise FileError(where, wrong, "a C3D keeps numbers up to 3.4e38")
