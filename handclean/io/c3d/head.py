"""Everything before the samples of a C3D file, as one: header and parameter section."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from handclean.arrays import Bytes
from handclean.errors import FileError
from handclean.io.c3d.edit import edited_bytes, with_floats, with_shorts
from handclean.io.c3d.layout import FULL_COUNT, Header, parse_header
from handclean.io.c3d.numbers import Processor, words_from_floats
from handclean.io.c3d.parameters import (
    BLOCK_BYTES,
    FLOATS,
    MOST_PARAMETER_BLOCKS,
    Section,
    parse_section,
)
from handclean.io.c3d.samples import Coding

MAGIC = 0x50
"""Second byte of a C3D and of its parameter section (C3D format)."""

OUTPUT_KINDS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
"""Parameters of the POINT group that list points which are no places."""


@dataclass(frozen=True, kw_only=True)
class Head:
    """Everything before the samples.

    Attributes
    ----------
    raw : all bytes up to the samples.
    at : where the header begins; there may be zeros before.
    parameters_at : where the parameter section begins.
    """

    raw: bytes
    at: int
    parameters_at: int
    header: Header
    section: Section

    @property
    def processor(self) -> Processor:
        """Whose numbers the file uses."""
        return self.section.processor

    @property
    def scale(self) -> float:
        """POINT:SCALE, else the header's; NaN if neither is a number but 0."""
        said = self.section.numbers("POINT", "SCALE")[:1].tolist()
        good = [s for s in (*said, self.header.scale) if np.isfinite(s) and s != 0]
        return float(good[0]) if good else np.nan

    @property
    def unit(self) -> str | None:
        """POINT:UNITS, None where it is missing or blank."""
        return next(iter(self.section.strings("POINT", "UNITS")), "") or None

    def labels(self, points: int) -> list[str]:
        """Labels of all columns; "" where there is none."""
        labels = self.section.strings("POINT", "LABELS")[:points]
        return labels + [""] * (points - len(labels))

    def outputs(self) -> set[str]:
        """Labels of points that are model outputs, not places."""
        listed = {s for k in OUTPUT_KINDS for s in self.section.strings("POINT", k)}
        return listed - {""}


def coding_of(head: Head, is_float: bool, metres: float, where: Path | str) -> Coding:
    """Return how samples are coded.

    Raises
    ------
    FileError
        If they are integers and there is no scale.
    """
    scale = abs(head.scale)
    if not is_float and not scale > 0:
        right = "integer samples need one, as mm (or the like) per step"
        raise FileError(where, "POINT:SCALE is 0 or not a number", right)
    if not scale > 0:
        scale = 1.0
    return Coding(
        processor=head.processor, is_float=is_float, scale=scale, metres=metres
    )


def parse_head(raw: Bytes, where: Path | str, limit: int | None = None) -> Head:
    """Find and read header and parameters.

    Parameters
    ----------
    raw : the file, or all of it before the samples.
    limit : byte where the samples begin, when that is known.

    Raises
    ------
    FileError
        If this is not a C3D file.
    """
    at = _first_byte(raw)
    if at is None or len(raw) < at + 2 or raw[at + 1] != MAGIC:
        raise FileError(where, "is not a C3D file", "its second byte should be 0x50")
    parameters_at = at + (int(raw[at]) - 1) * BLOCK_BYTES
    if len(raw) < max(at + BLOCK_BYTES, parameters_at + 4):
        raise FileError(where, "is truncated inside its header or parameters")
    code = int(raw[parameters_at + 3])
    if code not in tuple(Processor):
        right = "84 (Intel), 85 (DEC) and 86 (MIPS) are known"
        raise FileError(where, f"has processor code {code}", right)
    processor = Processor(code)
    header = parse_header(raw[at : at + BLOCK_BYTES].tobytes(), processor)
    blocks = int(raw[parameters_at + 2])
    data_at = at + (header.data_block - 1) * BLOCK_BYTES
    if limit is None:
        limit = max(parameters_at + blocks * BLOCK_BYTES, data_at)
    limit = min(
        max(limit, parameters_at + 4),
        parameters_at + MOST_PARAMETER_BLOCKS * BLOCK_BYTES,
    )
    return Head(
        raw=b"",
        at=at,
        parameters_at=parameters_at,
        header=header,
        section=parse_section(raw[parameters_at:limit].tobytes(), processor),
    )


def _first_byte(raw: Bytes) -> int | None:
    """Where the zeros that some files begin with end."""
    for begin in range(0, len(raw), 1 << 20):
        used = np.flatnonzero(raw[begin : begin + (1 << 20)])
        if used.size:
            return begin + int(used[0])
    return None


def with_frames(head: Head, frames: int, first: int) -> Head:
    """Set the number of frames wherever the file keeps it."""
    section = head.section
    entry = section.find("POINT", "FRAMES")
    if entry is not None and entry.kind == FLOATS:
        section = with_floats(section, "POINT", "FRAMES", float(frames))
    else:
        section = with_shorts(section, "POINT", "FRAMES", min(frames, FULL_COUNT))
    if frames >= FULL_COUNT or section.find("POINT", "LONG_FRAMES") is not None:
        section = with_floats(section, "POINT", "LONG_FRAMES", float(frames))
    end = max(first + frames - 1, 0)
    is_long = max(frames, end) >= FULL_COUNT
    if is_long or section.find("TRIAL", "ACTUAL_END_FIELD") is not None:
        for name, number in (("START", first), ("END", end)):
            fields = [number % 65536, number // 65536]
            section = with_shorts(section, "TRIAL", f"ACTUAL_{name}_FIELD", fields)
    shown = (first, end) if end <= FULL_COUNT else (1, FULL_COUNT)
    head = with_header_shorts(
        replace(head, section=section), {3: shown[0], 4: shown[1]}
    )
    return with_section(head, section)


def with_header_shorts(head: Head, values: dict[int, int]) -> Head:
    """Set 16-bit words of the header, counted from 0."""
    raw = bytearray(head.raw)
    for word, value in values.items():
        at = head.at + 2 * word
        raw[at : at + 2] = np.array(value, head.processor.word(2)).tobytes()
    header = parse_header(bytes(raw[head.at : head.at + BLOCK_BYTES]), head.processor)
    return replace(head, raw=bytes(raw), header=header)


def with_header_floats(head: Head, values: dict[int, float]) -> Head:
    """Set floats of the header, by the byte they begin at."""
    raw = bytearray(head.raw)
    for at, value in values.items():
        number = np.array([value], np.float32)
        at += head.at
        raw[at : at + 4] = words_from_floats(number, head.processor).tobytes()
    header = parse_header(bytes(raw[head.at : head.at + BLOCK_BYTES]), head.processor)
    return replace(head, raw=bytes(raw), header=header)


def with_section(head: Head, section: Section) -> Head:
    """Put an edited section in place; the data move when it needs more room.

    Where the samples begin is set in the header and in POINT:DATA_START.
    """
    room = len(head.raw) - head.parameters_at
    section = with_shorts(section, "POINT", "DATA_START", 0)
    size = len(edited_bytes(section, room))
    block = (head.parameters_at - head.at + size) // BLOCK_BYTES + 1
    section = with_shorts(section, "POINT", "DATA_START", block)
    head = with_header_shorts(head, {8: block})
    raw = head.raw[: head.parameters_at] + edited_bytes(section, room)
    return replace(head, raw=raw, section=section)
