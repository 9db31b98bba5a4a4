"""The parameter section of a C3D file: read leniently, rewritten byte for byte.

A section is four bytes (the last two: its length in blocks of 512 bytes and the
processor), then entries one after another until one whose name has no length::

    int8    length of the name; negative when the entry is locked
    int8    group: -g for the group g itself, +g for a parameter in it
    bytes   name
    uint16  distance from here to the next entry, 0 after the last
    -- a parameter only --
    int8    kind: -1 characters, 1 bytes, 2 integers of 16 bits, 4 floats
    uint8   number of dimensions, then one byte for each, the fastest first
    bytes   values
    -- both --
    uint8   length of the description, then the description

Every entry keeps its raw bytes, so that a section nobody edits is written as it was,
with its locks, gaps, odd names and whatever follows its end. What a name stands for is
looked up without regard to case; where two entries have one name the first counts.
"""

import struct
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Floats
from handclean.io.c3d.numbers import Processor, floats_at, shorts_at
from handclean.remarks import Remark, remark

BLOCK_BYTES = 512
"""[bytes] that a C3D's sections are counted in (C3D format)."""

MOST_PARAMETER_BLOCKS = 255
"""Blocks of a parameter section: its length is one byte (C3D format)."""

CHARACTERS, BYTES, SHORTS, FLOATS = -1, 1, 2, 4
"""Types of parameters (C3D format)."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One group or parameter, decoded as far as its bytes allow.

    ``raw`` reaches to the next entry. ``data`` may be shorter than the dimensions ask
    for when the entry is ``cut``. An entry is ``lost`` when its distance to the next
    leads out of the section; it ends where its own content does.
    """

    raw: bytes
    name: str
    group: int
    is_group: bool
    locked: bool
    kind: int = 0
    dims: tuple[int, ...] = ()
    data: bytes = b""
    description: bytes = b""
    cut: bool = False
    lost: bool = False


