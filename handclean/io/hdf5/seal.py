"""A seal in an HDF5 file: the digest of all its bytes, by which a change is noticed.

The dataset ``sha256`` of the root holds 32 bytes. The digest is of the file with zeros
in their place, so that it can be told before it is written, and again later.
It is a dataset, as HDF5 keeps no checksum over the values of one. Who edits a file
deletes it; a file without one is read as it is.

The user block, the first 512 bytes, which are not HDF5's, says in one line where in the
file the seal and the texts of ``provenance`` are: so that a file can be known again
without the HDF5 library, which takes long to load and may hang.
"""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from handclean.errors import FileError
from handclean.io.hdf5 import walker
from handclean.io.hdf5.walk import SEAL as NAME
from handclean.remarks import Remark, remark

BLOCK_BYTES = 512
"""[bytes] of the user block, the least that HDF5 allows."""

_MARK = b"handclean"
_EMPTY = bytes(32)
_PIECE_BYTES = 2**20
"""[bytes] that are read at once (chosen)."""

_MOST_PROVENANCE_BYTES = 2**26
"""[bytes] of provenance that is read (chosen)."""

_NOTED: ContextVar[list[Remark] | None] = ContextVar("noted", default=None)


@dataclass(frozen=True)
class _Head:
    """What the user block says: where the seal is, and the texts of provenance."""

    seal: int
    at: int = 0
    size: int = 0  # [bytes] of each, padded with zeros
    count: int = 0

    def block(self) -> bytes:
        numbers = (self.seal, self.at, self.size, self.count)
        line = b" ".join([_MARK, *(b"%d" % number for number in numbers)]) + b"\n"
        return line.ljust(BLOCK_BYTES, b"\0")


def put(file: h5py.File) -> bytes:
    """Make room for the seal; return the user block."""
    data = np.frombuffer(_EMPTY, np.uint8)
    dataset = file.create_dataset(NAME, data=data, track_times=False)
    dataset.attrs.create("units", b"", dtype=h5py.string_dtype("utf-8", 1))
    file.flush()
    at = dataset.id.get_offset()
    assert isinstance(at, int), "its values stand in one piece"
    told = file.get("provenance")
    if not isinstance(told, h5py.Dataset) or told.dtype.kind != "S":
        return _Head(at).block()
    place = told.id.get_offset() or 0
    return _Head(at, place, told.dtype.itemsize, told.size).block()


def write(path: Path, image: bytes, head: bytes) -> None:
    """Write a file whose seal is still empty, sealed.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    whole, at = memoryview(image), _read(head).seal - len(head)
    digest = hashlib.sha256(head)
    digest.update(whole)
    with path.open("wb") as file:
        for part in (head, whole[:at], digest.digest(), whole[at + len(_EMPTY) :]):
            file.write(part)


def renew(path: Path) -> None:
    """Seal a sealed file again, after more was written into it.

    Raises
    ------
    OSError
        If it cannot be read or written.
    """
    with path.open("r+b") as raw:
        at = _read(raw.read(BLOCK_BYTES)).seal
        digest = _digest(raw.fileno(), at)
        raw.seek(at)
        raw.write(digest)


def intact(path: Path) -> bool | None:
    """Whether a file is as it was written; None if it has no seal to tell by.

    Raises
    ------
    OSError, FileError
        If it cannot be read.
    """
    with path.open("rb") as raw:
        with suppress(ValueError):
            if _is_whole(raw.fileno(), _read(raw.read(BLOCK_BYTES)).seal):
                return True
        at = walker.walked(path, only="")[0]["seal"]
        return None if at is None else _is_whole(raw.fileno(), at)


def provenance(path: Path) -> list[bytes] | None:
    """Texts of provenance of a file that says where they are; None if it does not.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with path.open("rb") as raw:
        try:
            head = _read(raw.read(BLOCK_BYTES))
        except ValueError:
            return None
        if not 0 <= head.size * head.count <= _MOST_PROVENANCE_BYTES:
            return None
        raw.seek(head.at)
        return [raw.read(head.size).rstrip(b"\0") for _ in range(head.count)]


@contextmanager
def tolerated(lenient: bool) -> Iterator[list[Remark]]:
    """Within, a broken seal is noted where it would be an error, if ``lenient``.

    One step reads takes, subjects and calibrations in many places: hence it is not
    handed from function to function.
    """
    noted: list[Remark] = []
    outer = _NOTED.get()
    token = _NOTED.set(noted if lenient else outer)
    try:
        yield noted
    finally:
        _NOTED.reset(token)
        if outer is not None:
            outer += [one for one in noted if one not in outer]


def expect_whole(path: Path, fd: int, at: int) -> None:
    """Expect the bytes of an open file to be those that were sealed.

    Raises
    ------
    FileError
        If they are not, and that is not `tolerated`.
    """
    if _is_whole(fd, at):
        return
    noted = _NOTED.get()
    if noted is None:
        wrong = f"is damaged or was edited: its bytes do not fit its /{NAME}"
        right = f"who edited it deletes /{NAME}; --lenient reads it as it is"
        raise FileError(path, wrong, right)
    text = f"{path.name} is damaged or was edited: its bytes do not fit its /{NAME}"
    if not any(_is_same(path, one.where.file) for one in noted):
        noted.append(remark("damage", text, file=path))


def _is_same(path: Path, other: Path | None) -> bool:
    """Whether two paths are of one file, however they are written."""
    return other is not None and os.path.realpath(path) == os.path.realpath(other)


def _read(block: bytes) -> _Head:
    """What a user block says.

    Raises
    ------
    ValueError
        If it is none of ours.
    """
    mark, *numbers = block.split(b"\n")[0].split(b" ")
    if mark != _MARK or len(numbers) != 4 or not all(n.isdigit() for n in numbers):
        raise ValueError("no user block of handclean")
    return _Head(*(int(number[:18]) for number in numbers))


def _is_whole(fd: int, at: int) -> bool:
    return os.pread(fd, len(_EMPTY), at) == _digest(fd, at)


def _digest(fd: int, at: int) -> bytes:
    """Digest of a file as if its seal were empty."""
    found = hashlib.sha256()
    done = 0
    while piece := os.pread(fd, _PIECE_BYTES, done):
        first, last = max(at - done, 0), min(at + len(_EMPTY) - done, len(piece))
        if first < last:
            found.update(piece[:first])
            found.update(_EMPTY[: last - first])
            found.update(piece[last:])
        else:
            found.update(piece)
        done += len(piece)
    return found.digest()
