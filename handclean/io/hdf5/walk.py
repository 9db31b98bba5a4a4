"""Walk an HDF5 file: its structure, attributes and texts, and where its numbers lie.

This runs in a process of its own (`handclean.io.hdf5.serve`), as the HDF5 library may
crash or never come back over a damaged file. What it finds goes back as JSON and plain
bytes, which whoever asked takes as data: nothing is unpickled.

Nothing is trusted: no links to elsewhere, no external or virtual storage, no filter but
the standard ones (a plug-in would be code), no Python objects, and no more memory than
`most` allows a file of that size, nor than its stored bytes could hold if packed.

A group becomes ``{"attrs", "items"}``, where an item is a group or a dataset. A dataset
has ``attrs`` and either ``text`` (one) or ``texts``, or else ``shape``, ``dtype`` and
one of

- ``at``: where in the file its values begin [bytes];
- ``raw``: which of the answer's blocks of bytes they are;
- ``table``: the block with a row for each chunk (offset along each axis, filters that
  were left out, where it begins, its size; all int64), with ``chunk`` (its shape),
  ``filters`` (number and first parameter) and ``fill`` (block with one value).
"""

import os
from collections.abc import Callable
from itertools import islice
from math import prod
from typing import Any, BinaryIO

import h5py
import numpy as np

from handclean.io.hdf5.claims import Claim, chunk_table

SEAL = "sha256"
"""Dataset of the root that is no content, see `handclean.io.hdf5.seal`."""

_TEXTS_AT_ONCE = 64
"""Texts are read so many at a time; each may be as long as the file (chosen)."""

_DEEPEST_GROUP, _MOST_NAMES = 16, 1000
"""Groups within groups, and names of the root that are listed, at most (chosen)."""

_MOST_OBJECTS = 50_000
_MOST_ATTRS = 4 * _MOST_OBJECTS
"""Groups and datasets of a file, and their attributes, at most (chosen)."""

_MOST_AXES, _MOST_FILTERS = 8, 4
"""Axes and filters of a dataset, at most (chosen)."""

_FILTERS = {1, 2, 3}  # deflate, shuffle, fletcher32

_MOST_TABLE_VALUES = 256
"""Numbers of an attribute that is a table, at most (chosen)."""

_UNSTORED_BYTES = 2**20
"""[bytes] that a dataset may claim whatever is stored of it (chosen)."""

BROKEN = (
    OSError,
    RuntimeError,
    ValueError,
    LookupError,
    TypeError,
    OverflowError,
    MemoryError,
    AttributeError,
    SystemError,
    NotImplementedError,
)
"""What h5py raises over damaged files."""


def most(size: int) -> int:
    """[bytes] that the arrays of a file of some size may take in all."""
    return 2**24 + 64 * size


class Refused(Exception):
    """What should not be read: where it is, what is wrong, what would be right."""


def walk(
    path: str,
    *,
    only: str | None = None,
    keys: list[str] | None = None,
    begin: Callable[[], None] = lambda: None,
) -> tuple[dict[str, Any], list[bytes]]:
    """Walk a file; return what was found and the blocks of bytes it refers to.

    Parameters
    ----------
    only : go below the root only if its attribute ``format`` is this.
    keys : go below the root only for these; default: all.
    begin : called before each object is looked at.

    Returns
    -------
    ``attrs`` of the root, ``names`` in it, ``root`` (None if not walked), ``seal``
    (where in the file the values of `SEAL` are, or None) and ``file`` (which it was).

    Raises
    ------
    Refused
        If it holds what should not be read.
    OSError and others of `BROKEN`
        If it is damaged.
    """
    with open(path, "rb") as raw, h5py.File(path, "r", locking=False) as file:
        about = os.fstat(raw.fileno())
        found = _Walk(file, raw, about.st_size, begin)
        attrs = found.attrs(file.id, "")
        root = None
        if only is None or attrs.get("format") == only:
            root = found.group(file.id, "", 0, keys)
            root["attrs"] = attrs
        answer = {"attrs": attrs, "root": root, "seal": _seal(file)}
        names = list(islice(file, _MOST_NAMES))
        return {**answer, "names": names, "file": identity(about)}, found.blocks


