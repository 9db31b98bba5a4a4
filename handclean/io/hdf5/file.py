"""HDF5 files of one kind: named parts, every dataset with its unit, nothing executed.

A session, a subject, a posture prior and a calibration are all such files; each has its
own ``format`` name and a ``version`` in the attributes of its root.

Written files depend on nothing but their content: no times are kept, parts are in
alphabetical order, the library version is fixed. Texts are UTF-8 of fixed length,
padded with zeros: HDF5 keeps those of variable length, as handclean wrote them before,
on a heap without checksums, over which it may loop for ever when a byte is damaged.
They are read too. A seal (`handclean.io.hdf5.seal`) tells whether a file was changed
since.

Reading trusts nothing: structure, attributes and texts are read in another process
(`handclean.io.hdf5.walk` says what is refused), which may hang or die; numbers are read
here, without the library (`handclean.io.hdf5.numbers`).

Datasets that are no plain array carry an attribute ``kind``: ``text``, ``list`` or
``tuple`` (of texts), ``bool``, ``int``, ``float``, ``number`` (of numpy), ``bytes`` (a
text with zero bytes in it) or ``json`` (tuples come back as lists; also texts so unlike
in length that a row of them would be mostly zeros); a group that is a plain dictionary
has kind ``dict``. Names that HDF5 cannot take are percent-encoded.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import h5py
import numpy as np

from handclean.errors import FileError, Place
from handclean.io.hdf5 import seal, walker
from handclean.io.hdf5 import walk as h5_walk
from handclean.io.hdf5.encode import LIBRARY, put, put_attrs
from handclean.io.hdf5.numbers import Stored
from handclean.io.hdf5.opening import expect_same, opened
from handclean.io.hdf5.parts import Array, Fact, Part
from handclean.io.shared.reading import text
from handclean.io.shared.writing import unwritable

_GROWTH_BYTES = 2**22
"""[bytes] by which a file in memory grows (chosen)."""


def write_h5(path: Path, format_name: str, part: Part, *, version: int = 1) -> None:
    """Write a part as a file of its own.

    Raises
    ------
    FileError
        If it cannot be written, or holds something that no file can.
    """
    try:
        image, head = _image(format_name, version, part, path)
        seal.write(path, image, head)
    except OSError as error:
        raise unwritable(path, error) from None
    except ValueError as error:
        reason = (str(error).splitlines() or [""])[0]
        raise FileError(path, f"cannot be written ({reason})") from None


def _image(
    format_name: str, version: int, part: Part, path: Path
) -> tuple[bytes, bytes]:
    """Bytes of a file, and the block that goes before them.

    It is built in memory: over a full disk the library would take the process down.
    """
    memory = {"driver": "core", "backing_store": False, "block_size": _GROWTH_BYTES}
    with h5py.File(
        str(path), "w", libver=LIBRARY, userblock_size=seal.BLOCK_BYTES, **memory
    ) as file:
        put_attrs(file, {"format": format_name, "version": version})
        put(file, part, Place(path))
        head = seal.put(file)
        image: bytes = file.id.get_file_image()
    return image, head


def read_h5(
    path: Path, format_name: str, *, version: int = 1, shipped: bool = False
) -> Part:
    """Read a file that `write_h5` or another program wrote.

    Parameters
    ----------
    format_name : what its root should say it is.
    version : the latest one that is understood.
    shipped : it came with handclean; no other process is needed.

    Raises
    ------
    FileError
        If it is not such a file, is damaged, or claims more than it holds.
    """
    with _walked(path, only=format_name, shipped=shipped) as file:
        found, at = _stated(path, file.found["attrs"])
        if found != format_name:
            raise FileError(path, f"is a {found[:40]}", f"not a {format_name}")
        if at > version:
            wrong = f"is a {format_name} of version {at}"
            raise FileError(path, wrong, f"this handclean knows {version}")
        return file.part()


def format_of(path: Path) -> str:
    """Return which of our formats a file says it is.

    Raises
    ------
    FileError
        If it is no HDF5 file or does not say.
    """
    with _walked(path, only="") as file:
        return _stated(path, file.found["attrs"])[0]


def head_of(path: Path) -> tuple[Mapping[str, Fact], Sequence[str]]:
    """Return attributes and names of what is in the root of any HDF5 file.

    Raises
    ------
    FileError
        If it is none.
    """
    with _walked(path, only="") as file:
        return file.found["attrs"], file.found["names"]


def read_some(path: Path, keys: Sequence[str]) -> Part:
    """Read the root's attributes, and only these of its items, of any HDF5 file.

    Raises
    ------
    FileError
        If one of them cannot be read.
    """
    with _walked(path, keys=keys) as file:
        return file.part()


def open_some(path: Path, keys: Sequence[str]) -> tuple[Part, dict[str, Stored]]:
    """Look at the root's attributes and at where the numbers of these items are.

    Returns
    -------
    the root with its texts, and the items that are numbers, which can be read later

    Raises
    ------
    FileError
        If one of them is not plain numbers or texts of this file.
    """
    with _walked(path, keys=keys) as file:
        items = file.found["root"]["items"]
        numbers = {
            key: file.stored(node, Place(path) / key)
            for key, node in items.items()
            if "dtype" in node
        }
        texts = {key: node for key, node in items.items() if key not in numbers}
        root = {"attrs": file.found["attrs"], "items": texts}
        return file.group(root, Place(path)), numbers


@dataclass(frozen=True)
class _File:
    """A file that was walked, open for reading its numbers."""

    path: Path
    fd: int
    found: dict[str, Any]
    blocks: list[bytes]

    def part(self) -> Part:
        """All that was walked, with its numbers."""
        return self.group(self.found["root"], Place(self.path))

    def group(self, node: Mapping[str, Any], where: Place) -> Part:
        """A group and all below it."""
        items: dict[str, Any] = {}
        for key, item in node["items"].items():
            name = unquote(key)
            inner = where / name
            if "items" in item:
                items[name] = _as_dict(self.group(item, inner))
            else:
                items[name] = self._dataset(item, inner)
        return Part(node["attrs"], items, where)

    def stored(self, node: Mapping[str, Any], where: Place) -> Stored:
        """Where the numbers of a dataset are."""
        state = self.found["file"]
        return Stored(
            path=self.path, where=where, found=node, blocks=self.blocks, state=state
        )

    def _dataset(self, node: Mapping[str, Any], where: Place) -> Any:
        kind, units = node["attrs"].get("kind", ""), node["attrs"].get("units", "")
        if not isinstance(units, str):
            raise FileError(where, "its units are no text")
        if "text" in node:
            return _from_json(node["text"], where) if kind == "json" else node["text"]
        if "texts" in node:
            return node["texts"] if kind == "list" else tuple(node["texts"])
        values = self.stored(node, where).whole(self.fd)
        match kind:
            case "bytes":
                return text(values.tobytes())
            case "number":
                return values[()]
            case "bool" | "int" | "float" if values.ndim == 0:
                return values.item()
        tables = {
            name: np.array(rows)
            for name, rows in node["attrs"].items()
            if isinstance(rows, list)
        }
        return Array(values, units, tables)


@contextmanager
def _walked(
    path: Path,
    *,
    only: str | None = None,
    keys: Sequence[str] | None = None,
    shipped: bool = False,
) -> Iterator[_File]:
    """Walk a file whose seal, if it has one, is whole, and open it for its numbers."""
    wanted = None if keys is None else list(keys)
    with opened(path) as fd:
        if shipped:
            found, blocks = h5_walk.walk(str(path), only=only, keys=wanted)
        else:
            found, blocks = walker.walked(path, only=only, keys=wanted)
        if found["root"] is not None and found["seal"] is not None:
            seal.expect_whole(path, fd, found["seal"])
        yield _File(path, fd, found, blocks)
        expect_same(path, fd, found["file"])


def _stated(path: Path, attrs: Mapping[str, Fact]) -> tuple[str, int]:
    """Return format name and version of a file."""
    name, version = attrs.get("format"), attrs.get("version")
    if not isinstance(name, str):
        raise FileError(
            path, "does not say what it is", "attribute 'format' is missing"
        )
    if not isinstance(version, int) or version < 1:
        raise FileError(path, f"is a {name[:40]} without a version")
    return name, version


def _as_dict(part: Part) -> Part | dict[str, Any]:
    """The plain dictionary that a part stands for, or the part."""
    if part.attrs.get("kind") != "dict":
        return part
    return {
        name: item.values if isinstance(item, Array) else item
        for name, item in part.items.items()
    }


def _from_json(said: str, where: Place) -> Any:
    try:
        return json.loads(said)
    except (ValueError, RecursionError):
        raise FileError(where, "is no JSON") from None
