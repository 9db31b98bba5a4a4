"""Marker sets: named markers on bones, as TOML, and how they sit on a hand.

Places are side-free, in millimetres in the bone's rest frame on the template hand:
(towards the thumb's side, along the bone to the fingertip, out of its back). They scale
with the hand. ``kind = "rigid"`` makes a set of one bone called "root", for objects.

A marker of a hand may name a ``vertex`` of the template's skin instead of bone and
place; it then sits there, on the bone that moves the vertex most, or ``lift``
millimetres out of the skin.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, Place, UnknownNameError
from handclean.hand.model import Model
from handclean.hand.surface import rest_joints, vertex_normals
from handclean.hand.template import bone_frame, bone_places, template
from handclean.hand.template_surface import shipped_skin
from handclean.toml import expect_few, read_toml
from handclean.tree import JointTree

SHIPPED = Path(__file__).parents[1] / "data" / "marker_sets"

_KEYS = {"name", "side", "source", "kind", "marker", "forearm", "note"}
_MARKER_KEYS = {"label", "bone", "at", "vertex", "lift"}

_NEAR = 4.0
"""[mm] no marker on the skin is nearer to the joint of its bone."""

_FAR = {"hand": 300.0, "forearm": 400.0}
_FAR_FINGER = 100.0
"""[mm] no marker is farther from its bone's joint, on a rod either."""


_MOST = 1e6
"""[mm] no number of a set is larger."""


@dataclass(frozen=True, kw_only=True)
class MarkerSet:
    """M named markers.

    Attributes
    ----------
    name, source : what it is called and where its places come from.
    kind : "hand" or "rigid"; side : "left", "right" or "" (rigid).
    labels, bones : M names.
    at : (M, 3) [m] side-free places in the bones' rest frames.
    """

    name: str
    source: str
    kind: str
    side: str
    labels: tuple[str, ...]
    bones: tuple[str, ...]
    at: Floats

    @property
    def forearm(self) -> bool:
        """Whether a marker sits on the forearm, so that the tree needs one."""
        return "forearm" in self.bones

    def on(self, tree: JointTree) -> Model:
        """Put the markers on a hand.

        Raises
        ------
        UnknownNameError
            If the tree lacks a bone.
        """
        for bone in self.bones:
            if bone not in tree.bones:
                where = f"marker set {self.name}"
                raise UnknownNameError(where, "bone", bone, tree.bones)
        return Model(
            tree=tree,
            labels=self.labels,
            bone=np.array([tree.bone(bone) for bone in self.bones], dtype=np.int64),
            at=bone_places(tree, list(self.bones), self.at),
        )


