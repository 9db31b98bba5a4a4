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
from typing import TYPE_CHECKING

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UnknownNameError
from handclean.hand.surface import rest_joints, vertex_normals
from handclean.hand.template import bone_frame, bone_places, template
from handclean.hand.template_surface import shipped_skin
from handclean.tomlfile import Table, find_file, read_table, shipped_names
from handclean.tree import JointTree

if TYPE_CHECKING:
    from handclean.hand.model import Model

SHIPPED = Path(__file__).parents[1] / "data" / "marker_sets"

_KEYS = {"name", "side", "source", "kind", "marker", "forearm", "note"}
_MARKER_KEYS = {"label", "bone", "at", "vertex", "lift"}

_LEAST_MEDIAN_MM = {"hand": 4.0, "rigid": 1.0}
"""[mm] half of a set's markers are farther from the joints of their bones (chosen)."""

_MOST_PLACE_MM = {"hand": 300.0, "forearm": 400.0}
"""[mm] no marker of the hand's bone, or the forearm's, is farther from its joint
(chosen)."""

_MOST_FINGER_MM = 100.0
"""[mm] no marker is farther from its bone's joint, on a rod either (chosen)."""

MOST_MM = 1e6
"""[mm] no number of a marker set or a joint tree is larger: a kilometre (chosen)."""


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

    def on(self, tree: JointTree) -> "Model":
        """Put the markers on a hand.

        Raises
        ------
        UnknownNameError
            If the tree lacks a bone.
        """
        from handclean.hand.model import Model  # late: it brings numba, 0.2 s

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
    return shipped_names(SHIPPED)


def load_marker_set(name: str | Path) -> MarkerSet:
    """Load a marker set by its shipped name or from a TOML file.

    Parameters
    ----------
    name : of a set that ships, or a file.

    Raises
    ------
    UnknownNameError
        If there is neither a file nor a shipped set of that name.
    FileError
        If the file is not a marker set.
    """
    path = find_file(name, SHIPPED, "--marker-set", "marker set", shipped())
    right = "give a shipped name or a file"
    return _marker_set(read_table(path, "not a marker set", right))


def _marker_set(content: Table) -> MarkerSet:
    """Make a marker set of what its file says."""
    content.expect_keys(_KEYS)
    kind = content.word("kind", ("hand", "rigid"), "hand")
    side = content.word("side", ("left", "right"), "" if kind == "rigid" else None)
    rows = content.tables("marker", _MARKER_KEYS)
    if not rows:
        raise content.error("no [[marker]]", "list at least one marker")
    labels = [row.name("label") for row in rows]
    for label, count in Counter(labels).items():
        if count > 1:
            raise content.error(f"label '{label}' twice", "labels should be unique")
    places = [_place(row, kind) for row in rows]
    bones = tuple(bone for bone, _ in places)
    if kind == "hand":
        known = template("left", forearm=True).bones
        for bone in bones:
            if bone not in known:
                raise UnknownNameError(content.where, "bone", bone, known)
    at = np.array([at for _, at in places])
    _expect_millimetres(content.file, kind, labels, bones, at)
    return MarkerSet(
        name=content.text("name", content.file.stem),
        source=content.text("source", ""),
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
    if middle < _LEAST_MEDIAN_MM[kind]:
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
        most = _MOST_PLACE_MM.get(bone, _MOST_FINGER_MM)
        if far > most:
            raise FileError(
                path,
                f"marker '{label}' lies {far:.4g} mm from the joint of {bone}",
                f"at is in millimetres, and no marker is farther than {most:g}",
            )


def _place(row: Table, kind: str) -> tuple[str, Floats]:
    """Bone and side-free place (3,) [mm] of a marker."""
    if "vertex" in row:
        return _on_vertex(row)
    if "lift" in row:
        raise row.error("lift without vertex", "use at alone")
    is_rigid = kind == "rigid" and "bone" not in row
    bone = "root" if is_rigid else row.name("bone")
    right = "at should be three numbers in millimetres"
    return bone, np.array(row.vector("at", 3, most=MOST_MM, right=right))


def _on_vertex(row: Table) -> tuple[str, Floats]:
    """Bone and side-free place (3,) [mm] of a vertex of the template's skin."""
    if "at" in row or "bone" in row:
        raise row.error("vertex beside bone or at", "give one of them")
    skin, tree = shipped_skin().fine, template("left")
    count = len(skin.vertices)
    right = f"vertex should be a number from 0 to {count - 1}"
    vertex = row.whole_number("vertex", 0, count - 1, right)
    right = "lift should be a number of millimetres"
    lift = row.number("lift", 0.0, least=-MOST_MM, most=MOST_MM, right=right)
    bone = int(skin.bones[vertex, 0])
    name = tree.bones[bone]
    at = 1e3 * (skin.vertices[vertex] - rest_joints(tree)[bone])
    at += lift * vertex_normals(skin.vertices, skin.faces)[vertex]
    return name, at @ bone_frame(name)
