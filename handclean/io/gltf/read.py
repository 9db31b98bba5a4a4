"""Binary glTF (.glb, version 2.0): its parts, with every number in it checked.

A file is a JSON text and one block of bytes. Numbers lie in *accessors*: ``count``
items of a type (SCALAR to MAT4) at an offset and stride in a *buffer view*, a piece of
that block. Nothing is trusted: an accessor that reaches beyond its view, a node that is
its own ancestor, an index of nothing are all told. No other file is opened and no data
URI is read; sparse and compressed accessors are refused.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.io.shared.reading import load

KINDS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""Component types, as numpy calls them."""

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}

MAGIC, JSON_CHUNK, BIN_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
"""First word of a GLB, and kinds of its chunks (glTF 2.0)."""

_HARMLESS = {
    "KHR_materials_unlit",
    "KHR_materials_specular",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
}
"""Extensions that change nothing that we read, or that we read anyway."""

_MOST_JSON_BYTES = 2**23
"""Bytes of JSON that are read; numbers are not among them (chosen)."""

_DEEPEST_JSON = 50
"""JSON is nested no deeper, but in what nobody reads (chosen)."""

_MOST_READINGS, _FREE_BYTES = 4, 2**22
"""Accessors may name the same bytes so many times in all, and so many bytes more
(chosen)."""


@dataclass(frozen=True)
class Glb:
    """A file as it is: its JSON and its bytes.

    Attributes
    ----------
    path : for messages.
    tree : the JSON object.
    block : the bytes that buffer 0 stands for.
    spent : how many of them accessors were read for so far, again and again.
    made : what was made of it once, by name.
    """

    path: Path
    tree: dict[str, Any]
    block: bytes
    spent: list[int] = field(default_factory=lambda: [0])
    _lists: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    made: dict[str, Any] = field(default_factory=dict)

    def fail(self, wrong: str, right: str = "") -> FileError:
        """Return the error to raise about this file."""
        return FileError(self.path, wrong, right)

    def rows(self, name: str) -> list[dict[str, Any]]:
        """Return one of the lists of the file, an empty one if it is not there.

        Raises
        ------
        FileError
            If it is no list of objects.
        """
        if name not in self._lists:
            found = self.tree.get(name, [])
            if not isinstance(found, list) or not all(
                isinstance(row, dict) for row in found
            ):
                raise self.fail(f"its {name} are no list of objects")
            self._lists[name] = found
        return self._lists[name]

    def row(self, name: str, index: Any) -> dict[str, Any]:
        """Return one object of a list.

        Raises
        ------
        FileError
            If the index is not one of it.
        """
        rows = self.rows(name)
        if type(index) is not int or not 0 <= index < len(rows):
            raise self.fail(f"{name} {index!r:.40} is not one of its {len(rows)}")
        return rows[index]

    def whole(self, row: dict[str, Any], key: str, default: int | None = None) -> int:
        """Return a whole number of an object that is not negative.

        Raises
        ------
        FileError
            If it is none.
        """
        value = row.get(key, default)
        if type(value) is not int or not 0 <= value < 2**40:
            raise self.fail(f"{key} is {value!r:.40}", "a whole number of at least 0")
        return value


def read_glb(path: Path) -> Glb:
    """Read a binary glTF file.

    Raises
    ------
    FileError
        If it is not one of version 2, or was cut off.
    """
    content = load(path)
    if len(content) < 20 or content[:4] != b"glTF":
        right = "a binary one (.glb) begins with 'glTF'"
        raise FileError(path, "is not a binary glTF file", right)
    _, version, length = struct.unpack("<3I", content[:12])
    if version != 2:
        raise FileError(path, f"is glTF version {version}", "version 2 can be read")
    if length > len(content):
        wrong = f"ends after {len(content)} of {length} bytes"
        raise FileError(path, wrong, "a cut file?")
    chunks = _chunks(path, content[:length])
    tree = _json(path, chunks.get(JSON_CHUNK, b""))
    glb = Glb(path=path, tree=tree, block=chunks.get(BIN_CHUNK, b""))
    needed = tree.get("extensionsRequired", [])
    for name in needed if isinstance(needed, list) else [needed]:
        if name not in _HARMLESS:
            right = "save it without compression and extensions"
            raise glb.fail(f"needs the extension {str(name)[:60]}", right)
    return glb


