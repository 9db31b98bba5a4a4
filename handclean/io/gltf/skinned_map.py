"""What a joint map says of skinned hands, beyond `handclean.io.shared.joint_map`.

``flexion``
    (optional) what fingers flex about, in the frames of their own joints, for rigs
    whose joints' axes mean that; else it is found from how the fingers are bent.
``[tips]``
    (optional) the joint or node at the end of each finger.
``[merged]``
    (optional) joints of the skin that move with a bone of ours. One that is listed
    nowhere moves with the bone of the nearest joint above it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UnknownNameError, UsageError
from handclean.hand.template import FINGERS, template
from handclean.io.shared.joint_map import (
    SHIPPED,
    JointMap,
    is_direction,
    load_joint_map,
)
from handclean.toml import read_toml


@dataclass(frozen=True, kw_only=True)
class SkinnedMap:
    """Which joints of a skin belong to which bones.

    Attributes
    ----------
    bones : joint map with the joint at the root end of each bone.
    flexion : (3,) unit axis in the outer joints' frames, or None.
    tips : joint or node at the end of each finger.
    merged : joints that move with a bone, besides the one at its root.
    """

    bones: JointMap
    flexion: Floats | None = None
    tips: Mapping[str, str] = field(default_factory=dict)
    merged: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def load_skinned_map(name: str) -> SkinnedMap:
    """Load a joint map by its shipped name, or from a TOML file.

    Raises
    ------
    UsageError
        If no map of that name ships.
    FileError, UnknownNameError
        If the file is not a joint map, or not one of an entire hand.
    """
    path = Path(name)
    if path.suffix != ".toml":
        names = sorted(path.stem for path in SHIPPED.glob("*.toml"))
        if name not in names:
            known = ", ".join(names)
            raise UsageError(
                f"--joint-map: none is called '{name}'; shipped: {known}; "
                "or name a .toml file"
            )
        path = SHIPPED / f"{name}.toml"
    bones = load_joint_map(path)
    content = read_toml(path, "not a joint map")
    if bones.left_handed:
        raise FileError(path, "left_handed is true", "glTF's axes are right-handed")
    ours = template("left").bones
    _check(path, "bone", bones.bones, ours)
    for bone in ours:
        if bone not in bones.bones:
            right = f"say in [bones] which joint is at the root of {bone}"
            raise FileError(path, f"bone {bone} is not mapped", right)
    tips = _table(path, "tips", content, str)
    merged = _table(path, "merged", content, list)
    _check(path, "finger", tips, FINGERS)
    _check(path, "bone", merged, ours)
    return SkinnedMap(
        bones=bones,
        flexion=_axis(path, content.get("flexion")),
        tips=tips,
        merged={bone: tuple(map(str, names)) for bone, names in merged.items()},
    )


def _check(
    path: Path, kind: str, given: Mapping[str, Any], known: tuple[str, ...]
) -> None:
    for name in given:
        if name not in known:
            raise UnknownNameError(path, kind, name, known)


def _table(
    path: Path, key: str, content: Mapping[str, Any], kind: type
) -> dict[str, Any]:
    found = content.get(key, {})
    rows = found.items() if isinstance(found, dict) else [(key, found)]
    for name, value in rows:
        if not isinstance(value, kind) or not isinstance(found, dict):
            what = "a joint's name" if kind is str else "a list of joints' names"
            raise FileError(path, f"[{key}] {name} is {value!r:.60}", f"give {what}")
    return dict(rows)


def _axis(path: Path, value: Any) -> Floats | None:
    if value is None:
        return None
    try:
        axis = np.array(value, dtype=float)
    except (TypeError, ValueError):
        axis = np.zeros(0)
    if not is_direction(axis):
        raise FileError(path, f"flexion is {value!r:.60}", "give an axis [x, y, z]")
    return axis / float(np.linalg.norm(axis))