def shipped() -> tuple[str, ...]:
    """Names of the marker sets that come with handclean."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.toml")))


def load_marker_set(name: str | Path) -> MarkerSet:
    """Load a marker set by its shipped name or from a TOML file.

    Raises
    ------
    UnknownNameError
        If there is neither a file nor a shipped set of that name.
    FileError
        If the file is not a marker set.
    """
    path = Path(name)
    if path.suffix != ".toml":
        if str(name) not in shipped():
            raise UnknownNameError("--marker-set", "marker set", str(name), shipped())
        path = SHIPPED / f"{name}.toml"
    right = "give a shipped name or a file"
    return _from_toml(path, read_toml(path, "not a marker set", right))


def _from_toml(path: Path, content: dict[str, Any]) -> MarkerSet:
    for key in content:
        if key not in _KEYS:
            raise UnknownNameError(path, "key", key, _KEYS)
    kind = content.get("kind", "hand")
    if kind not in ("hand", "rigid"):
        raise FileError(path, f"kind '{kind}'", "kind should be hand or rigid")
    side = content.get("side", "" if kind == "rigid" else None)
    if side not in ("left", "right") and not (kind == "rigid" and side == ""):
        raise FileError(path, f"side is {side!r}", "side should be left or right")
    rows = content.get("marker", [])
    if not isinstance(rows, list) or not rows:
        raise FileError(path, "no [[marker]]", "list at least one marker")
    expect_few(path, "marker", rows)
    default = {"bone": "root"} if kind == "rigid" else {}
    rows = [_marker(path, number, {**default, **row}) for number, row in _tables(rows)]
    labels = [row[0] for row in rows]
    for label, count in Counter(labels).items():
        if count > 1:
            raise FileError(path, f"label '{label}' twice", "labels should be unique")
    bones = tuple(row[1] for row in rows)
    if kind == "hand":
        known = template("left", forearm=True).bones
        for bone in bones:
            if bone not in known:
                raise UnknownNameError(path, "bone", bone, known)
    at = np.array([row[2] for row in rows])
    _expect_millimetres(path, kind, labels, bones, at)
    return MarkerSet(
        name=str(content.get("name", path.stem)),
        source=str(content.get("source", "")),
        kind=kind,
        side=side,
        labels=tuple(labels),
        bones=bones,
        at=at / 1e3,
    )


def _expect_millimetres(
    path: Path, kind: str, labels: list[str], bones: tuple[str, ...], at: Floats
) -> None:
    """Expect (M, 3) places of another unit's size nowhere.

    Places in the joints themselves say nothing: sets of joints have them.
    """
    away = np.linalg.norm(at, axis=1)
    placed = away[away > 0.0]
    middle = float(np.median(placed)) if len(placed) else np.inf
    if middle < (_NEAR if kind == "hand" else 1.0):
        if kind == "hand":
            raise FileError(
                path,
                f"its markers lie {middle:.2g} mm from their joints (median), inside "
                "the fingers",
                f"at is in millimetres; are these {'m' if middle < 0.4 else 'cm'}?",
            )
        wrong = f"its markers lie {middle:.2g} mm from its origin (median)"
        raise FileError(path, wrong, "at is in millimetres; are these m?")
    if kind != "hand":
        return
    for label, bone, far in zip(labels, bones, away.tolist(), strict=True):
        most = _FAR.get(bone, _FAR_FINGER)
        if far > most:
            raise FileError(
                path,
                f"marker '{label}' lies {far:.4g} mm from the joint of {bone}",
                f"at is in millimetres, and no marker is farther than {most:g}",
            )


def _tables(rows: list[Any]) -> list[tuple[int, dict[str, Any]]]:
    return [(n, row if isinstance(row, dict) else {}) for n, row in enumerate(rows, 1)]


def _marker(path: Path, number: int, row: dict[str, Any]) -> tuple[str, str, Floats]:
    for key in row:
        if key not in _MARKER_KEYS:
            raise UnknownNameError(
                Place(path, f" marker {number}"), "key", key, _MARKER_KEYS
            )
    for key in ("label",) if "vertex" in row else ("label", "bone"):
        if not isinstance(row.get(key), str) or not row[key]:
            raise FileError(path, f"marker {number}: no {key}", f"give {key} = '...'")
    if "vertex" in row:
        return row["label"], *_on_vertex(path, f"marker {number} ({row['label']})", row)
    if "lift" in row:
        raise FileError(path, f"marker {number}: lift without vertex", "use at alone")
    try:
        at = np.array(row.get("at"), dtype=float)
    except (TypeError, ValueError):
        at = np.zeros(0)
    if at.shape != (3,) or not (np.abs(at) <= _MOST).all():
        right = "at should be three numbers in millimetres"
        raise FileError(path, f"marker {number} ({row['label']}): no place", right)
    return row["label"], row["bone"], at


def _on_vertex(path: Path, where: str, row: dict[str, Any]) -> tuple[str, Floats]:
    """Bone and side-free place [mm] of a vertex of the template's skin."""
    if "at" in row or "bone" in row:
        raise FileError(path, f"{where}: vertex beside bone or at", "give one of them")
    skin, tree = shipped_skin().fine, template("left")
    vertex, lift = row["vertex"], row.get("lift", 0.0)
    count = len(skin.vertices)
    if type(vertex) is not int or not 0 <= vertex < count:
        right = f"vertex should be a number from 0 to {count - 1}"
        raise FileError(path, f"{where}: vertex is {vertex!r}", right)
    if type(lift) not in (int, float) or not abs(lift) <= _MOST:
        right = "lift should be a number of millimetres"
        raise FileError(path, f"{where}: lift is {lift!r}", right)
    bone = int(skin.bones[vertex, 0])
    name = tree.bones[bone]
    at = 1e3 * (skin.vertices[vertex] - rest_joints(tree)[bone])
    at += lift * vertex_normals(skin.vertices, skin.faces)[vertex]
    return name, at @ bone_frame(name)
