"""Changing the parameter section of a C3D file and leaving every other byte of it.

Sections are not changed in place: each function returns a new one.
"""

import struct
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.io.c3d.numbers import Processor, words_from_floats, words_from_shorts
from handclean.io.c3d.parameters import (
    BLOCK_BYTES,
    CHARACTERS,
    FLOATS,
    MOST_PARAMETER_BLOCKS,
    SHORTS,
    Entry,
    Section,
    offset_at,
    same_name,
)


def with_strings(
    section: Section, group: str, name: str, strings: Sequence[str], width: int = 1
) -> Section:
    """Set a parameter of strings: 255 to a parameter, the rest in NAME2, NAME3 ...

    Strings are UTF-8, padded by bytes to the widest of them and at least ``width``.
    """
    coded = [_coded(s) for s in strings]
    width = max([width, *map(len, coded)])
    parts = [coded[at : at + 255] for at in range(0, len(coded), 255)] or [[]]
    for number, part in enumerate(parts, start=1):
        data = b"".join(s.ljust(width) for s in part)
        key = f"{name}{number}" if number > 1 else name
        section = with_parameter(
            section, group, key, CHARACTERS, (width, len(part)), data
        )
    number = len(parts) + 1
    while (spare := section.find(group, f"{name}{number}")) is not None:
        section = replace(
            section, entries=tuple(e for e in section.entries if e is not spare)
        )
        number += 1
    return section


def _coded(value: str) -> bytes:
    """UTF-8 of at most 255 bytes, cut between characters."""
    return value.encode("utf-8", "replace")[:255].decode("utf-8", "ignore").encode()


def with_text(section: Section, group: str, name: str, value: str) -> Section:
    """Set a parameter that is one string."""
    data = _coded(value)
    return with_parameter(section, group, name, CHARACTERS, (len(data),), data)


def with_shorts(
    section: Section,
    group: str,
    name: str,
    values: Sequence[int] | int,
    dims: tuple[int, ...] | None = None,
) -> Section:
    """Set 16-bit integers, given unsigned; one number has no dimension."""
    if dims is None:
        dims = () if isinstance(values, int) else (len(values),)
    signed = np.atleast_1d(np.array(values, np.uint16)).view(np.int16)
    data = words_from_shorts(signed, section.processor).tobytes()
    return with_parameter(section, group, name, SHORTS, dims, data)


def with_floats(
    section: Section,
    group: str,
    name: str,
    values: Floats | Sequence[float] | float,
    dims: tuple[int, ...] | None = None,
) -> Section:
    """Set floats; one number has no dimension."""
    flat = np.atleast_1d(np.asarray(values, np.float32)).ravel()
    if dims is None:
        dims = () if isinstance(values, float) else (len(flat),)
    data = words_from_floats(flat, section.processor).tobytes()
    return with_parameter(section, group, name, FLOATS, dims, data)


def with_parameter(
    section: Section,
    group: str,
    name: str,
    kind: int,
    dims: tuple[int, ...],
    data: bytes,
) -> Section:
    """Set a parameter, keeping the name's spelling, lock and description it has.

    A new one goes behind the last of its group, a new group behind everything.
    """
    old = section.find(group, name)
    if old is not None:
        new = replace(old, kind=kind, dims=dims, data=data)
        new = replace(new, raw=_entry_bytes(new, section.processor, _raw_name(old)))
        entries = tuple(new if e is old else e for e in section.entries)
        return replace(section, entries=entries)
    section, number = _with_group(section, group)
    new = Entry(
        raw=b"",
        name=name,
        group=number,
        is_group=False,
        locked=False,
        kind=kind,
        dims=dims,
        data=data,
    )
    new = replace(new, raw=_entry_bytes(new, section.processor, name.encode()))
    last = max(i for i, e in enumerate(section.entries) if e.group == number)
    entries = (*section.entries[: last + 1], new, *section.entries[last + 1 :])
    return replace(section, entries=entries)


def without_group(section: Section, group: str) -> Section:
    """Remove all groups of a name with what is in them."""
    gone = {e.group for e in section.entries if e.is_group and same_name(e.name, group)}
    if not gone:
        return section
    kept = tuple(entry for entry in section.entries if entry.group not in gone)
    return replace(section, entries=kept)


def _with_group(section: Section, group: str) -> tuple[Section, int]:
    """Return the section with a group of that name, and its number."""
    for entry in section.entries:
        if entry.is_group and same_name(entry.name, group) and entry.group < 128:
            return section, entry.group
    taken = {e.group for e in section.entries}
    number = next((n for n in range(1, 128) if n not in taken), 0)
    if not number:
        raise FileError("C3D", "all 127 groups of parameters are taken")
    new = Entry(raw=b"", name=group, group=number, is_group=True, locked=False)
    new = replace(new, raw=_entry_bytes(new, section.processor, group.encode()))
    return replace(section, entries=(*section.entries, new)), number


def _raw_name(entry: Entry) -> bytes:
    return entry.raw[2 : offset_at(entry.raw)]


def _entry_bytes(entry: Entry, processor: Processor, name: bytes) -> bytes:
    """Bytes of an entry whose next one follows at once."""
    body = b""
    if not entry.is_group:
        body = struct.pack("bB", entry.kind, len(entry.dims)) + bytes(entry.dims)
        body += entry.data
    body += bytes([len(entry.description)]) + entry.description
    order = ">" if processor is Processor.MIPS else "<"
    length = -len(name) if entry.locked else len(name)
    group = -entry.group if entry.is_group else entry.group
    lead = struct.pack("bb", length, group)
    return lead + name + struct.pack(order + "H", 2 + len(body)) + body


def edited_bytes(section: Section, room: int) -> bytes:
    """Bytes of an edited section in whole blocks, at least ``room`` bytes long.

    What stood behind the last entry is not part of it any more.

    Raises
    ------
    FileError
        If it is longer than the format allows.
    """
    order = ">" if section.processor is Processor.MIPS else "<"
    raws = []
    for raw in (e.raw for e in section.entries):
        at = offset_at(raw)
        far = struct.pack(order + "H", len(raw) - at)
        raws.append(raw[:at] + far + raw[at + 2 :])
    body = b"".join(raws) + b"\0\0"
    blocks = -(-(4 + len(body)) // BLOCK_BYTES)
    if blocks > MOST_PARAMETER_BLOCKS:
        raise FileError(
            "C3D",
            f"labels and parameters take {blocks} blocks of {BLOCK_BYTES} bytes",
            f"the format has room for {MOST_PARAMETER_BLOCKS}",
        )
    size = max(room, blocks * BLOCK_BYTES)
    length = bytes([min(size // BLOCK_BYTES, MOST_PARAMETER_BLOCKS)])
    lead = section.lead[:2] + length + section.lead[3:4]
    return (lead + body).ljust(size, b"\0")
