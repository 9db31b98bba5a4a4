"""Meshes and point clouds of any program: PLY, OBJ, STL; in and out.

None of these formats has a unit of length. What handclean writes is in metres and says
so in a comment (``unit m``), which it heeds in any file; otherwise ``--unit`` decides,
and without it the file is refused with what its size would be in each unit. A size that
no scan of a hand has is refused whoever stated the unit.

Vertices are neither merged nor put in another order, save in STL, which repeats every
vertex in each of its triangles. Materials and textures are left alone: no other file is
opened.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handclean.arrays import Bytes, Floats, Ints, expect_shape
from handclean.errors import FileError, UsageError
from handclean.hand.surface import face_normals, is_closed, volume
from handclean.io.formats import BY_SUFFIX, MESHES, function
from handclean.io.mesh.raw import RawMesh
from handclean.io.shared.reading import load
from handclean.io.shared.settle import METRES, in_metres, settle_unit
from handclean.remarks import Remark, length_in_words

SMALLEST_SCAN_M, LARGEST_SCAN_M = 0.06, 1.2
"""[m] longest side of what may be a scan of a hand, table and all (chosen)."""

_HAND_SIDE_M = (0.08, 0.6)
"""[m] longest side of what is likely to be one, to suggest a unit (chosen)."""

_CORE_PERCENTILES = (2.0, 98.0)
"""[%] between these the size is taken, so that a few outliers do not make it
(chosen)."""

_MOST_COORDINATE = 1e9
"""No coordinate is larger in any unit (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """V vertices, and F triangles where they are known.

    Attributes
    ----------
    vertices : (V, 3) [m].
    faces : (F, 3) counter-clockwise seen from outside; none for a point cloud.
    normals : (V, 3) unit outward normals (zero where unknown), or None.
    colors : (V, 3) red, green, blue, or None.
    unit : of the file it was read from.
    remarks : what was odd about the file.
    """

    vertices: Floats
    faces: Ints
    normals: Floats | None = None
    colors: Bytes | None = None
    unit: str = "m"
    remarks: tuple[Remark, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.vertices)
        expect_shape("vertices", self.vertices, count, 3)
        expect_shape("faces", self.faces, "F", 3)
        if self.normals is not None:
            expect_shape("normals", self.normals, count, 3)
        if self.colors is not None:
            expect_shape("colors", self.colors, count, 3)


def read_mesh(path: Path, *, unit: str | None = None) -> Mesh:
    """Read a mesh or a point cloud, by its suffix.

    Parameters
    ----------
    unit : of the file's lengths, mm, cm or m, where it does not say (``--unit``).

    Raises
    ------
    FileError
        If it cannot be read as what its suffix says, has no vertices, vertices that are
        no numbers, or a size that no hand has.
    UsageError
        If its unit is not known, or not the stated one.
    """
    suffix = path.suffix.lower()
    if suffix not in MESHES:
        known = " ".join(MESHES)
        raise FileError(path, f"no mesh format is called '{suffix}'", f"known: {known}")
    raw: RawMesh = function(BY_SUFFIX[suffix].read)(path, load(path))
    _check(path, raw)
    remarks: list[Remark] = []
    settled = _unit(path, raw, unit, remarks)
    normals = None if raw.normals is None else _unit_length(raw.normals)
    return Mesh(
        vertices=in_metres(raw.vertices, settled),
        faces=raw.faces,
        normals=normals,
        colors=raw.colors,
        unit=settled,
        remarks=tuple(remarks),
    )


def expect_faces(path: Path, mesh: Mesh) -> None:
    """Refuse a point cloud where a mesh is needed, and one that is inside out.

    Raises
    ------
    FileError
    """
    if not len(mesh.faces):
        wrong = f"has {len(mesh.vertices)} points and no faces"
        raise FileError(path, wrong, "a mesh is needed")
    if looks_inwards(mesh):
        raise FileError(path, "its faces look inwards", "turn them round in its editor")


def looks_inwards(mesh: Mesh) -> bool:
    """Whether a mesh is inside out.

    A closed one tells by its volume; of an open one, as scanners leave it, most of the
    area should look away from the middle; of a point cloud, most normals.
    """
    middle = np.median(mesh.vertices, axis=0)
    if len(mesh.faces):
        if is_closed(mesh.faces):
            return volume(mesh.vertices - middle, mesh.faces) < 0.0
        flat = face_normals(mesh.vertices, mesh.faces)
        away = mesh.vertices[mesh.faces].mean(axis=1) - middle
    elif mesh.normals is not None:
        flat, away = mesh.normals, mesh.vertices - middle
    else:
        return False
    outward = np.einsum("nk,nk->n", flat, away)
    return bool(outward.sum() < -0.3 * np.abs(outward).sum())


def write_mesh(path: Path, mesh: Mesh, *, suffix: str = "") -> tuple[Remark, ...]:
    """Write a mesh in metres, by the suffix of its path or the given one.

    Returns
    -------
    what the format cannot hold

    Raises
    ------
    FileError
        If it cannot be written.
    """
    kind = (suffix or path.suffix).lower()
    if kind not in MESHES:
        known = " ".join(MESHES)
        raise UsageError(
            f"no mesh format is called '{kind}'; known: {known}", where=path
        )
    lost: tuple[Remark, ...] = function(BY_SUFFIX[kind].write)(path, mesh)
    return lost


def _check(path: Path, raw: RawMesh) -> None:
    if not len(raw.vertices):
        raise FileError(path, "has no vertices")
    count = len(raw.vertices)
    bad = np.flatnonzero(~(np.abs(raw.vertices) < _MOST_COORDINATE).all(axis=1))
    if len(bad):
        wrong = f"{len(bad)} of {count} vertices are not numbers, or too large"
        raise FileError(path, f"{wrong}, the first is vertex {bad[0]}")
    if raw.faces.size and not 0 <= raw.faces.min() <= raw.faces.max() < count:
        right = f"its vertices are 0 to {count - 1}"
        raise FileError(path, "a face names a vertex that is not there", right)


def _unit(path: Path, raw: RawMesh, option: str | None, remarks: list[Remark]) -> str:
    """Return the file's unit, the one of a sensible size.

    Raises
    ------
    UsageError
        If nobody says.
    FileError
        If a hand would be far too large or small.
    """
    low, high = np.percentile(raw.vertices, _CORE_PERCENTILES, axis=0)
    size = float((high - low).max())
    hint = _likely(size)
    if not raw.unit and option is None:
        say = f"does not say its unit, its longest side is {size:.4g}"
        likely = f" (a hand, if that is {hint})" if hint else ""
        raise UsageError(f"{say}; give --unit {hint or 'mm|cm|m'}{likely}", where=path)
    unit = settle_unit(path, raw.unit or None, option, remarks)
    metres = size * METRES[unit.lower()]
    if not SMALLEST_SCAN_M <= metres <= LARGEST_SCAN_M:
        right = f"--unit {hint} would make it a hand" if hint else "no unit fits a hand"
        if raw.unit and hint and option is None:
            right = f"it says {raw.unit}; --unit {hint} would make it a hand"
        wrong = f"the scan is {length_in_words(metres, 4)} long in {unit}"
        raise FileError(path, wrong, right)
    return unit


def _likely(size: float) -> str:
    """Return the unit in which a longest side is a hand's, or nothing."""
    low, high = _HAND_SIDE_M
    return next((u for u in ("mm", "cm", "m") if low <= size * METRES[u] <= high), "")


def _unit_length(normals: Floats) -> Floats:
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.linalg.norm(normals, axis=1, keepdims=True)
        good = np.isfinite(size) & (size > 0.0)
        out: Floats = np.where(good, normals / np.where(good, size, 1.0), 0.0)
    return out
