"""A mesh as its file holds it, before units and checks; and what parsers share."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Bytes, Floats, Ints


@dataclass(frozen=True)
class RawMesh:
    """What a file of a mesh or a point cloud holds.

    Attributes
    ----------
    vertices : (V, 3) in the file's unit.
    faces : (F, 3), polygons cut into triangles; F may be 0.
    normals : (V, 3) or None.
    colors : (V, 3) or None.
    unit : as a comment says, or "".
    """

    vertices: Floats
    faces: Ints
    normals: Floats | None
    colors: Bytes | None
    unit: str


def as_bytes(colors: NDArray[Any]) -> Bytes:
    """(V, 3) colours of any kind as 0 to 255; fractions count from 0 to 1."""
    if colors.dtype == np.uint8:
        return np.ascontiguousarray(colors)
    values = np.nan_to_num(colors.astype(np.float64), posinf=0.0, neginf=0.0)
    if colors.dtype == np.uint16:
        values = values / 257.0
    elif colors.dtype.kind == "f" and (not values.size or values.max() <= 1.0):
        values = values * 255.0
    out: Bytes = np.clip(np.rint(values), 0, 255).astype(np.uint8)
    return out


def triangles(lists: NDArray[Any] | list[Any]) -> Ints:
    """(F, 3) triangles of polygons, (N, S) or N lists, each cut into a fan."""
    if not len(lists):
        return np.zeros((0, 3), dtype=np.int64)
    if not isinstance(lists, np.ndarray):
        sizes = np.array([len(row) for row in lists])
        parts = [
            _fan(np.array([row for row in lists if len(row) == size]))
            for size in np.unique(sizes)
        ]
        rank = np.argsort(np.repeat(*_fan_rows(sizes)), kind="stable")
        return np.concatenate(parts)[rank]
    return _fan(lists.reshape(len(lists), -1))


def _fan_rows(sizes: Ints) -> tuple[Ints, Ints]:
    """Places of the polygons, ordered by their size, and how many triangles each."""
    by_size = np.argsort(sizes, kind="stable")
    return by_size, np.maximum(sizes[by_size] - 2, 0)


def _fan(polygons: NDArray[Any]) -> Ints:
    """(N * (S - 2), 3) triangles of (N, S) polygons, in their order."""
    size = polygons.shape[1]
    if size < 3:
        return np.zeros((0, 3), dtype=np.int64)
    corners = [polygons[:, [0, k, k + 1]] for k in range(1, size - 1)]
    fans = np.stack(corners, axis=1).reshape(-1, 3)
    with np.errstate(invalid="ignore"):
        out: Ints = fans.astype(np.int64)
    return out
