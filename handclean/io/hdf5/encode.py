"""Parts of a file as groups, datasets and attributes of HDF5.

See `handclean.io.hdf5.file` for the kinds.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from handclean.errors import FileError, Place
from handclean.io.hdf5.parts import Array, Fact, Part

LIBRARY = ("v110", "v110")
"""HDF5 1.10 (2016) and later read it; its metadata carry checksums."""

_LEAST_COMPRESSED_BYTES = 4096
"""[bytes] smaller datasets are stored as they are (chosen)."""

_CHUNK_BYTES = 2**20
"""[bytes] compressed datasets are cut into pieces of about this size (chosen)."""

_MOST_PADDED_BYTES = 2**20
"""[bytes] that texts in a row may take; more only if most of it is not padding
(chosen)."""


def put(group: h5py.Group, part: Part, where: Place) -> None:
    """Write a part into an open group; errors name it ``where``."""
    put_attrs(group, part.attrs)
    for name, item in sorted(part.items.items()):
        inner, key = where / name, _escaped(name)
        if isinstance(item, Part):
            put(group.create_group(key), item, inner)
        elif isinstance(item, Mapping):
            put(group.create_group(key), Part({"kind": "dict"}, item), inner)
        else:
            kind, values, units = _encoded(item, inner)
            dataset = group.create_dataset(key, data=values, **storage_of(values))
            put_attrs(dataset, {"units": units} | ({"kind": kind} if kind else {}))
            for key, table in getattr(item, "tables", {}).items():
                dataset.attrs[key] = _checked(table, inner)


def put_attrs(target: h5py.HLObject, attrs: Mapping[str, Fact]) -> None:
    """Write attributes, text as UTF-8 of fixed length."""
    for name, fact in sorted(attrs.items()):
        if isinstance(fact, str):
            values = _texts([fact.replace("\0", "?")]).reshape(())
            target.attrs.create(name, values, dtype=values.dtype)
        else:
            target.attrs[name] = fact


def _escaped(name: str) -> str:
    """A name without what HDF5 would take for a path."""
    out = name.replace("%", "%25").replace("/", "%2F").replace("\0", "%00")
    return out.replace(".", "%2E") if set(out) <= {"."} else out


def _is_plain_text(item: Any) -> bool:
    return isinstance(item, str) and "\0" not in item


def _utf8(text: str) -> bytes:
    """A text as UTF-8; what is no character (a surrogate) becomes a question mark."""
    return text.encode("utf-8", "replace")


def _texts(texts: Iterable[str]) -> NDArray[Any]:
    """(N,) texts, all as long as the longest."""
    raw = [_utf8(text) for text in texts]
    longest = max(map(len, raw), default=0) or 1
    return np.array(raw, dtype=h5py.string_dtype("utf-8", longest))


def _fit_in_a_row(texts: Sequence[str]) -> bool:
    """Whether texts can stand side by side without much padding."""
    sizes = [len(_utf8(text)) for text in texts]
    padded = len(sizes) * max(sizes, default=0)
    return padded <= max(_MOST_PADDED_BYTES, 4 * sum(sizes))


def _encoded(item: Any, where: Place) -> tuple[str, NDArray[Any], str]:
    """Return kind, values and units of what becomes a dataset.

    Raises
    ------
    FileError
        If nothing can hold it.
    """
    match item:
        case Array(values=values, units=units):
            return "", _checked(values, where), units
        case np.ndarray():
            return "", _checked(item, where), ""
        case np.generic():
            return "number", _checked(np.asarray(item), where), ""
        case str() if "\0" in item:
            return "bytes", np.frombuffer(_utf8(item), np.uint8), ""
        case str():
            return "text", _texts([item]).reshape(()), ""
        case bool() | float():
            return type(item).__name__, np.asarray(item), ""
        case int() if -(2**63) <= item < 2**63:
            return "int", np.asarray(item, dtype=np.int64), ""
        case list() | tuple() if all(map(_is_plain_text, item)) and _fit_in_a_row(item):
            return type(item).__name__, _texts(item), ""
    try:
        return "json", _texts([json.dumps(item, ensure_ascii=False)]).reshape(()), ""
    except (TypeError, ValueError, RecursionError):
        kind = type(item).__name__
        raise FileError(where, f"a {kind} cannot be kept in a file") from None


def _checked(values: NDArray[Any], where: Place) -> NDArray[Any]:
    if values.dtype.kind not in "biuf" or values.dtype.itemsize > 8:
        raise FileError(where, f"{values.dtype} numbers cannot be kept in a file")
    return values


def storage_of(values: NDArray[Any]) -> dict[str, Any]:
    """How a dataset is laid out: large ones in compressed pieces along T."""
    if (
        values.ndim == 0
        or values.dtype.kind == "S"
        or values.nbytes < _LEAST_COMPRESSED_BYTES
    ):
        return {"track_times": False}
    row = values.nbytes // values.shape[0]
    rows = min(values.shape[0], max(1, _CHUNK_BYTES // max(row, 1)))
    return {
        "track_times": False,
        "chunks": (rows, *values.shape[1:]),
        "compression": "gzip",
        "compression_opts": 1,
        "shuffle": values.dtype.itemsize > 1,
    }
