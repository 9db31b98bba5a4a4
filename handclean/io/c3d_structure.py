"""A C3D file opened: its header, parameters, labels and samples as they lie there.

Nothing here interprets a sample. Everything that is odd about the file's form is kept
in words: ``repairs`` say what was decided where the file contradicts itself or is
broken, ``remarks`` what its owner should know but what changes nothing.
"""

import stat
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from handclean.arrays import Bytes
from handclean.errors import FileError
from handclean.io.c3d_layout import (
    FULL,
    Header,
    Layout,
    analog_ratio,
    count,
    find_layout,
    parse_header,
)
from handclean.io.c3d_numbers import Processor, Words, words_from_floats
from handclean.io.c3d_parameters import (
    BLOCK,
    MOST_BLOCKS,
    Section,
    edited_bytes,
    parse_section,
    strings_of,
    with_floats,
    with_shorts,
)
from handclean.io.c3d_samples import Coding

MAGIC = 0x50
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


@dataclass(frozen=True, kw_only=True)
class Structure:
    """A file opened.

    Attributes
    ----------
    frames : (T, words) raw words of whole frames, points first, then analog.
    tail : bytes after them.
    """

    path: Path
    head: Head
    layout: Layout
    frames: Words
    tail: Bytes
    repairs: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def points(self) -> int:
        """Points per frame."""
        return self.layout.points

    def coding(self, metres: float) -> Coding:
        """How the samples are coded, given the unit."""
        return coding_of(self.head, self.layout.is_float, metres, self.path)


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