@dataclass(frozen=True, kw_only=True)
class Section:
    """A parameter section.

    ``lead`` are its first four bytes, ``rest`` what follows the last entry that could
    be read; ``remarks`` tell what is wrong with it.
    """

    processor: Processor
    lead: bytes
    entries: tuple[Entry, ...]
    rest: bytes = b""
    remarks: tuple[Remark, ...] = ()

    def group_name(self, group: int) -> str:
        """Name of a group by its number."""
        for entry in self.entries:
            if entry.is_group and entry.group == group:
                return entry.name
        return f"GROUP_{group}"

    def find(self, group: str, name: str) -> Entry | None:
        """Return the first parameter of that name."""
        groups = {
            e.group for e in self.entries if e.is_group and same_name(e.name, group)
        }
        for entry in self.entries:
            if (
                not entry.is_group
                and entry.group in groups
                and same_name(entry.name, name)
            ):
                return entry
        return None

    def numbers(self, group: str, name: str, unsigned: bool = False) -> Floats:
        """Values of a numeric parameter, flat; empty when there are none."""
        entry = self.find(group, name)
        return np.zeros(0) if entry is None else self.values(entry, unsigned)

    def values(self, entry: Entry, unsigned: bool = False) -> Floats:
        """Numbers of an entry, flat, as float64; empty for characters."""
        with np.errstate(invalid="ignore"):  # a signalling NaN
            return numbers_of(entry, self.processor, unsigned).astype(np.float64)

    def strings(self, group: str, name: str) -> list[str]:
        """Strings of a parameter and of its continuations NAME2, NAME3 ..."""
        found: list[str] = []
        for number in range(1, 65536 // 255 + 2):
            entry = self.find(group, f"{name}{number}" if number > 1 else name)
            if entry is None:
                break
            found += strings_of(entry)
        return found


def same_name(name: str, other: str) -> bool:
    """Whether two names stand for the same group or parameter."""
    return name.upper() == other.upper()


def text(raw: bytes) -> str:
    """Characters of a file: UTF-8, else Latin-1; stripped, cut at the first NUL."""
    raw = raw.strip(b" \0\t\r\n").split(b"\0")[0]
    try:
        return raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        return raw.decode("latin-1").strip()


def strings_of(entry: Entry) -> list[str]:
    """Strings of a parameter of characters: the first dimension is their width."""
    if entry.kind != CHARACTERS:
        return []
    width = entry.dims[0] if entry.dims else 1
    if width == 0:
        return []
    return [
        text(entry.data[at : at + width]) for at in range(0, len(entry.data), width)
    ]


def numbers_of(
    entry: Entry, processor: Processor, unsigned: bool = False
) -> NDArray[Any]:
    """Numbers of an entry, flat, in their own type; empty for characters."""
    if entry.kind == BYTES:
        return np.frombuffer(entry.data, np.uint8)
    if entry.kind == SHORTS:
        values = shorts_at(entry.data, processor)
        return values.view(np.uint16) if unsigned else values
    if entry.kind == FLOATS:
        return floats_at(entry.data, processor)
    return np.zeros(0)


def parse_section(raw: bytes, processor: Processor) -> Section:
    """Read as many entries as can be read; never fails.

    Parameters
    ----------
    raw : the section and what follows it, up to the data.
    """
    entries: list[Entry] = []
    remarks: list[Remark] = []
    at = 4
    while at + 2 <= len(raw) and raw[at] != 0:
        entry = _parse_entry(raw, at, processor)
        if entry is None:
            remarks.append(
                remark(
                    "damage", f"the parameter section cannot be read from byte {at} on"
                )
            )
            break
        entries.append(entry)
        at += len(entry.raw)
        if distance_of(entry.raw) == b"\0\0":
            break
    else:
        if at + 2 > len(raw):
            remarks.append(remark("damage", "the parameter section has no end mark"))
    section = Section(
        processor=processor, lead=raw[:4], entries=tuple(entries), rest=raw[at:]
    )
    for entry in entries:
        where = f"{section.group_name(entry.group)}:{entry.name}"
        if entry.cut:
            remarks.append(
                remark("damage", f"{where} is cut short or of an unknown kind")
            )
        if entry.lost:
            remarks.append(
                remark(
                    "damage", f"{where} says that the next entry is outside the section"
                )
            )
    return replace(section, remarks=tuple(remarks))


def offset_at(raw: bytes) -> int:
    """Where an entry keeps the distance to the next."""
    (length,) = struct.unpack_from("b", raw)
    return 2 + abs(int(length))


def distance_of(raw: bytes) -> bytes:
    """Distance to the next entry, as it lies in the file."""
    at = offset_at(raw)
    return raw[at : at + 2]


def _parse_entry(raw: bytes, at: int, processor: Processor) -> Entry | None:
    """Entry at a byte, or None when it does not hold together."""
    length, group = struct.unpack_from("bb", raw, at)
    distance_at = at + 2 + abs(length)
    order = ">" if processor is Processor.MIPS else "<"
    if distance_at + 2 > len(raw):
        return None
    (distance,) = struct.unpack_from(order + "H", raw, distance_at)
    lost = distance == 1 or distance_at + distance > len(raw)
    open_end = lost or distance == 0
    limit = len(raw) if open_end else distance_at + distance
    where, kind, data, cut = distance_at + 2, 0, b"", False
    dims: tuple[int, ...] = ()
    is_group = group < 0
    if not is_group:
        if where + 2 > limit:
            return None
        (kind,) = struct.unpack_from("b", raw, where)
        count = raw[where + 1]
        dims = tuple(raw[where + 2 : min(where + 2 + count, limit)])
        where += 2 + count
        size = abs(kind) * prod(dims)
        cut = where + size > limit or len(dims) < count or kind not in (-1, 1, 2, 4)
        data = raw[where : min(where + size, limit)]
        where = min(where + size, limit)
    words = raw[where] if where < limit else 0
    description = raw[where + 1 : min(where + 1 + words, limit)]
    if lost and (cut or where >= limit):
        return None
    after = min(where + 1 + words, limit) if open_end else limit
    return Entry(
        raw=raw[at:after],
        name=text(raw[at + 2 : distance_at]),
        lost=lost,
        group=abs(group),
        is_group=is_group,
        locked=length < 0,
        kind=kind,
        dims=dims,
        data=data,
        description=description,
        cut=cut,
    )


def plain_values(section: Section) -> dict[str, dict[str, Any]]:
    """Parameters for people: strings, numbers and arrays by group and name.

    Arrays have the file's dimensions in reverse, so that the fastest is the last. Names
    are free of what a path could trip over; empty parameters are left out.
    """
    groups: dict[str, dict[str, Any]] = {}
    for entry in section.entries:
        if entry.is_group:
            continue
        value = _plain_value(entry, section.processor)
        if value is not None:
            group = groups.setdefault(_plain_name(section.group_name(entry.group)), {})
            group.setdefault(_plain_name(entry.name), value)
    return groups


def _plain_name(name: str) -> str:
    printable = "".join(c if c.isprintable() and c != "/" else "_" for c in name)
    return printable if printable.strip(". ") else "_" + printable


def _plain_value(entry: Entry, processor: Processor) -> Any:
    if entry.kind == CHARACTERS:
        strings = strings_of(entry)
        if not strings:
            return None
        return strings[0] if len(entry.dims) < 2 else strings
    values = numbers_of(entry, processor)
    if not values.size:
        return None
    if not entry.dims:
        return values[0].item()
    if prod(entry.dims) == values.size:
        return values.reshape(entry.dims[::-1])
    return values
