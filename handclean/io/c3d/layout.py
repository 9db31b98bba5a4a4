"""Where a C3D file keeps its samples: header and parameters heard against its size.

The header and the parameters both say how many points there are, how many analog
words, where the data begin, whether they are floats, and up to four places say how many
frames: POINT:FRAMES (16 bits or a float), POINT:LONG_FRAMES, the TRIAL group's actual
start and end fields (two 16-bit words each, the low one first, the high one worth
65536), and the header's first and last frame. Files exist that are wrong in each of
them: no single rule reads all. The rule here:

1. What the parameters say is taken where it fills the file to within the padding of a
   block; otherwise the first combination of claims that does.
2. If none does, the parameters are believed, frames by POINT:FRAMES, then LONG_FRAMES,
   TRIAL and the header. A file too short for that is truncated.
3. An integer frame count of 65535 means "at least": the other places count first, and
   where there are none, as many frames as the file holds.

A claim is only ever checked against the bytes there are, so that no size in a header is
trusted.
"""

from dataclasses import dataclass
from itertools import product
from typing import TypeVar

import numpy as np

from handclean.arrays import Bytes
from handclean.io.c3d.numbers import Processor, floats_at, shorts_at
from handclean.io.c3d.parameters import BLOCK_BYTES, FLOATS, Section
from handclean.remarks import Remark, remark

T = TypeVar("T")
FULL_COUNT = 65535
"""The largest count of 16 bits, which means "look further" (C3D format)."""


@dataclass(frozen=True, kw_only=True)
class Header:
    """What the first block says; counts are unsigned."""

    parameter_block: int
    points: int
    analog_words: int
    first: int
    last: int
    scale: float
    data_block: int
    analog_per_frame: int
    rate: float


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where the samples are.

    Attributes
    ----------
    data_at : byte where the first frame begins.
    points, analog_words : in one frame.
    is_float : 32-bit floats, else 16-bit integers.
    frames : as claimed; held : whole ones the file holds, at most ``frames``.
    first_frame : number of the first frame.
    remarks : what was contradictory and how it was decided.
    """

    data_at: int
    points: int
    analog_words: int
    is_float: bool
    frames: int
    held: int
    first_frame: int
    remarks: tuple[Remark, ...] = ()

    @property
    def word_bytes(self) -> int:
        """Bytes of one number."""
        return 4 if self.is_float else 2

    @property
    def words(self) -> int:
        """Numbers in one frame."""
        return 4 * self.points + self.analog_words

    @property
    def frame_bytes(self) -> int:
        """Bytes of one frame."""
        return self.words * self.word_bytes


@dataclass(frozen=True)
class _Shape:
    """One combination of claims about the form of a frame."""

    data_block: int
    points: int
    analog_words: int
    is_float: bool

    @property
    def frame_bytes(self) -> int:
        return (4 * self.points + self.analog_words) * (4 if self.is_float else 2)


@dataclass(frozen=True)
class _Claim:
    """How many frames somebody says there are; 65535 may mean "at least"."""

    frames: int
    who: str
    at_least: bool = False


def parse_header(raw: bytes, processor: Processor) -> Header:
    """Read the 512 bytes of a header."""
    words = shorts_at(raw[:24], processor).view(np.uint16).tolist()
    return Header(
        parameter_block=raw[0],
        points=words[1],
        analog_words=words[2],
        first=words[3],
        last=words[4],
        scale=float(floats_at(raw[12:16], processor)[0]),
        data_block=words[8],
        analog_per_frame=words[9],
        rate=float(floats_at(raw[20:24], processor)[0]),
    )


def count(section: Section, group: str, name: str) -> int | None:
    """Return a whole number a parameter holds, integers unsigned; None if none."""
    values = section.numbers(group, name, unsigned=True)
    if not values.size or not np.isfinite(values[0]) or not 0 <= values[0] < 2**31:
        return None
    return int(values[0])


def field(section: Section, name: str) -> int | None:
    """Return the frame number of a TRIAL field: low word, high word; or one number."""
    entry = section.find("TRIAL", name)
    values = section.numbers("TRIAL", name, unsigned=True)
    if entry is None or not values.size or not np.isfinite(values).all():
        return None
    if entry.kind == FLOATS or values.size == 1:
        return int(values[0]) if 0 <= values[0] < 2**31 else None
    return int(values[0]) + 65536 * int(values[1])


def trial_frames(section: Section) -> int | None:
    """Frames by the TRIAL group."""
    start = field(section, "ACTUAL_START_FIELD")
    end = field(section, "ACTUAL_END_FIELD")
    if start is None or end is None or end < start:
        return None
    return end - start + 1


def find_layout(raw: Bytes, at: int, header: Header, section: Section) -> Layout:
    """Decide where the samples are.

    Parameters
    ----------
    raw : the whole file.
    at : where its header begins.
    """
    shapes = _shapes(header, section, at, len(raw))
    claims = _frame_claims(header, section)
    shape, claim = _settle(raw, at, shapes, claims)
    frames = claim.frames
    data_at = at + (shape.data_block - 1) * BLOCK_BYTES
    room = max(len(raw) - data_at, 0) // max(shape.frame_bytes, 1)
    return Layout(
        data_at=data_at,
        points=shape.points,
        analog_words=shape.analog_words,
        is_float=shape.is_float,
        frames=frames,
        held=min(frames, room),
        first_frame=_first_frame(header, section, frames),
        remarks=tuple(_disputes(header, section, shape, claims, claim)),
    )


def _settle(
    raw: Bytes, at: int, shapes: list[_Shape], claims: list[_Claim]
) -> tuple[_Shape, _Claim]:
    """Return the form of a frame and the claim to believe."""
    for shape in shapes:
        room = len(raw) - at - (shape.data_block - 1) * BLOCK_BYTES
        for claim in claims:
            if claim.at_least:
                found = _frames_to_the_end(raw, room, shape.frame_bytes)
                if found >= claim.frames:
                    return shape, _Claim(found, claim.who)
            elif 0 <= room - claim.frames * shape.frame_bytes < BLOCK_BYTES:
                return shape, claim
    return shapes[0], claims[0] if claims else _Claim(0, "nobody")


def _frames_to_the_end(raw: Bytes, room: int, frame_bytes: int) -> int:
    """Frames in the last ``room`` bytes, without zeros that pad the last block."""
    if room <= 0 or frame_bytes == 0:
        return 0
    padding = min(BLOCK_BYTES - 1, room)
    used = np.flatnonzero(raw[len(raw) - padding :])
    silent = padding - (int(used[-1]) + 1 if used.size else 0)
    whole = room // frame_bytes
    filled = min(-(-(room - silent) // frame_bytes), whole)
    return max(filled, min(whole, FULL_COUNT))


def _shapes(header: Header, section: Section, at: int, size: int) -> list[_Shape]:
    """Combinations of what parameters and header say, the parameters' first."""
    beyond = header.parameter_block
    said = [count(section, "POINT", "DATA_START"), header.data_block]
    starts = [s for s in said if s and s > beyond] or [beyond + (section.lead[2] or 1)]
    blocks = [s for s in starts if at + (s - 1) * BLOCK_BYTES < size] or starts[:1]
    used = count(section, "POINT", "USED")
    points = [p for p in (used, header.points) if p] + [0] * (used == 0)
    scale = section.numbers("POINT", "SCALE")
    scales = [s for s in (*scale[:1].tolist(), header.scale) if s == s and s != 0]
    combinations = product(
        _unique(blocks),
        _unique(points) or [0],
        _unique(_analog_words(header, section)),
        _unique([s < 0 for s in scales]) or [False],
    )
    return [_Shape(*c) for c in combinations]


