"""OBJ and STL: meshes as text or, STL, as numbers.

Of an OBJ, vertices (with colours, as scanners add them), normals and faces are read;
groups, materials and texture coordinates are passed over and part no vertex in two. A
normal that faces give a vertex is the vertex's; of several, their mean. An STL is three
corners a face; those in one place become one vertex, in the order of their first use.

The numbers of a binary STL are read by trimesh, once its size is what its head says. Of
a text, trimesh passes over what it cannot read, so ours is read here.

Nothing is allocated by a number that a file holds.
"""

import re
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Floats, Ints
from handclean.errors import FileError
from handclean.io.mesh.raw import RawMesh, as_bytes, triangles

_STL_HEAD_BYTES, _STL_FACE_BYTES = 84, 50
"""[bytes] of a binary STL before its first triangle, and of a triangle (the format)."""

_VERTEX = re.compile(rb"vertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)", re.IGNORECASE)


def parse_obj(path: Path, content: bytes) -> RawMesh:
    """Read the bytes of an OBJ file.

    Raises
    ------
    FileError
        If they are not one, or damaged.
    """
    text = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    rows: dict[bytes, list[list[bytes]]] = {b"v": [], b"vn": [], b"f": []}
    before: list[int] = []  # vertices, and normals, before each face
    for line in text.replace(b"\\\n", b" ").split(b"\n"):
        words = line.split()
        if words and words[0] in rows:
            rows[words[0]].append(words[1:])
            if words[0] == b"f":
                before += (len(rows[b"v"]), len(rows[b"vn"]))
    if not rows[b"v"]:
        raise FileError(path, "has no vertices", "lines of an OBJ begin with v, vn, f")
    width = min(map(len, rows[b"v"]))
    table = _numbers(path, [row[: max(width, 3)] for row in rows[b"v"]])
    given = _numbers(path, [row[:3] for row in rows[b"vn"]])
    counts = np.array(before, dtype=np.int64).reshape(-1, 2)
    sizes = np.array([len(row) for row in rows[b"f"]], dtype=np.int64)
    vertex, normal = _corners(path, rows[b"f"], sizes, counts)
    colors = as_bytes(table[:, 3:6]) if table.shape[1] >= 6 else None
    if len(rows[b"f"]):
        normals = _normals(path, len(table), given, vertex, normal)
    else:
        normals = given if len(given) == len(table) else None
    return RawMesh(
        vertices=table[:, :3],
        faces=triangles(_polygons(vertex, sizes)),
        normals=normals,
        colors=colors,
        unit=_commented(content[:4096]),
    )


def _numbers(path: Path, rows: list[list[bytes]]) -> Floats:
    """(N, 3 or more) numbers of lines."""
    width = max(map(len, rows), default=3)
    if width < 3 or any(len(row) != width for row in rows):
        raise FileError(path, "a line of it has too few numbers", "x, y and z")
    cells = list(chain.from_iterable(rows))
    try:
        found: Floats = np.array(cells, dtype=np.float64).reshape(-1, width)
    except ValueError as error:
        raise FileError(path, f"{str(error)[:80]} among its numbers") from None
    return found


def _corners(
    path: Path, rows: list[list[bytes]], sizes: Ints, before: Ints
) -> tuple[Ints, Ints]:
    """Vertex of each corner, from 0, and its normal, -1 for none.

    Numbers below 0 count back from the vertices, or normals, before the face.
    """
    if len(sizes) and sizes.min() < 3:
        raise FileError(path, "a face of it has less than three corners")
    at: list[int] = []
    named: list[int] = []
    try:
        for cell in chain.from_iterable(rows):
            parts = cell.split(b"/")
            at.append(int(parts[0]))
            named.append(int(parts[2]) if len(parts) > 2 and parts[2] else 0)
        vertex, normal = (np.array(x, dtype=np.int64) for x in (at, named))
    except (ValueError, OverflowError):
        raise FileError(path, "a face of it names no vertices") from None
    if np.any(vertex == 0):
        raise FileError(path, "a face names vertex 0", "an OBJ counts from 1")
    back = np.repeat(before, sizes, axis=0)
    vertex = np.where(vertex < 0, vertex + back[:, 0], vertex - 1)
    normal = np.where(normal < 0, normal + back[:, 1], normal - 1)
    return vertex, normal


def _polygons(vertex: Ints, sizes: Ints) -> NDArray[Any] | list[Any]:
    if len(sizes) and (sizes == sizes[0]).all():
        return vertex.reshape(-1, int(sizes[0]))
    return np.split(vertex, np.cumsum(sizes)[:-1]) if len(sizes) else []


def _normals(
    path: Path, count: int, given: Floats, vertex: Ints, normal: Ints
) -> Floats | None:
    """(V, 3) mean normal that faces give each vertex; None if one is given none."""
    used = normal >= 0
    if not used.any():
        return None
    if normal.max() >= len(given):
        right = f"its normals are 1 to {len(given)}"
        raise FileError(path, "a face names a normal that is not there", right)
    inside = used & (vertex >= 0) & (vertex < count)
    total = np.zeros((count, 3))
    with np.errstate(over="ignore", invalid="ignore"):
        np.add.at(total, vertex[inside], given[normal[inside]])
    times = np.bincount(vertex[inside], minlength=count)
    if not times.all():
        return None
    return total / times[:, None]


def parse_stl(path: Path, content: bytes) -> RawMesh:
    """Read the bytes of an STL file, text or numbers.

    Raises
    ------
    FileError
        If they are not one, or end too soon.
    """
    count = int.from_bytes(content[_STL_HEAD_BYTES - 4 : _STL_HEAD_BYTES], "little")
    there = (len(content) - _STL_HEAD_BYTES) / _STL_FACE_BYTES
    if there == count and count:
        from trimesh.exchange.stl import load_stl_binary  # late: it is heavy

        corners = load_stl_binary(BytesIO(content))["vertices"]
        with np.errstate(invalid="ignore"):  # a signalling NaN
            corners = corners.astype(np.float64)
        return _merged(corners, content)
    if content.lstrip()[:5].lower() != b"solid" or b"facet" not in content.lower():
        right = f"it says {count} faces, {max(there, 0.0):.1f} are there"
        raise FileError(path, "is not STL", f"a cut or damaged file? {right}")
    cells = list(chain.from_iterable(_VERTEX.findall(content)))
    words = content.lower()
    said = words.count(b"vertex"), 3 * len(re.findall(rb"endfacet", words))
    if said != (len(cells) // 3, len(cells) // 3):
        wrong = f"{len(cells) // 3} of its {said[0]} corners can be read"
        raise FileError(path, f"is not STL: {wrong}", "a cut or damaged file?")
    return _merged(_numbers(path, [list(row) for row in _rows(cells)]), content)


def _rows(cells: list[bytes]) -> list[tuple[bytes, ...]]:
    return list(zip(cells[::3], cells[1::3], cells[2::3], strict=True))


def _merged(corners: Floats, content: bytes) -> RawMesh:
    """Return an STL with every vertex once, in the order of their first use."""
    _, first, place = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(first)
    inverse: NDArray[Any] = np.argsort(rank)
    return RawMesh(
        vertices=corners[first[rank]],
        faces=inverse[place.ravel()].reshape(-1, 3).astype(np.int64),
        normals=None,
        colors=None,
        unit=_commented(content[:80]),
    )


def _commented(head: bytes) -> str:
    """Return the unit that a comment states, or nothing."""
    found = re.search(rb"(?:^#|handclean:) *unit (mm|cm|m)\b", head, re.MULTILINE)
    return found[1].decode() if found else ""
