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
from typing import Any

import numpy as np

from handclean.errors import (
    FileError,
    HandcleanError,
    Place,
    UnknownNameError,
    UsageError,
)
from handclean.hand.marker_set import MarkerSet
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.toml import expect_few, read_toml
from handclean.tree import LONGEST_NAME, MIRROR, MOST_BONES, JointTree

_MOST = 1e6
"""No number of a tree is larger; as millimetres that is a kilometre."""

_KEYS = {
    "": {"name", "kind", "side", "bone", "marker"},
    "bone": {"name", "joint", "parent", "offset", "hinge"},
    "hinge": {"name", "axis", "limits"},
    "marker": {"label", "bone", "at"},
}


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
    tree = JointTree(
        kind="rigid",
        side="",
        bones=("root",),
        joints=("root",),
        parents=np.array([-1]),
        offsets=np.zeros((1, 3)),
        hinges=(),
        hinge_bone=np.zeros(0, dtype=np.int64),
        axes=np.zeros((0, 3)),
        limits=np.zeros((0, 2)),
        subject=marker_set.name,
    )
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

    Raises
    ------
    FileError, UnknownNameError
        If the file is not such a tree.
    """
    path = Path(path)
    content = read_toml(path, "not a skeleton")
    _check_keys(path, "", content)
    bones = _tables(path, "bone", content.get("bone"))
    if not bones:
        raise FileError(path, "no [[bone]]", "the first is the root")
    if len(bones) > MOST_BONES:
        raise FileError(path, f"has {len(bones)} bones", f"{MOST_BONES} are the most")
    tree = _tree(path, content, bones)
    markers = _tables(path, "marker", content.get("marker"))
    for row in markers:
        if row.get("bone", tree.bones[0]) not in tree.bones:
            raise UnknownNameError(path, "bone", str(row["bone"]), tree.bones)
    bone = [tree.bone(row.get("bone", tree.bones[0])) for row in markers]
    at = [_numbers(path, "at", row.get("at"), 3) / 1e3 for row in markers]
    labels = tuple(_text(path, "label", row) for row in markers)
    return Subject(
        name=tree.subject,
        model=Model(
            tree=tree,
            labels=labels,
            bone=np.array(bone, dtype=np.int64),
            at=np.array(at).reshape(-1, 3),
        ),
        marker_set=tree.subject,
        marker_sigma=np.full(len(labels), np.nan),
    )


def _tree(
    path: Path, content: dict[str, Any], bones: list[dict[str, Any]]
) -> JointTree:
    names = tuple(_text(path, "name", row) for row in bones)
    parents, offsets, hinges = [-1], [np.zeros(3)], []
    for index, row in enumerate(bones):
        if index > 0:
            up = row.get("parent", "")
            if up not in names[:index]:
                raise UnknownNameError(
                    Place(path, f" bone {names[index]}"),
                    "bone before it",
                    up,
                    names[:index],
                )
            parents.append(names.index(up))
            offsets.append(_numbers(path, "offset", row.get("offset"), 3) / 1e3)
        for hinge in _tables(path, "hinge", row.get("hinge")):
            hinges.append((index, hinge))
    axes = [_numbers(path, "axis", h.get("axis"), 3) for _, h in hinges]
    lengths = [np.linalg.norm(axis) for axis in axes]
    if any(length < 1e-9 for length in lengths):
        raise FileError(path, "a hinge axis of length 0", "axis should be a direction")
    unit = [axis / length for axis, length in zip(axes, lengths, strict=True)]
    limits = [
        np.radians(_numbers(path, "limits", h.get("limits", [-180, 180]), 2))
        for _, h in hinges
    ]
    try:
        return JointTree(
            kind=str(content.get("kind", "rigid")),
            side=str(content.get("side", "")),
            bones=names,
            joints=tuple(
                str(row.get("joint", name))
                for row, name in zip(bones, names, strict=True)
            ),
            parents=np.array(parents, dtype=np.int64),
            offsets=np.array(offsets),
            hinges=tuple(_text(path, "name", h) for _, h in hinges),
            hinge_bone=np.array([index for index, _ in hinges], dtype=np.int64),
            axes=np.array(unit).reshape(-1, 3),
            limits=np.array(limits).reshape(-1, 2),
            subject=str(content.get("name", path.stem)),
        )
    except FileError:
        raise
    except HandcleanError as error:
        raise FileError(path, str(error)) from None


def _check_keys(path: Path, table: str, row: dict[str, Any]) -> None:
    for key in row:
        if key not in _KEYS[table]:
            where = Place(path, f" [[{table}]]" if table else "")
            raise UnknownNameError(where, "key", key, _KEYS[table])


def _tables(path: Path, name: str, found: Any) -> list[dict[str, Any]]:
    rows = [] if found is None else found
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise FileError(path, f"{name} is {found!r:.60}", f"write [[{name}]] tables")
    expect_few(path, name, rows)
    for row in rows:
        _check_keys(path, name, row)
    return rows


def _text(path: Path, key: str, row: dict[str, Any]) -> str:
    value = row.get(key)
    if not isinstance(value, str) or not value:
        raise FileError(path, f"{key} is {value!r:.60}", f"give {key} = '...'")
    if len(value) > LONGEST_NAME:
        wrong = f"a {key} has {len(value)} characters"
        raise FileError(path, wrong, f"{LONGEST_NAME} are the most")
    return value


def _numbers(path: Path, key: str, value: Any, count: int) -> np.ndarray[Any, Any]:
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (count,) or not (np.abs(found) <= _MOST).all():
        raise FileError(path, f"{key} is {value!r:.60}", f"give {count} numbers")
    return found