def identity(about: os.stat_result) -> list[int]:
    """Which file it is, and in which state."""
    return [about.st_dev, about.st_ino, about.st_size, about.st_mtime_ns]


def decoded(raw: bytes) -> str:
    """A text: UTF-8, else Latin-1 as older programs write it."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


class _Walk:
    """Walks one file and keeps account of what it claims."""

    def __init__(
        self, file: h5py.File, raw: BinaryIO, size: int, begin: Callable[[], None]
    ) -> None:
        self._begin = begin
        self.blocks: list[bytes] = []
        self._raw = raw
        self._size = size
        self._base = file.userblock_size
        self._left = most(size)
        self._objects = _MOST_OBJECTS
        self._attrs = _MOST_ATTRS

    def group(
        self, group: Any, where: str, depth: int, keys: list[str] | None = None
    ) -> dict[str, Any]:
        """Walk a group and all below it, or only some keys of it.

        Groups, datasets and attributes are those of HDF5 itself here, not h5py's, which
        ask the library again for every property.
        """
        if depth > _DEEPEST_GROUP:
            raise Refused(where, "groups are nested too deeply")
        items: dict[str, Any] = {}
        for raw in list(group) if keys is None else [key.encode() for key in keys]:
            key = raw.decode("utf-8", "surrogateescape")
            if (depth == 0 and key == SEAL) or (keys is not None and raw not in group):
                continue
            inner = f"{where}/{key}"
            self._objects -= 1
            if self._objects < 0:
                raise Refused("", "holds too many objects")
            self._begin()
            if group.links.get_info(raw).type != h5py.h5l.TYPE_HARD:
                raise Refused(inner, "links to elsewhere", "it should hold the data")
            item = h5py.h5o.open(group, raw)
            if isinstance(item, h5py.h5g.GroupID):
                items[key] = self.group(item, inner, depth + 1)
            elif isinstance(item, h5py.h5d.DatasetID):
                items[key] = self._dataset(item, inner)
            else:
                raise Refused(inner, "is neither group nor dataset")
        return {"attrs": self.attrs(group, where) if depth else {}, "items": items}

    def attrs(self, target: Any, where: str, *, tables: bool = False) -> dict[str, Any]:
        """Read the attributes that are single texts or numbers; small tables, if so."""
        attrs: dict[str, Any] = {}
        count = h5py.h5a.get_num_attrs(target)
        self._attrs -= count
        if self._attrs < 0:
            raise Refused("", "holds too many attributes")
        for number in range(count):
            stored = h5py.h5a.open(target, index=number)
            shape, dtype = stored.shape, stored.dtype
            is_table = shape not in ((), (1,))
            small = tables and shape and 0 < prod(shape) <= _MOST_TABLE_VALUES
            if is_table and not small:
                continue
            self._spend(where, dtype.itemsize * max(prod(shape), 1))
            is_text = dtype.kind == "S" or h5py.check_string_dtype(dtype)
            if dtype.kind not in "biuf" and (is_table or not is_text):
                continue
            value = np.zeros(shape, dtype=dtype)
            stored.read(value)
            name = stored.name.decode("utf-8", "surrogateescape")
            if is_table:
                attrs[name] = value.astype(np.float64).tolist()
                continue
            one = value.reshape(-1)[0]
            if is_text:
                self._spend(where, len(one))
                attrs[name] = decoded(_bytes(one))
            else:
                attrs[name] = one.item()
        return attrs

    def _dataset(self, stored: Any, where: str) -> dict[str, Any]:
        creation = stored.get_create_plist()
        layout = creation.get_layout()
        if layout == h5py.h5d.VIRTUAL or creation.get_external_count():
            raise Refused(where, "keeps its data elsewhere")
        filters = [creation.get_filter(i) for i in range(creation.get_nfilters())]
        if not {number for number, *_ in filters} <= _FILTERS:
            raise Refused(where, "is packed with a filter that is not standard")
        if len(filters) > _MOST_FILTERS:
            raise Refused(where, "is packed too often")
        if stored.get_space().get_simple_extent_type() == h5py.h5s.NULL:
            raise Refused(where, "is empty")
        shape, dtype = stored.shape, stored.dtype
        if len(shape) > _MOST_AXES:
            raise Refused(where, f"has {len(shape)} axes")
        is_text = h5py.check_string_dtype(dtype) or dtype.kind == "S"
        if not is_text and (dtype.kind not in "biuf" or dtype.itemsize > 8):
            raise Refused(where, f"holds {dtype}", "not numbers or texts")
        chunk = creation.get_chunk() if layout == h5py.h5d.CHUNKED else ()
        table = chunk_table(stored, shape) if chunk else None
        claim = Claim(shape, chunk, dtype.itemsize, table, stored.get_storage_size())
        self._expect_stored(claim, where)
        found = {"attrs": self.attrs(stored, where, tables=True)}
        if is_text:
            return {**found, **self._texts(h5py.Dataset(stored), chunk, where)}
        found |= {"shape": shape, "dtype": dtype.str}
        at = stored.get_offset() if table is None else None
        is_odd = not stored.get_type().equal(h5py.h5t.py_create(dtype))
        if is_odd or (table is None and at is None):  # HDF5 converts, or keeps it apart
            values = np.asarray(h5py.Dataset(stored)[()])
            return {
                **found,
                "dtype": values.dtype.str,
                "raw": self._block(values.tobytes()),
            }
        if table is None:
            return {**found, "at": at}
        fill = np.zeros((), dtype=dtype)
        creation.get_fill_value(fill)
        self._shift(stored, table)
        return {
            **found,
            "chunk": chunk,
            "filters": [[number, *cd[:1]] for number, _, cd, _ in filters],
            "fill": self._block(fill.tobytes()),
            "table": self._block(table.tobytes()),
        }

    def _expect_stored(self, claim: Claim, where: str) -> None:
        """Expect a dataset to claim no more than what is stored of it could hold."""
        if claim.claimed > min(
            max(_UNSTORED_BYTES, claim.held(self._size)), self._left
        ):
            said = " x ".join(map(str, claim.shape))
            raise Refused(where, f"claims {said} values, far more than it holds")
        if claim.table is not None and len(claim.table) > claim.chunks:
            raise Refused(where, "has more chunks than there is room for")
        rows = 0 if claim.table is None else claim.table.nbytes
        self._spend(where, claim.claimed + rows)

    def _shift(self, stored: Any, table: Any) -> None:
        """Count from the file's first byte; some versions count from the user block."""
        if not (self._base and len(table)):
            return
        at, size = int(table[0, -2]), int(table[0, -1])
        _, chunk = stored.read_direct_chunk(tuple(map(int, table[0, :-3])))
        if os.pread(self._raw.fileno(), size, at) != bytes(chunk):
            table[:, -2] += self._base

    def _texts(
        self, dataset: h5py.Dataset, chunk: tuple[int, ...], where: str
    ) -> dict[str, Any]:
        if dataset.ndim == 0:
            raw = _bytes(dataset[()])
            self._spend(where, len(raw))
            return {"text": decoded(raw)}
        if dataset.ndim != 1:
            raise Refused(where, "texts should stand in one row")
        step = _TEXTS_AT_ONCE
        if dataset.dtype.kind == "S":
            step = max(step, *chunk, 0)
        texts: list[str] = []
        for start in range(0, len(dataset), step):
            self._begin()
            some = [_bytes(raw) for raw in dataset[start : start + step]]
            self._spend(where, sum(map(len, some)))
            texts += map(decoded, some)
        return {"texts": texts}

    def _block(self, content: bytes) -> int:
        self.blocks.append(content)
        return len(self.blocks) - 1

    def _spend(self, where: str, amount: int) -> None:
        self._left -= amount
        if self._left < 0:
            raise Refused(where, "the file claims far more than it holds")


def _bytes(raw: Any) -> bytes:
    """A text as h5py gives it, as the bytes that it is made of."""
    if isinstance(raw, str):
        return raw.encode("utf-8", "surrogateescape")
    return bytes(raw)


def _seal(file: h5py.File) -> int | None:
    if not isinstance(file.get(SEAL, getlink=True), h5py.HardLink):
        return None
    dataset = file[SEAL]
    if not isinstance(dataset, h5py.Dataset) or dataset.dtype != np.uint8:
        return None
    at: int | None = dataset.id.get_offset()
    return at if dataset.shape == (32,) else None