def load(path: Path) -> Bytes:
    """Return the bytes of a regular file that is not empty.

    Raises
    ------
    FileError
    """
    try:
        mode = path.stat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            raise FileError(path, "is no regular file", "give a C3D file")
        with open(path, "rb") as file:
            raw = np.fromfile(file, np.uint8)
    except FileNotFoundError:
        raise FileError(path, "no such file") from None
    except IsADirectoryError:
        raise FileError(path, "is a directory", "give a file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(path, f"cannot be read ({reason})") from None
    if not raw.size:
        raise FileError(path, "is empty", "a C3D file begins with a header")
    return raw


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
    parameters_at = at + (int(raw[at]) - 1) * BLOCK
    if len(raw) < max(at + BLOCK, parameters_at + 4):
        raise FileError(where, "is truncated inside its header or parameters")
    code = int(raw[parameters_at + 3])
    if code not in tuple(Processor):
        right = "84 (Intel), 85 (DEC) and 86 (MIPS) are known"
        raise FileError(where, f"has processor code {code}", right)
    processor = Processor(code)
    header = parse_header(raw[at : at + BLOCK].tobytes(), processor)
    blocks = int(raw[parameters_at + 2])
    data_at = at + (header.data_block - 1) * BLOCK
    if limit is None:
        limit = max(parameters_at + blocks * BLOCK, data_at)
    limit = min(max(limit, parameters_at + 4), parameters_at + MOST_BLOCKS * BLOCK)
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


def open_c3d(path: Path, lenient: bool = False) -> Structure:
    """Open a file.

    Parameters
    ----------
    lenient : take the whole frames of a truncated file.

    Raises
    ------
    FileError
        If it is missing, not a C3D file, without frames or points, or truncated.
    """
    raw = load(path)
    head = parse_head(raw, path)
    layout = find_layout(raw, head.at, head.header, head.section)
    end = head.parameters_at + len(_parsed(head.section))
    if head.parameters_at + 4 <= layout.data_at < end:
        head = parse_head(raw, path, layout.data_at)
        layout = find_layout(raw, head.at, head.header, head.section)
    if not layout.points:
        raise FileError(path, "has no points", "POINT:USED should be 1 or more")
    if not layout.frames:
        raise FileError(path, "has no frames", "POINT:FRAMES should be 1 or more")
    head = replace(head, raw=raw[: layout.data_at].tobytes())
    repairs = list(layout.notes)
    if layout.held < layout.frames:
        wrong = f"is truncated: {layout.held} of {layout.frames} frames can be saved"
        if not lenient or not layout.held:
            raise FileError(path, wrong, "--lenient reads them" if layout.held else "")
        repairs.append(f"the file {wrong}")
        head = with_frames(head, layout.held, layout.first_frame)
    end = layout.data_at + layout.held * layout.frame_bytes
    words = raw[layout.data_at : end].view(head.processor.word(layout.word_bytes))
    return Structure(
        path=path,
        head=head,
        layout=layout,
        frames=words.reshape(layout.held, layout.words),
        tail=raw[end:] if layout.held == layout.frames else raw[:0],
        repairs=tuple(repairs) + head.section.notes,
        remarks=tuple(_remarks(head, layout, len(raw) - end)),
    )


def _parsed(section: Section) -> bytes:
    return section.lead + b"".join(e.raw for e in section.entries)


def with_frames(head: Head, frames: int, first: int) -> Head:
    """Set the number of frames wherever the file keeps it."""
    section = head.section
    entry = section.find("POINT", "FRAMES")
    if entry is not None and entry.kind == 4:
        section = with_floats(section, "POINT", "FRAMES", float(frames))
    else:
        section = with_shorts(section, "POINT", "FRAMES", min(frames, FULL))
    if frames >= FULL or section.find("POINT", "LONG_FRAMES") is not None:
        section = with_floats(section, "POINT", "LONG_FRAMES", float(frames))
    end = max(first + frames - 1, 0)
    is_long = max(frames, end) >= FULL
    if is_long or section.find("TRIAL", "ACTUAL_END_FIELD") is not None:
        for name, number in (("START", first), ("END", end)):
            fields = [number % 65536, number // 65536]
            section = with_shorts(section, "TRIAL", f"ACTUAL_{name}_FIELD", fields)
    shown = (first, end) if end <= FULL else (1, FULL)
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
    header = parse_header(bytes(raw[head.at : head.at + BLOCK]), head.processor)
    return replace(head, raw=bytes(raw), header=header)


def with_header_floats(head: Head, values: dict[int, float]) -> Head:
    """Set floats of the header, by the byte they begin at."""
    raw = bytearray(head.raw)
    for at, value in values.items():
        number = np.array([value], np.float32)
        at += head.at
        raw[at : at + 4] = words_from_floats(number, head.processor).tobytes()
    header = parse_header(bytes(raw[head.at : head.at + BLOCK]), head.processor)
    return replace(head, raw=bytes(raw), header=header)


def with_section(head: Head, section: Section) -> Head:
    """Put an edited section in place; the data move when it needs more room.

    Where the samples begin is set in the header and in POINT:DATA_START.
    """
    room = len(head.raw) - head.parameters_at
    section = with_shorts(section, "POINT", "DATA_START", 0)
    size = len(edited_bytes(section, room))
    block = (head.parameters_at - head.at + size) // BLOCK + 1
    section = with_shorts(section, "POINT", "DATA_START", block)
    head = with_header_shorts(head, {8: block})
    raw = head.raw[: head.parameters_at] + edited_bytes(section, room)
    return replace(head, raw=raw, section=section)


def _remarks(head: Head, layout: Layout, left: int) -> list[str]:
    """Words for what is odd but needs no decision."""
    header, section = head.header, head.section
    notes = []
    if head.at:
        notes.append(f"{head.at} zero bytes before the header")
    if not section.entries:
        notes.append("the parameter section is empty: only the header speaks")
    if layout.first_frame != 1:
        notes.append(f"the first frame is number {layout.first_frame}")
    if left >= BLOCK:
        notes.append(f"{left} bytes after the last frame")
    for name, theirs, ours in (
        ("rate", section.numbers("POINT", "RATE"), header.rate),
        ("scale", section.numbers("POINT", "SCALE"), header.scale),
    ):
        if theirs.size and not np.isclose(theirs[0], ours, rtol=1e-5, atol=0):
            notes.append(
                f"{name}: the parameters say {theirs[0]:g}, the header {ours:g}"
            )
    if abs(head.scale) == 1.0:
        kind = "residuals" if layout.is_float else "coordinates"
        notes.append(f"POINT:SCALE is {head.scale:g}: {kind} in whole units only")
    return notes + _label_remarks(head, layout.points) + _analog_remarks(head)


def _label_remarks(head: Head, points: int) -> list[str]:
    labels = head.section.strings("POINT", "LABELS")
    notes = []
    if len(labels) < points:
        notes.append(f"{len(labels)} labels for {points} points: the rest are unnamed")
    if len(labels) > points:
        notes.append(f"{len(labels)} labels for {points} points: the last are unused")
    first = head.section.find("POINT", "LABELS")
    more = head.section.find("POINT", "LABELS2")
    if first is not None and more is not None and len(strings_of(first)) != 255:
        notes.append("POINT:LABELS2 is there though LABELS does not hold 255")
    twice = _twice(labels[:points])
    if twice:
        notes.append(f"labels that stand twice: {some_of(twice)}")
    if first is not None and not _is_utf8(first.data):
        notes.append("labels are not UTF-8; they were read as Latin-1")
    return notes


def _analog_remarks(head: Head) -> list[str]:
    rates = [head.section.numbers(g, "RATE")[:1] for g in ("ANALOG", "POINT")]
    if not all(r.size and np.isfinite(r[0]) and r[0] > 0 for r in rates):
        return []
    ratio = float(rates[0][0] / rates[1][0])
    whole = analog_ratio(head.header, head.section)
    if not count(head.section, "ANALOG", "USED") or abs(ratio - whole) < 1e-6 * ratio:
        return []
    return [
        f"ANALOG:RATE {rates[0][0]:g} is not a whole multiple of POINT:RATE "
        f"{rates[1][0]:g}"
    ]


def _is_utf8(raw: bytes) -> bool:
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def _twice(labels: Sequence[str]) -> list[str]:
    return [name for name, n in Counter(labels).items() if n > 1 and name]


def some_of(names: Sequence[str], most: int = 5) -> str:
    """Return names for a sentence."""
    shown = ", ".join(names[:most])
    return shown + (f" and {len(names) - most} more" if len(names) > most else "")
