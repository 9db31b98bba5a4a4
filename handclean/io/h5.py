"""HDF5 files of one kind: named parts, every dataset with its unit, nothing executed.

A session, a subject, a posture prior and a calibration are all such files; each has its
own ``format`` name and a ``version`` in the attributes of its root.

Written files depend on nothing but their content: no times are kept, parts are in
alphabetical order, the library version is fixed. Texts are UTF-8 of variable length;
those of fixed length, as handclean wrote them before, are read too. A seal
(`handclean.io.seal`) tells whether a file was edited since.

Reading trusts nothing: no links to elsewhere, no external or virtual storage, no filter
but the standard ones (a plug-in would be code), no Python objects, and no more memory
than `_most` allows a file of that size.

Datasets that are no plain array carry an attribute ``kind``: ``text``, ``list`` or
``tuple`` (of texts), ``bool``, ``int``, ``float``, ``number`` (of numpy), ``bytes`` (a
text with zero bytes in it) or ``json`` (tuples come back as lists); a group that is a
plain dictionary has kind ``dict``. Names that HDF5 cannot take are percent-encoded.
"""

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import prod
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import h5py
import numpy as np
from numpy.typing import NDArray

from handclean.errors import FileError, Place
from handclean.io import seal
from handclean.io.parts import Array, Fact, Part
from handclean.io.reading import text
from handclean.io.writing import unwritable

LIBRARY = ("v110", "v110")
"""HDF5 1.10 (2016) and later read it; its metadata carry checksums."""

_COMPRESS = 4096
"""[bytes] smaller datasets are stored as they are."""

_CHUNK = 2**20
"""[bytes] compressed datasets are cut into pieces of about this size."""

_GROWS = 2**22
"""[bytes] by which a file in memory grows."""

_TEXT = h5py.string_dtype("utf-8")

_AT_ONCE = 64
"""Texts are read so many at a time; each may be as long as the file."""

_FILTERS = {1, 2, 3}  # deflate, shuffle, fletcher32
_DEEPEST = 16
_MOST_OBJECTS = 50_000
_BROKEN = (
    OSError,
    RuntimeError,
    ValueError,
    LookupError,
    TypeError,
    OverflowError,
    MemoryError,
    AttributeError,
    SystemError,
)
"""What h5py raises over damaged files."""


def _most(size: int) -> int:
    """[bytes] that the arrays of a file of some size may take in all."""
    return 2**24 + 64 * size


def write_h5(path: Path, format_name: str, part: Part, *, version: int = 1) -> None:
    """Write a part as a file of its own.

    Raises
    ------
    FileError
        If it cannot be written, or holds something that no file can.
    """
    try:
        image, at = _image(format_name, version, part, path)
        seal.write(path, image, at)
    except OSError as error:
        raise unwritable(path, error) from None
    except ValueError as error:
        reason = (str(error).splitlines() or [""])[0]
        raise FileError(path, f"cannot be written ({reason})") from None


def _image(format_name: str, version: int, part: Part, path: Path) -> tuple[bytes, int]:
    """Bytes of a file, and where in them its seal goes.

    It is built in memory: over a full disk the library would take the process down.
    """
    memory = {"driver": "core", "backing_store": False, "block_size": _GROWS}
    with h5py.File(str(path), "w", libver=LIBRARY, **memory) as file:
        put_attrs(file, {"format": format_name, "version": version})
        put(file, part, Place(path))
        at = seal.put(file)
        image: bytes = file.id.get_file_image()
    return image, at


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


