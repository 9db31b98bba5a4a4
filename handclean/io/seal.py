"""A seal in an HDF5 file: the digest of all its bytes, by which an edit is noticed.

The dataset ``sha256`` of the root holds 32 bytes. The digest is of the file with zeros
in their place, so that it can be told before it is written, and again later.
It is a dataset, as HDF5 keeps no checksum over the values of one.
"""

import hashlib
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np

NAME = "sha256"
"""Of the dataset, in the root of the file."""

_EMPTY = bytes(32)
_PIECE = 2**20
"""[bytes] that are read at once."""


def put(file: h5py.File) -> int:
    """Make room for the seal; return where in the file it is [bytes]."""
    data = np.frombuffer(_EMPTY, np.uint8)
    dataset = file.create_dataset(NAME, data=data, track_times=False)
    dataset.attrs.create("units", b"", dtype=h5py.string_dtype("utf-8"))
    file.flush()
    at = dataset.id.get_offset()
    assert isinstance(at, int), "its values stand in one piece"
    return at


def write(path: Path, image: bytes, at: int) -> None:
    """Write a file whose seal is still empty, sealed.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    whole = memoryview(image)
    seal = hashlib.sha256(whole).digest()
    with path.open("wb") as file:
        for part in (whole[:at], seal, whole[at + len(_EMPTY) :]):
            file.write(part)


def renew(path: Path) -> None:
    """Seal a sealed file again, after more was written into it.

    Raises
    ------
    OSError
        If it cannot be read or written.
    """
    with h5py.File(path, "r", locking=False) as file:
        at = file[NAME].id.get_offset()
    with path.open("r+b") as raw:
        digest = _digest(raw, at)
        raw.seek(at)
        raw.write(digest)


def intact(path: Path) -> bool | None:
    """Whether a file is as it was written; None if it has no seal to tell by.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with h5py.File(path, "r", locking=False) as file:
        if not isinstance(file.get(NAME, getlink=True), h5py.HardLink):
            return None
        dataset = file[NAME]
        if not isinstance(dataset, h5py.Dataset) or dataset.dtype != np.uint8:
            return None
        if dataset.shape != (len(_EMPTY),) or dataset.id.get_offset() is None:
            return None
        at: int = dataset.id.get_offset()
        kept: bytes = dataset[()].tobytes()
    with path.open("rb") as raw:
        return _digest(raw, at) == kept


def _digest(raw: BinaryIO, at: int) -> bytes:
    """Digest of a file as if its seal were empty."""
    found = hashlib.sha256()
    left = at
    while left and (piece := raw.read(min(left, _PIECE))):
        found.update(piece)
        left -= len(piece)
    raw.seek(len(_EMPTY), 1)
    found.update(_EMPTY)
    while piece := raw.read(_PIECE):
        found.update(piece)
    return found.digest()