def _analog_words(header: Header, section: Section) -> list[int]:
    """Analog words of a frame: as the parameters have it, as the header has it."""
    channels = count(section, "ANALOG", "USED")
    if channels is None:
        return [header.analog_words]
    ratio = analog_ratio(header, section)
    return [channels * ratio, header.analog_words, channels * header.analog_per_frame]


def analog_ratio(header: Header, section: Section) -> int:
    """Analog samples per frame by the rates, else by the header."""
    rates = [section.numbers(g, "RATE")[:1] for g in ("ANALOG", "POINT")]
    if all(r.size and np.isfinite(r[0]) and r[0] > 0 for r in rates):
        ratio = rates[0][0] / rates[1][0]
        if 0.9 <= ratio < FULL_COUNT:
            return round(float(ratio))
    return header.analog_per_frame


def _unique(values: list[T]) -> list[T]:
    return list(dict.fromkeys(values))


def _frame_claims(header: Header, section: Section) -> list[_Claim]:
    """Frame counts and who claims them, the most believable first."""
    frames = count(section, "POINT", "FRAMES")
    entry = section.find("POINT", "FRAMES")
    is_full = frames == FULL_COUNT and entry is not None and entry.kind != FLOATS
    span = header.last - header.first + 1
    said = [
        ("POINT:FRAMES", None if is_full else frames),
        ("POINT:LONG_FRAMES", count(section, "POINT", "LONG_FRAMES")),
        ("the TRIAL group", trial_frames(section)),
        ("the header", span if header.last < FULL_COUNT else None),
    ]
    claims = [_Claim(n, who) for who, n in said if n]
    saturated = is_full or (not claims and header.last == FULL_COUNT)
    if saturated and not any(c.frames >= FULL_COUNT for c in claims):
        claims.append(_Claim(FULL_COUNT, "the size of the file", at_least=True))
    return [c for c in claims if c.frames > 0]


def _first_frame(header: Header, section: Section, frames: int) -> int:
    """Return the number of the first frame; TRIAL's where the header cannot say."""
    start = field(section, "ACTUAL_START_FIELD")
    if start is None:
        return header.first
    agrees = trial_frames(section) == frames or start % 65536 == header.first
    return start if agrees else header.first


def _disputes(
    header: Header,
    section: Section,
    shape: _Shape,
    claims: list[_Claim],
    taken: _Claim,
) -> list[Remark]:
    """Remark on each number that not all places agree on."""
    heard = [
        ("points", count(section, "POINT", "USED"), header.points, shape.points),
        (
            "data start (block)",
            count(section, "POINT", "DATA_START"),
            header.data_block,
            shape.data_block,
        ),
        (
            "analog words per frame",
            _analog_words(header, section)[0],
            header.analog_words,
            shape.analog_words,
        ),
    ]
    remarks = [
        remark(
            "header",
            f"{name}: the parameters say {theirs}, the header {ours}; {found} was "
            "taken",
            taken=found,
        )
        for name, theirs, ours, found in heard
        if theirs is not None and not theirs == ours == found
    ]
    others = [
        f"{c.who} says {c.frames}"
        for c in claims
        if c.frames != taken.frames and not c.at_least
    ]
    if others:
        remarks.append(
            remark(
                "header",
                f"frames: {taken.who} says {taken.frames}, which was taken, "
                f"but {', '.join(others)}",
                taken=taken.frames,
            )
        )
    if any(c.at_least for c in claims):
        remarks.append(
            remark(
                "header",
                f"the frame count is {FULL_COUNT}, the most that 16 bits hold, and "
                f"nothing says more: {taken.frames} frames by {taken.who}",
                taken=taken.frames,
            )
        )
    return remarks
