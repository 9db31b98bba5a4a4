"""PLY: point clouds and meshes with normals and colours, as scanners write them.

A header in text lists elements (``vertex``, ``face``) with their properties; the body
follows in text or in binary of either byte order. PLY has no unit of length; a comment
``unit mm`` (cm, m) is what we write and heed.

Nothing is allocated by a count that the file's size does not bear out.

trimesh reads PLY, too, and was tried in place of this module (trimesh 5.2, numpy 2,
one core; median of a million points with normals and colours):

======================================  ===============  ===============
file                                    this module      trimesh
======================================  ===============  ===============
binary, no faces (27 MB)                0.037 s, 94 MiB  0.063 s, 77 MiB
binary, two million faces (53 MB)       0.080 s, 173     0.092 s, 127
text, no faces (71 MB)                  2.6 s, 711       3.5 s, 740
import                                  0.01 s           0.45 s
======================================  ===============  ===============

It is not faster, and there are promises that it cannot keep. It takes the length of the
first list of a binary element for that of all: it refuses triangles mixed with
quadrilaterals, and reads wrong faces where the lengths happen to add up. Of a text it
takes what is there: it returns fewer vertices of one that was cut off, and believes no
count of a list. It fails where bytes follow the last element, where rows go over
several lines and where lines end with a carriage return alone. Its errors name no
place. Texture coordinates and edges, which nobody needs here, are followed all the
same. So the parser stays, and trimesh is what tests compare it with.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bytes, Floats, Ints
from handclean.errors import FileError
from handclean.io.mesh.raw import RawMesh, as_bytes, triangles

_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}

_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

_MOST_HEADER_BYTES = 2**16
"""[bytes] of a header, at most (chosen)."""

_FACE_LISTS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str  # numpy's name
    count: str = ""  # kind of the number before a list, "" for a plain property


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)

    @property
    def smallest(self) -> int:
        """Bytes of a binary row with empty lists."""
        return sum(np.dtype(p.count or p.kind).itemsize for p in self.properties)


def parse_ply(path: Path, content: bytes) -> RawMesh:
    """Read the bytes of a PLY file.

    Raises
    ------
    FileError
        If they are not one, or end too soon.
    """
    order, elements, unit, start = _header(path, content)
    body = _Text(path, content[start:]) if not order else _Binary(path, content, start)
    columns: dict[str, dict[str, Any]] = {}
    for element in elements:
        columns[element.name] = body.element(element, order)
    vertex = columns.get("vertex")
    if vertex is None or not all(axis in vertex for axis in "xyz"):
        raise FileError(path, "has no vertices", "x, y and z of element vertex")
    return RawMesh(
        vertices=_stacked(vertex, "xyz"),
        faces=_faces(path, columns.get("face", {})),
        normals=_normals(vertex),
        colors=_colors(vertex),
        unit=unit,
    )


def _header(path: Path, content: bytes) -> tuple[str, list[_Element], str, int]:
    """Return byte order, elements, unit and where the body starts."""
    if not content.startswith((b"ply\n", b"ply\r")):
        raise FileError(path, "is not a PLY file", "it should begin with 'ply'")
    order, unit, at = None, "", 3
    elements: list[_Element] = []
    while at < min(len(content), _MOST_HEADER_BYTES):
        at = _line_start(content, at)
        stop = at + _MOST_HEADER_BYTES
        ends = [content.find(mark, at, stop) for mark in (b"\n", b"\r")]
        ends = [end for end in ends if end >= 0]
        if not ends:
            break
        words = content[at : min(ends)].decode("ascii", "replace").split()
        at = min(ends)
        match words:
            case ["format", name, *_]:
                order = _ORDERS.get(name)
            case ["comment", "unit", unit]:
                pass
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count[:18])))
            case ["property", "list", many, kind, name] if elements:
                if _TYPES.get(many, "f")[0] == "f" or kind not in _TYPES:
                    raise FileError(path, f"has a property {' '.join(words)[:60]}")
                elements[-1].properties.append(
                    _Property(name, _TYPES[kind], _TYPES[many])
                )
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(_Property(name, _TYPES[kind]))
            case ["end_header"]:
                if order is None:
                    raise FileError(path, "does not say its format", "ascii or binary")
                return order, elements, unit, _line_start(content, at)
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                wrong = f"its header says '{' '.join(words)[:60]}'"
                raise FileError(path, wrong, "no PLY header does")
    raise FileError(path, "its header has no end", "end_header")


def _line_start(content: bytes, at: int) -> int:
    r"""Step over one line end: ``\n``, ``\r`` or ``\r\n``."""
    if content[at : at + 2] == b"\r\n":
        return at + 2
    return at + 1 if content[at : at + 1] in (b"\n", b"\r") else at


class _Text:
    """The body of an ASCII file, as numbers one after another."""

    def __init__(self, path: Path, body: bytes) -> None:
        self.path = path
        try:
            self._numbers = np.array(body.split(), dtype=np.float64)
        except ValueError as error:
            raise FileError(path, f"{str(error)[:80]} among its numbers") from None
        self._at = 0

    def element(self, element: _Element, order: str) -> dict[str, Any]:
        """Read the next element's columns."""
        width = len(element.properties)
        lists = [p for p in element.properties if p.count]
        if element.count * width > len(self._numbers) - self._at:
            raise _cut(self.path, element)
        if not lists:
            table = self._take(element, element.count * width)
            names = [p.name for p in element.properties]
            return dict(zip(names, table.reshape(element.count, width).T, strict=True))
        rows: dict[str, Any] = {p.name: [] for p in element.properties}
        for _ in range(element.count):
            for prop in element.properties:
                value = self._take(element, 1)
                if prop.count:
                    rows[prop.name].append(self._take(element, _whole(self, value[0])))
                else:
                    rows[prop.name].append(value[0])
        return rows

    def _take(self, element: _Element, count: int) -> Floats:
        if count > len(self._numbers) - self._at:
            raise _cut(self.path, element)
        self._at += count
        return self._numbers[self._at - count : self._at]