def _json(path: Path, content: bytes) -> dict[str, Any]:
    if len(content) > _MOST_JSON_BYTES:
        wrong = f"has {len(content) / 2**20:.0f} MB of JSON"
        raise FileError(path, wrong, f"at most {_MOST_JSON_BYTES // 2**20} are read")
    try:
        tree = json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError):
        raise FileError(path, "its JSON cannot be read", "a damaged file?") from None
    if not isinstance(tree, dict):
        raise FileError(path, "its JSON is no object")
    level: list[Any] = [tree]
    for _ in range(_DEEPEST_JSON):
        rows = [r.values() if isinstance(r, dict) else r for r in level]
        level = [v for row in rows for v in row if isinstance(v, dict | list)]
        if not level:
            return tree
    raise FileError(path, f"its JSON is nested more than {_DEEPEST_JSON} deep")


def _chunks(path: Path, content: bytes) -> dict[int, bytes]:
    """Return the chunks of a file by their kind; the first of each counts."""
    chunks: dict[int, bytes] = {}
    at = 12
    while at + 8 <= len(content):
        size, kind = struct.unpack_from("<2I", content, at)
        if size > len(content) - at - 8:
            raise FileError(path, "a part of it reaches beyond its end", "a cut file?")
        chunks.setdefault(kind, content[at + 8 : at + 8 + size])
        at += 8 + size
    return chunks


def accessor(glb: Glb, index: Any, width: int, what: str) -> NDArray[Any]:
    """(N, width) numbers of an accessor as they are stored.

    Numbers that are stored as shares of their type's range come as those shares.

    Parameters
    ----------
    width : how many numbers an item should have.
    what : what they are, for messages.

    Raises
    ------
    FileError
        If they are not in the file, or not such numbers.
    """
    row = glb.row("accessors", index)
    if "sparse" in row:
        raise glb.fail(f"its {what} are sparse", "save it without sparse accessors")
    kind, items = row.get("componentType"), row.get("type")
    name = KINDS.get(kind) if isinstance(kind, int) else None
    if name is None or WIDTHS.get(str(items)) != width:
        raise glb.fail(f"its {what} are {items!r:.20} of type {kind!r:.20}")
    numbers = np.dtype(name)
    view = glb.row("bufferViews", row.get("bufferView"))
    if view.get("buffer") != 0 or "uri" in glb.row("buffers", 0):
        raise glb.fail(f"its {what} are in another file", "save it as one .glb")
    start, length = glb.whole(view, "byteOffset", 0), glb.whole(view, "byteLength")
    if start + length > len(glb.block):
        raise glb.fail(f"its {what} reach beyond the end of its bytes", "a cut file?")
    count, offset = glb.whole(row, "count"), glb.whole(row, "byteOffset", 0)
    item = numbers.itemsize * width
    stride = glb.whole(view, "byteStride", item) or item
    if not count or stride < item or offset + (count - 1) * stride + item > length:
        wrong = f"its {what} ({count} items) do not fit their {length} bytes"
        raise glb.fail(wrong, "a damaged file?")
    glb.spent[0] += count * item
    if glb.spent[0] > _MOST_READINGS * len(glb.block) + _FREE_BYTES:
        raise glb.fail("its accessors name the same bytes again and again")
    found = np.ndarray(
        (count, width),
        numbers,
        glb.block,
        start + offset,
        (stride, numbers.itemsize),
    )
    if row.get("normalized") is True and numbers.kind != "f":
        return np.maximum(found / np.iinfo(numbers).max, -1.0)
    return np.array(found)


def floats(glb: Glb, index: Any, width: int, what: str) -> Floats:
    """(N, width) the numbers of an accessor, all of them finite.

    Raises
    ------
    FileError
        As `accessor`; and if one is NaN or infinite.
    """
    with np.errstate(invalid="ignore"):  # of a NaN that signals
        found: Floats = accessor(glb, index, width, what).astype(np.float64)
    if not np.isfinite(found).all():
        raise glb.fail(f"its {what} are not all finite numbers")
    return found
