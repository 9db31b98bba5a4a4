"""Joint trees as TOML: any articulated or rigid thing, with markers on it or not.

::

    name = "pliers"
    kind = "rigid"              # or "hand"
    side = ""                   # or "left", "right"

    [[bone]]                    # the first is the root
    name = "handle"
    [[bone]]
    name = "jaw"
    parent = "handle"
    offset = [0.0, 62.0, 0.0]   # mm, its joint in the parent's frame
    [[bone.hinge]]
    name = "opening"
    axis = [0.0, 0.0, 1.0]
    limits = [0.0, 40.0]        # degrees

    [[marker]]
    label = "P1"
    bone = "jaw"
    at = [3.0, 30.0, 5.0]       # mm in the bone's frame

In the zero posture all bones' frames are parallel to the root's. A rigid object needs
only one bone.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, HandcleanError, UnknownNameError, UsageError
from handclean.hand.marker_set import MOST_MM, MarkerSet
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.tomlfile import Table, read_table
from handclean.tree import MIRROR, MOST_BONES, JointTree, rigid_tree

_KEYS = {"name", "kind", "side", "bone", "marker"}
_BONE = {"name", "joint", "parent", "offset", "hinge"}
_HINGE = {"name", "axis", "limits"}
_MARKER = {"label", "bone", "at"}

_LEAST_AXIS = 1e-9
"""[-] a hinge axis is longer (chosen)."""


def rigid_subject(marker_set: MarkerSet, side: str = "") -> Subject:
    """Return the tree of one bone that a rigid marker set sits on.

    Parameters
    ----------
    side : "left" or "right"; "" for the set's. Places are as the set has them on its
        own side, mirrored on the other.

    Raises
    ------
    UnknownNameError
        If a marker sits on another bone.
    UsageError
        If a side is asked for of a set that has none.
    """
    if side and not marker_set.side:
        raise UsageError(
            f"--side {side}: marker set {marker_set.name} is a thing without sides"
        )
    tree = rigid_tree(marker_set.name)
    model = marker_set.on(tree)
    mirrored = bool(side) and side != marker_set.side
    return Subject(
        name=marker_set.name,
        model=replace(
            model,
            tree=replace(tree, side=side or marker_set.side),
            at=model.at * MIRROR if mirrored else model.at,
        ),
        marker_set=marker_set.name,
        marker_sigma=np.full(len(marker_set.labels), np.nan),
    )


def load_skeleton(path: Path | str) -> Subject:
    """Load a joint tree, and the markers on it, from a TOML file.

    Parameters
    ----------
    path : of the file; places in it are millimetres, angles degrees.

    Returns
    -------
    a subject, in metres and radians, whose ``marker_sigma`` (M,) is NaN

    Raises
    ------
    FileError, UnknownNameError
        If the file is not such a tree.
    """
    path = Path(path)
    content = read_table(path, "not a skeleton")
    content.expect_keys(_KEYS)
    bones = content.tables("bone", _BONE)
    if not bones:
        raise content.error("no [[bone]]", "the first is the root")
    if len(bones) > MOST_BONES:
        raise content.error(f"has {len(bones)} bones", f"{MOST_BONES} are the most")
    tree = _tree(content, bones)
    markers = content.tables("marker", _MARKER)
    labels = tuple(row.name("label") for row in markers)
    at = [row.vector("at", 3, most=MOST_MM) for row in markers]
    return Subject(
        name=tree.subject,
        model=Model(
            tree=tree,
            labels=labels,
            bone=np.array([_bone(row, tree) for row in markers], dtype=np.int64),
            at=np.array(at).reshape(-1, 3) / 1e3,
        ),
        marker_set=tree.subject,
        marker_sigma=np.full(len(labels), np.nan),
    )


def _bone(marker: Table, tree: JointTree) -> int:
    """Number of a marker's bone; the root where it names none."""
    name = marker.text("bone", tree.bones[0])
    if name not in tree.bones:
        raise UnknownNameError(marker.where, "bone", name, tree.bones)
    return tree.bone(name)


def _tree(content: Table, bones: tuple[Table, ...]) -> JointTree:
    """Make a joint tree of its bones and their hinges."""
    names = tuple(row.name("name") for row in bones)
    hinges = [
        (bone, hinge)
        for bone, row in enumerate(bones)
        for hinge in row.tables("hinge", _HINGE)
    ]
    parents = [_parent(row, names[:bone]) for bone, row in enumerate(bones)]
    offsets = [row.vector("offset", 3, most=MOST_MM) for row in bones[1:]]
    limits = [
        hinge.vector("limits", 2) if "limits" in hinge else (-180.0, 180.0)
        for _, hinge in hinges
    ]
    try:
        return JointTree(
            kind=content.text("kind", "rigid"),
            side=content.text("side", ""),
            bones=names,
            joints=tuple(
                row.text("joint", name) for row, name in zip(bones, names, strict=True)
            ),
            parents=np.array(parents, dtype=np.int64),
            offsets=np.array([(0.0, 0.0, 0.0), *offsets]) / 1e3,
            hinges=tuple(hinge.name("name") for _, hinge in hinges),
            hinge_bone=np.array([bone for bone, _ in hinges], dtype=np.int64),
            axes=np.array([_axis(hinge) for _, hinge in hinges]).reshape(-1, 3),
            limits=np.radians(np.array(limits).reshape(-1, 2)),
            subject=content.text("name", content.file.stem),
        )
    except FileError:
        raise
    except HandcleanError as error:
        raise content.error(str(error)) from None


def _parent(row: Table, before: tuple[str, ...]) -> int:
    """Number of the bone that one hangs on, which comes before it; -1 of the root."""
    if not before:
        return -1
    name = row.text("parent", "")
    if name not in before:
        raise UnknownNameError(row.where, "bone before it", name, before)
    return before.index(name)


def _axis(hinge: Table) -> Floats:
    """(3,) unit axis of a hinge."""
    axis: Floats = np.array(hinge.vector("axis", 3, most=MOST_MM))
    length = float(np.linalg.norm(axis))
    if length < _LEAST_AXIS:
        raise hinge.error("a hinge axis of length 0", "axis should be a direction")
    return axis / length
