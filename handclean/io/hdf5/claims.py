"""What an HDF5 dataset says of its size, and what is stored of it."""

from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

_MOST_DEFLATE_RATIO = 1100
"""Deflate makes nothing more than 1032 times smaller (zlib's technical details)."""


@dataclass(frozen=True)
class Claim:
    """What a dataset says of its size, and what is stored of it."""

    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    itemsize: int
    table: Any
    stored: int

    @property
    def chunks(self) -> int:
        """How many chunks there can be."""
        pairs = zip(self.shape, self.chunk, strict=True)
        return prod(-(-size // step) for size, step in pairs)

    @property
    def claimed(self) -> int:
        """[bytes] of its numbers, up to whole chunks."""
        if self.table is None:
            return prod(self.shape) * self.itemsize
        return max(self.chunks, 1) * prod(self.chunk) * self.itemsize

    def held(self, size: int) -> int:
        """[bytes] that can be stored of it in a file of some size."""
        if self.table is None:
            return min(self.stored, size)
        return _MOST_DEFLATE_RATIO * min(int(self.table[:, -1].sum()), size)


def chunk_table(stored: Any, shape: tuple[int, ...]) -> Any:
    """(N, axes + 3) offset, left-out filters, place and size of each chunk."""
    rows: list[tuple[int, ...]] = []

    def note(chunk: Any) -> None:
        place = (chunk.filter_mask, chunk.byte_offset, chunk.size)
        rows.append((*chunk.chunk_offset, *place))

    if prod(shape):
        stored.chunk_iter(note)
    rows.sort()
    return np.array(rows, dtype=np.int64).reshape(-1, len(shape) + 3)
