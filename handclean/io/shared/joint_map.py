"""Joint maps: which joint of somebody's BVH hierarchy belongs to which bone of ours.

A TOML file with ``left_handed`` (the file's axes), ``unit_m`` (its unit of length),
``back`` (out of the back of the hand, in the frame of the root bone's joint) and a
table ``[bones]``: the joint at the root end of each bone. It says nothing of angles;
`handclean.io.bvh.angles` finds them from the motion. With ``exact = true`` the frames
of all joints are parallel in the zero posture, as `handclean.io.bvh.motion` writes
them, and the hinge angles are what went in (`handclean.io.bvh.own`). What a map says of
skinned hands besides is read by `handclean.io.gltf.skinned_map`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UnknownNameError
from handclean.toml import read_toml
from handclean.tree import JointTree

SHIPPED = Path(__file__).parents[2] / "data" / "joint_maps"

_KEYS = {"name", "source", "note", "left_handed", "unit_m", "back", "exact", "bones"}

SKINNED_KEYS = {"flexion", "tips", "merged"}
"""Keys that only skinned hands need."""


@dataclass(frozen=True, kw_only=True)
class JointMap:
    """Which joints of a BVH hierarchy belong to which bones.

    Attributes
    ----------
    name : what the map is called.
    left_handed : whether the file's axes are.
    unit_m : [m] the file's unit of length.
    back : (3,) unit vector out of the back of the hand, in its joint's frame.
    bones : the joint at the root end of each bone.
    exact : whether the file is as handclean writes them.
    """

    name: str
    left_handed: bool
    unit_m: float
    back: Floats
    bones: Mapping[str, str]
    exact: bool = False


def shipped() -> tuple[JointMap, ...]:
    """Joint maps that come with handclean."""
    return tuple(load_joint_map(path) for path in sorted(SHIPPED.glob("*.toml")))


def load_joint_map(path: Path) -> JointMap:
    """Load a joint map from a TOML file.

    Raises
    ------
    FileError
        If it is not a joint map.
    UnknownNameError
        If it holds a key that means nothing.
    """
    content = read_toml(path, "not a joint map")
    for key in content:
        if key not in _KEYS | SKINNED_KEYS:
            raise UnknownNameError(path, "key", key, _KEYS | SKINNED_KEYS)
    return JointMap(
        name=str(content.get("name", path.stem)),
        left_handed=bool(content.get("left_handed", False)),
        unit_m=_unit(path, content.get("unit_m")),
        back=_direction(path, content.get("back")),
        bones=_bones(path, content.get("bones")),
        exact=bool(content.get("exact", False)),
    )


def _unit(path: Path, unit: Any) -> float:
    if not isinstance(unit, (int, float)) or not 1e-6 < unit < 1e6:
        raise FileError(path, "no unit_m", "give the file's unit of length in metres")
    return float(unit)


def _direction(path: Path, back: Any) -> Floats:
    try:
        direction = np.array(back, dtype=float)
    except (TypeError, ValueError):
        direction = np.zeros(0)
    if not is_direction(direction):
        raise FileError(
            path, "no back", "back = [x, y, z], out of the back of the hand"
        )
    unit: Floats = direction / np.linalg.norm(direction)
    return unit


def is_direction(numbers: Floats) -> bool:
    """Whether numbers are a vector that is neither too short nor too long for one."""
    if numbers.shape != (3,) or not (np.abs(numbers) < 1e9).all():
        return False
    return bool(np.linalg.norm(numbers) > 1e-9)


def _bones(path: Path, bones: Any) -> dict[str, str]:
    if not isinstance(bones, dict) or not bones:
        raise FileError(path, "no [bones]", "say which joint is at each bone's root")
    for bone, joint in bones.items():
        if not isinstance(joint, str):
            raise FileError(path, f"bone {bone}: {joint!r:.60} is no joint's name")
    return dict(bones)


def check_bones(joint_map: JointMap, tree: JointTree) -> None:
    """Refuse a map of bones that the tree lacks, or that hang on one not mapped.

    Raises
    ------
    UnknownNameError
    FileError
    """
    where = f"joint map {joint_map.name}"
    for bone in joint_map.bones:
        if bone not in tree.bones:
            raise UnknownNameError(where, "bone", bone, tree.bones)
    for b, bone in enumerate(tree.bones):
        up = tree.bones[max(int(tree.parents[b]), 0)]
        if up not in joint_map.bones and (bone in joint_map.bones or not b):
            raise FileError(where, f"bone {bone} is mapped, {up} is not", "map both")
        if b and bone in joint_map.bones and sum(tree.hinge_bone == b) not in (1, 2):
            raise FileError(where, f"bone {bone} should have one or two hinges")