def put_attrs(target: h5py.HLObject, attrs: Mapping[str, Fact]) -> None:
    """Write attributes, text as UTF-8 of variable length."""
    for name, fact in sorted(attrs.items()):
        if isinstance(fact, str):
            target.attrs.create(name, _utf8(fact), dtype=_TEXT)
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
    """(N,) texts of variable length."""
    return np.array([_utf8(text) for text in texts], dtype=_TEXT)


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
        case list() | tuple() if all(map(_is_plain_text, item)):
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
    if values.ndim == 0 or values.dtype == _TEXT or values.nbytes < _COMPRESS:
        return {"track_times": False}
    row = values.nbytes // values.shape[0]
    rows = min(values.shape[0], max(1, _CHUNK // max(row, 1)))
    return {
        "track_times": False,
        "chunks": (rows, *values.shape[1:]),
        "compression": "gzip",
        "compression_opts": 1,
        "shuffle": values.dtype.itemsize > 1,
    }


def read_h5(path: Path, format_name: str, *, version: int = 1) -> Part:
    """Read a file that `write_h5` or another program wrote.

    Parameters
    ----------
    format_name : what its root should say it is.
    version : the latest one that is understood.

    Raises
    ------
    FileError
        If it is not such a file, is damaged, or claims more than it holds.
    """
    with _opened(path) as file:
        found, at = _stated(path, file)
        if found != format_name:
            raise FileError(path, f"is a {found[:40]}", f"not a {format_name}")
        if at > version:
            wrong = f"is a {format_name} of version {at}"
            raise FileError(path, wrong, f"this handclean knows {version}")
        return _Reader(path, os.stat(path).st_size).group(file, Place(path), 0)


def format_of(path: Path) -> str:
    """Return which of our formats a file says it is.

    Raises
    ------
    FileError
        If it is no HDF5 file or does not say.
    """
    with _opened(path) as file:
        return _stated(path, file)[0]


@contextmanager
def _opened(path: Path) -> Iterator[h5py.File]:
    """An HDF5 file for reading; whatever h5py raises over it becomes a `FileError`."""
    try:
        if path.is_dir():
            raise FileError(path, "is a directory", "give a file")
        if not os.stat(path).st_size:
            raise FileError(path, "is empty")
        with h5py.File(path, "r", locking=False) as file:
            yield file
    except FileNotFoundError:
        raise FileError(path, "no such file") from None
    except _BROKEN as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise FileError(path, f"cannot be read as HDF5 ({reason})") from None


def _stated(path: Path, file: h5py.File) -> tuple[str, int]:
    """Return format name and version of a file."""
    attrs = _Reader(path, 0).attrs(file, Place(path))
    name, version = attrs.get("format"), attrs.get("version")
    if not isinstance(name, str):
        raise FileError(
            path, "does not say what it is", "attribute 'format' is missing"
        )
    if not isinstance(version, int) or version < 1:
        raise FileError(path, f"is a {name[:40]} without a version")
    return name, version


class _Reader:
    """Reads groups into parts and keeps account of what they claim."""

    def __init__(self, path: Path, size: int) -> None:
        self._path = path
        self._left = _most(size)
        self._objects = _MOST_OBJECTS

    def group(self, group: h5py.Group, where: Place, depth: int) -> Part:
        """Read a group and all below it."""
        if depth > _DEEPEST:
            raise FileError(where, "groups are nested too deeply")
        items: dict[str, Any] = {}
        for key in group:
            if depth == 0 and key == seal.NAME:
                continue
            name = unquote(key)
            inner = where / name
            self._objects -= 1
            if self._objects < 0:
                raise FileError(self._path, "holds too many objects")
            if not isinstance(group.get(key, getlink=True), h5py.HardLink):
                raise FileError(inner, "links to elsewhere", "it should hold the data")
            item = group[key]
            if isinstance(item, h5py.Group):
                part = self.group(item, inner, depth + 1)
                items[name] = _as_dict(part)
            elif isinstance(item, h5py.Dataset):
                items[name] = self._dataset(item, inner)
            else:
                raise FileError(inner, "is neither group nor dataset")
        return Part(self.attrs(group, where), items, where)

    def attrs(self, target: h5py.HLObject, where: Place) -> dict[str, Fact]:
        """Read the attributes that are single texts or numbers."""
        attrs: dict[str, Fact] = {}
        for name in target.attrs:
            stored = target.attrs.get_id(name)
            if stored.shape not in ((), (1,)):
                continue
            self._spend(where, stored.dtype.itemsize)
            if stored.dtype.kind == "S" or h5py.check_string_dtype(stored.dtype):
                attrs[name] = _decoded(np.asarray(target.attrs[name]).reshape(-1)[0])
            elif stored.dtype.kind in "biuf":
                attrs[name] = np.asarray(target.attrs[name]).reshape(-1)[0].item()
        return attrs

    def _dataset(self, dataset: h5py.Dataset, where: Place) -> Any:
        if dataset.is_virtual or dataset.external:
            raise FileError(where, "keeps its data elsewhere")
        creation = dataset.id.get_create_plist()
        filters = {creation.get_filter(i)[0] for i in range(creation.get_nfilters())}
        if not filters <= _FILTERS:
            raise FileError(where, "is packed with a filter that is not standard")
        if dataset.shape is None:
            raise FileError(where, "is empty")
        for shape in (dataset.shape, dataset.chunks or ()):
            if prod(shape) * dataset.dtype.itemsize > self._left:
                claim = " x ".join(map(str, shape))
                raise FileError(where, f"claims {claim} values, far more than it holds")
        self._spend(where, prod(dataset.shape) * dataset.dtype.itemsize)
        attrs = self.attrs(dataset, where)
        kind, units = attrs.get("kind", ""), attrs.get("units", "")
        if not isinstance(units, str):
            raise FileError(where, "its units are no text")
        if h5py.check_string_dtype(dataset.dtype) or dataset.dtype.kind == "S":
            return self._text(dataset, kind, where)
        if dataset.dtype.kind not in "biuf" or dataset.dtype.itemsize > 8:
            raise FileError(where, f"holds {dataset.dtype}", "not numbers or texts")
        values = dataset[()]
        match kind:
            case "bytes":
                return text(values.tobytes())
            case "number":
                return np.asarray(values)[()]
            case "bool" | "int" | "float" if np.ndim(values) == 0:
                return np.asarray(values).item()
        return Array(np.asarray(values, dtype=dataset.dtype), units)

    def _text(self, dataset: h5py.Dataset, kind: Any, where: Place) -> Any:
        """A text, texts, or what JSON they hold."""
        if dataset.ndim == 0:
            raw = dataset[()]
            self._spend(where, len(raw))
            if kind != "json":
                return _decoded(raw)
            try:
                return json.loads(_decoded(raw))
            except (ValueError, RecursionError):
                raise FileError(where, "is no JSON") from None
        if dataset.ndim != 1:
            raise FileError(where, "texts should stand in one row")
        texts: list[str] = []
        for start in range(0, len(dataset), _AT_ONCE):
            some = dataset[start : start + _AT_ONCE]
            self._spend(where, sum(map(len, some)))
            texts += map(_decoded, some)
        return texts if kind == "list" else tuple(texts)

    def _spend(self, where: Place, amount: int) -> None:
        self._left -= amount
        if self._left < 0:
            raise FileError(where, "the file claims far more than it holds")


def _as_dict(part: Part) -> Part | dict[str, Any]:
    """The plain dictionary that a part stands for, or the part."""
    if part.attrs.get("kind") != "dict":
        return part
    return {
        name: item.values if isinstance(item, Array) else item
        for name, item in part.items.items()
    }


def _decoded(raw: Any) -> str:
    """A text as h5py gives it: UTF-8, else Latin-1."""
    return text(raw.encode("utf-8", "surrogateescape") if isinstance(raw, str) else raw)