def _whole(body: _Text, value: float) -> int:
    if not (0.0 <= value < 2**31 and value == int(value)):
        raise FileError(body.path, f"a list of {value} numbers", "a whole number")
    return int(value)


class _Binary:
    """The body of a binary file."""

    def __init__(self, path: Path, content: bytes, start: int) -> None:
        self.path = path
        self._content, self._at = content, start

    def element(self, element: _Element, order: str) -> dict[str, Any]:
        """Read the next element's columns."""
        if element.count * max(element.smallest, 1) > len(self._content) - self._at:
            raise _cut(self.path, element)
        if not element.count:
            return {p.name: [] for p in element.properties}
        sizes = self._first_sizes(element, order)
        table = self._uniform(element, order, sizes)
        return self._ragged(element, order) if table is None else table

    def _first_sizes(self, element: _Element, order: str) -> list[int]:
        """How many numbers the lists of the first row hold."""
        at, sizes = self._at, []
        for prop in element.properties:
            size = 1
            if prop.count:
                size = int(self._number(element, order + prop.count, at))
                at += np.dtype(prop.count).itemsize
                sizes.append(size)
            at += size * np.dtype(prop.kind).itemsize
            if size < 0 or at > len(self._content):
                raise _cut(self.path, element)
        return sizes

    def _uniform(
        self, element: _Element, order: str, sizes: list[int]
    ) -> dict[str, Any] | None:
        """Read rows all of one size; None if they are not."""
        fields: list[Any] = []
        left = iter(sizes)
        for n, prop in enumerate(element.properties):
            if prop.count:
                fields.append((f"count {n}", order + prop.count))
                fields.append((f"{n}", order + prop.kind, (next(left),)))
            else:
                fields.append((f"{n}", order + prop.kind))
        row = np.dtype(fields)
        if element.count * row.itemsize > len(self._content) - self._at:
            if sizes:
                return None
            raise _cut(self.path, element)
        table = np.frombuffer(self._content, row, element.count, self._at)
        left = iter(sizes)
        for n, prop in enumerate(element.properties):
            if prop.count and np.any(table[f"count {n}"] != next(left)):
                return None
        self._at += element.count * row.itemsize
        return {p.name: table[f"{n}"] for n, p in enumerate(element.properties)}

    def _ragged(self, element: _Element, order: str) -> dict[str, Any]:
        """Read rows whose lists differ in length."""
        rows: dict[str, Any] = {p.name: [] for p in element.properties}
        for _ in range(element.count):
            for prop in element.properties:
                size = 1
                if prop.count:
                    size = int(self._number(element, order + prop.count, self._at))
                    self._at += np.dtype(prop.count).itemsize
                kind = np.dtype(order + prop.kind)
                if not 0 <= size * kind.itemsize <= len(self._content) - self._at:
                    raise _cut(self.path, element)
                values = np.frombuffer(self._content, kind, size, self._at)
                self._at += size * kind.itemsize
                rows[prop.name].append(values if prop.count else values[0])
        return rows

    def _number(self, element: _Element, kind: str, at: int) -> Any:
        if at + np.dtype(kind).itemsize > len(self._content):
            raise _cut(self.path, element)
        return np.frombuffer(self._content, kind, 1, at)[0]


def _cut(path: Path, element: _Element) -> FileError:
    wrong = f"ends before the last of {element.count} rows of element {element.name}"
    return FileError(path, wrong, "a cut file?")


def _stacked(columns: dict[str, Any], names: Any) -> Floats:
    with np.errstate(invalid="ignore"):  # NaN may be of a kind that warns
        arrays = [np.asarray(columns[name], dtype=np.float64) for name in names]
    return np.column_stack(arrays)


def _normals(vertex: dict[str, Any]) -> Floats | None:
    names = ("nx", "ny", "nz")
    return _stacked(vertex, names) if all(n in vertex for n in names) else None


def _colors(vertex: dict[str, Any]) -> Bytes | None:
    for names in (("red", "green", "blue"), ("r", "g", "b")):
        for head in ("", "diffuse_"):
            keys = [head + name for name in names]
            if all(key in vertex for key in keys):
                return as_bytes(np.column_stack([np.asarray(vertex[k]) for k in keys]))
    return None


def _faces(path: Path, face: dict[str, Any]) -> Ints:
    """(F, 3) triangles; a polygon is cut into a fan."""
    name = next((name for name in _FACE_LISTS if name in face), "")
    if not name or not len(face[name]):
        return np.zeros((0, 3), dtype=np.int64)
    return triangles(face[name])
