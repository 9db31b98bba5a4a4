"""Meshes written as PLY, OBJ and STL, in metres; a comment in each says so."""

from pathlib import Path

import numpy as np

from handclean.errors import FileError
from handclean.hand.surface import face_normals
from handclean.io.mesh.meshes import Mesh
from handclean.remarks import Remark, remark

_STL_TITLE_BYTES = 80
"""[bytes] before the count of triangles (the format)."""


def write_ply(path: Path, mesh: Mesh) -> tuple[Remark, ...]:
    """Write a binary PLY; it holds all that a mesh has.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    _save(path, _ply_bytes(mesh))
    return ()


def write_obj(path: Path, mesh: Mesh) -> tuple[Remark, ...]:
    """Write an OBJ; it holds all that a mesh has.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    _save(path, _obj_bytes(mesh))
    return ()


def write_stl(path: Path, mesh: Mesh) -> tuple[Remark, ...]:
    """Write a binary STL; remark on it where colours are lost.

    Raises
    ------
    FileError
        If there are no faces, or it cannot be written.
    """
    if not len(mesh.faces):
        raise FileError(path, "cannot be written: STL needs faces", "take .ply")
    _save(path, _stl_bytes(mesh))
    lost = remark("not-kept", "STL has no colours")
    return (lost,) if mesh.colors is not None else ()


def _save(path: Path, content: bytes) -> None:
    try:
        path.write_bytes(content)
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror})") from None


def _ply_bytes(mesh: Mesh) -> bytes:
    vertices, faces = mesh.vertices, mesh.faces
    normals, colors = mesh.normals, mesh.colors
    fields = [(axis, "<f4") for axis in "xyz"]
    if normals is not None:
        fields += [(axis, "<f4") for axis in ("nx", "ny", "nz")]
    if colors is not None:
        fields += [(name, "u1") for name in ("red", "green", "blue")]
    table = np.zeros(len(vertices), dtype=fields)
    values = [part for part in (vertices, normals, colors) if part is not None]
    for (name, _), column in zip(fields, np.hstack(values).T, strict=True):
        table[name] = column
    words = {"<f4": "float", "u1": "uchar"}
    lines = ["ply", "format binary_little_endian 1.0", "comment unit m"]
    lines += [f"element vertex {len(vertices)}"]
    lines += [f"property {words[kind]} {name}" for name, kind in fields]
    body = table.tobytes()
    if len(faces):
        lines += [f"element face {len(faces)}"]
        lines += ["property list uchar int vertex_indices"]
        rows = np.zeros(len(faces), dtype=[("count", "u1"), ("at", "<i4", (3,))])
        rows["count"], rows["at"] = 3, faces
        body += rows.tobytes()
    return "\n".join([*lines, "end_header", ""]).encode() + body


def _stl_bytes(mesh: Mesh) -> bytes:
    """STL as numbers: a head, then each triangle's normal, corners and two bytes."""
    fields = [("normal", "<f4", (3,)), ("at", "<f4", (3, 3)), ("more", "<u2")]
    rows = np.zeros(len(mesh.faces), dtype=fields)
    rows["at"] = mesh.vertices[mesh.faces]
    flat = face_normals(mesh.vertices, mesh.faces)
    size = np.linalg.norm(flat, axis=1, keepdims=True)
    rows["normal"] = flat / np.where(size > 0.0, size, 1.0)
    head = b"handclean: unit m".ljust(_STL_TITLE_BYTES)
    return head + len(rows).to_bytes(4, "little") + rows.tobytes()


def _obj_bytes(mesh: Mesh) -> bytes:
    rows = np.round(mesh.vertices, 9)
    if mesh.colors is not None:
        rows = np.hstack([rows, np.round(mesh.colors / 255.0, 4)])
    lines = ["# unit m"]
    lines += ["v " + " ".join(f"{x:.9g}" for x in row) for row in rows.tolist()]
    if mesh.normals is not None:
        normals = np.round(mesh.normals, 6).tolist()
        lines += ["vn " + " ".join(f"{x:.6g}" for x in row) for row in normals]
    word = "{0}//{0}" if mesh.normals is not None else "{0}"
    for face in (mesh.faces + 1).tolist():
        lines.append("f " + " ".join(word.format(at) for at in face))
    return ("\n".join(lines) + "\n").encode()
