"""OBJ and STL as trimesh reads them."""

import re
import warnings
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from handclean.arrays import Bytes, Floats
from handclean.errors import FileError
from handclean.io.ply import Ply, as_bytes


def read_by_trimesh(path: Path, content: bytes) -> Ply:
    """Read OBJ or STL by trimesh; whatever it raises, the file is not one.

    Its warnings count as errors: they say that numbers were left out.

    Raises
    ------
    FileError
        If it is not one.
    """
    kind = path.suffix.lower().removeprefix(".")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = trimesh.load(
                BytesIO(content),
                file_type=kind,
                process=False,
                maintain_order=True,
                skip_materials=True,
                group_material=False,
                force="mesh" if kind == "stl" else None,
            )
            return _merged(found) if kind == "stl" else _plain(path, content, found)
    except FileError:
        raise
    except Exception as error:
        reason = (str(error).splitlines() or [""])[0][:80]
        wrong = f"is not {kind.upper()} ({reason or type(error).__name__})"
        raise FileError(path, wrong, "a cut or damaged file?") from None


def _plain(path: Path, content: bytes, found: Any) -> Ply:
    """Return an OBJ as read; a scene of several parts is put together."""
    parts = list(found.geometry.values()) if hasattr(found, "geometry") else [found]
    if not parts:
        raise FileError(path, "has no vertices")
    vertices: list[Floats] = []
    faces, colors, normals = [], [], []
    start = 0
    for part in parts:
        vertices.append(np.asarray(part.vertices, dtype=np.float64).reshape(-1, 3))
        faces.append(
            np.asarray(getattr(part, "faces", np.zeros((0, 3)))).reshape(-1, 3) + start
        )
        start += len(vertices[-1])
        colors.append(_colors_of(part))
        normals.append(_normals_of(part))
    return Ply(
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces).astype(np.int64),
        normals=_all_or_none(normals),
        colors=_all_or_none(colors),
        unit=_commented(content[:4096]),
    )


def _all_or_none(parts: list[Any]) -> Any:
    return None if any(part is None for part in parts) else np.concatenate(parts)


def _colors_of(part: Any) -> Bytes | None:
    if isinstance(part, trimesh.PointCloud):
        colors = part.colors
    elif part.visual.kind == "vertex":
        colors = part.visual.vertex_colors
    else:
        return None
    if colors is None or len(colors) != len(part.vertices):
        return None
    return as_bytes(np.asarray(colors)[:, :3])


def _normals_of(part: Any) -> Floats | None:
    """Normals as the file had them; trimesh would compute missing ones."""
    if "vertex_normals" not in getattr(part, "_cache", ()):
        return None
    normals: Floats = np.asarray(part.vertex_normals, dtype=np.float64)
    return normals if normals.shape == part.vertices.shape else None


def _merged(found: Any) -> Ply:
    """Return an STL with every vertex once, in the order of their first use."""
    corners = np.asarray(found.vertices, dtype=np.float64)
    faces = np.asarray(found.faces, dtype=np.int64)
    _, first, place = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(first)
    inverse = np.argsort(rank)
    head = str(found.metadata.get("header", "")).encode()
    return Ply(
        vertices=corners[first[rank]],
        faces=inverse[place.ravel()][faces].reshape(-1, 3),
        normals=None,
        colors=None,
        unit=_commented(head),
    )


def _commented(head: bytes) -> str:
    """Return the unit that a comment states, or nothing."""
    found = re.search(rb"(?:^#|handclean:) *unit (mm|cm|m)\b", head, re.MULTILINE)
    return found[1].decode() if found else ""
