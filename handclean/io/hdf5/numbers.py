"""The numbers of an HDF5 dataset, read without HDF5: where they lie is known.

`handclean.io.hdf5.walk` found out, in another process, where in the file the values or
their chunks are. What is left is to read bytes and to undo the standard filters:
deflate, shuffle (all first bytes of the numbers, then all second bytes, ...) and a
Fletcher checksum. No call of the HDF5 library may hang here, and a signal is heeded.
"""

import os
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.errors import FileError, Place

_DEFLATE, _SHUFFLE, _FLETCHER = 1, 2, 3
"""Numbers of filters (HDF5)."""

_PIECE_BYTES = 2**22
"""[bytes] that are read from a file at once (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Stored:
    """Where the numbers of a dataset are.

    Attributes
    ----------
    path : the file; where : file and dataset, for messages.
    found : what the walk says of the dataset; blocks : of bytes that it refers to.
    state : of the file when it was walked.
    """

    path: Path
    where: Place
    found: Mapping[str, Any]
    blocks: Sequence[bytes]
    state: Sequence[int] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Its shape."""
        return tuple(self.found["shape"])

    @property
    def dtype(self) -> np.dtype[Any]:
        """Its type."""
        kind: np.dtype[Any] = np.dtype(self.found["dtype"])
        return kind

    def whole(self, fd: int) -> NDArray[Any]:
        """All its numbers.

        Raises
        ------
        FileError
            If they are not where they should be, or damaged.
        """
        out = np.zeros(self.shape, dtype=self._kept)
        if "raw" in self.found:
            raw = self.blocks[self.found["raw"]]
            out = np.frombuffer(raw, self._kept).reshape(self.shape).copy()
        elif "table" in self.found:
            self._fill(out)
            for row in self._table:
                self._put(fd, row, out, 0)
        elif out.size:
            self._straight(fd, self.found["at"], out)
        return self._as_stated(out)

    def bands(self, fd: int, rows: int) -> Iterator[NDArray[Any]]:
        """Go through its numbers, about so many rows of the first axis at a time.

        Raises
        ------
        FileError
            If they are not where they should be, or damaged.
        """
        if "raw" in self.found:
            yield self.whole(fd)
            return
        if "table" in self.found:
            tall = self.found["chunk"][0]
            rows = max(1, rows // tall) * tall
        for begin in range(0, self.shape[0], rows):
            count = min(rows, self.shape[0] - begin)
            out = np.zeros((count, *self.shape[1:]), dtype=self._kept)
            if "table" in self.found:
                self._fill(out)
                ends = np.searchsorted(self._table[:, 0], [begin, begin + rows])
                for row in self._table[slice(*ends)]:
                    self._put(fd, row, out, begin)
            elif out.size:
                at = self.found["at"] + begin * out[:1].nbytes
                self._straight(fd, at, out)
            yield self._as_stated(out)

    @property
    def _kept(self) -> np.dtype[Any]:
        """How its bytes are taken: truth values as what they are stored as."""
        return np.dtype(np.uint8) if self.dtype.kind == "b" else self.dtype

    def _as_stated(self, out: NDArray[Any]) -> NDArray[Any]:
        return out != 0 if self.dtype.kind == "b" else out

    @property
    def _table(self) -> NDArray[np.int64]:
        block = self.blocks[self.found["table"]]
        return np.frombuffer(block, np.int64).reshape(-1, len(self.shape) + 3)

    def _fill(self, out: NDArray[Any]) -> None:
        """Set what no chunk holds."""
        fill = np.frombuffer(self.blocks[self.found["fill"]], self._kept)[0]
        if fill != 0:
            out[...] = fill

    def _straight(self, fd: int, at: int, out: NDArray[Any]) -> None:
        """Read values that lie one after another."""
        view = out.reshape(-1).view(np.uint8).data
        done = 0
        while done < len(view):
            got = os.preadv(fd, [view[done : done + _PIECE_BYTES]], at + done)
            if not got:
                raise FileError(self.where, "is cut off", "the file is damaged")
            done += got

    def _put(
        self, fd: int, row: NDArray[np.int64], out: NDArray[Any], begin: int
    ) -> None:
        """Read a chunk and put it in its place, up to the edges."""
        offset = row[:-3].tolist()
        mask, at, size = row[-3:].tolist()
        shape = self.found["chunk"]
        values = self._unpacked(os.pread(fd, size, at), size, mask)
        chunk = values.view(self._kept).reshape(shape)
        offset[0] -= begin
        there = tuple(
            slice(start, min(start + n, end))
            for start, n, end in zip(offset, shape, out.shape, strict=True)
        )
        if any(part.start >= part.stop for part in there):
            return  # beyond the edges
        out[there] = chunk[tuple(slice(0, p.stop - p.start) for p in there)]

    def _unpacked(self, raw: bytes, size: int, mask: int) -> NDArray[np.uint8]:
        """Bytes of a chunk, the filters undone from the last to the first."""
        wanted = prod(self.found["chunk"]) * self._kept.itemsize
        if len(raw) != size:
            raise FileError(self.where, "is cut off", "the file is damaged")
        values = np.frombuffer(raw, np.uint8)
        for number, (kind, *given) in reversed(list(enumerate(self.found["filters"]))):
            if mask >> number & 1:
                continue
            if kind == _DEFLATE:
                values = self._inflated(values, wanted + wanted // 64 + 1024)
            elif kind == _SHUFFLE:
                values = _unshuffled(values, given[0] if given else 1)
            elif kind == _FLETCHER:
                values = self._summed(values)
        if len(values) != wanted:
            raise FileError(self.where, "a chunk has another size", "it is damaged")
        return values

    def _inflated(self, values: NDArray[np.uint8], room: int) -> NDArray[np.uint8]:
        try:
            out = zlib.decompressobj().decompress(values.data, room)
        except zlib.error:
            raise FileError(self.where, "a chunk cannot be unpacked") from None
        return np.frombuffer(out, np.uint8)

    def _summed(self, values: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Take a checksum off and compare it."""
        kept, rest = values[-4:], values[:-4]
        told = int.from_bytes(kept.tobytes(), "little")
        found = _fletcher32(rest)
        swapped = (told & 0x00FF00FF) << 8 | (told >> 8 & 0x00FF00FF)  # HDF5 1.6.2
        if len(kept) < 4 or found not in (_modulo(told), _modulo(swapped)):
            raise FileError(self.where, "a chunk's checksum is wrong", "it is damaged")
        return rest


def _unshuffled(values: NDArray[np.uint8], size: int) -> NDArray[np.uint8]:
    """Put the bytes of each number together; what is left over stays at the end."""
    count = len(values) // size if size > 1 else 0
    if count < 2:
        return values
    out = np.zeros(len(values), np.uint8)
    planes = values[: count * size].reshape(size, count)
    numbers = out[: count * size].reshape(count, size)
    for place, plane in enumerate(planes):  # in half the time of a transposed copy
        numbers[:, place] = plane
    out[count * size :] = values[count * size :]
    return out


def _fletcher32(values: NDArray[np.uint8]) -> tuple[int, int]:
    """Both sums over big-endian words of 16 bits, modulo 65535."""
    even = values if len(values) % 2 == 0 else np.append(values, np.uint8(0))
    words = even.view(">u2").astype(np.uint64)
    behind = np.arange(len(words), 0, -1, dtype=np.uint64) % 65535
    return int(words.sum() % 65535), int((words * behind).sum() % 65535)


def _modulo(checksum: int) -> tuple[int, int]:
    return (checksum & 0xFFFF) % 65535, (checksum >> 16) % 65535
