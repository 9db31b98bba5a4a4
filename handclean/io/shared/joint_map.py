"""Joint maps: which joint of somebody's BVH hierarchy belongs to which bone of ours.

A TOML file with ``left_handed`` (the file's axes), ``unit_m`` (its unit of length),
``back`` (out of the back of the hand, in the frame of the root bone's joint) and a
table ``[bones]``: the joint at the root end of each bone. It says nothing of angles;
`handclean.io.bvh.angles` finds them from the motion. With ``exact = true`` the frames
of all joints are parallel in the zero posture, as `handclean.io.bvh.write` writes
them, and the hinge angles are what went in (`handclean.io.bvh.own`). What a map says of
skinned hands besides is read by `handclean.io.gltf.skinned_map`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UnknownNameError
from handclean.tomlfile import Table, read_table
from handclean.tree import JointTree

SHIPPED = Path(__file__).parents[2] / "data" / "joint_maps"

_KEYS = {"name", "source", "note", "left_handed", "unit_m", "back", "exact", "bones"}

SKINNED_KEYS = {"flexion", "tips", "merged"}
"""Keys that only skinned hands need."""

_LEAST_DIRECTION, _MOST_DIRECTION = 1e-9, 1e9
"""[-] length of a vector that is a direction, and its largest number (chosen)."""


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
    return joint_map_of(read_table(path, "not a joint map"))


def joint_map_of(content: Table) -> JointMap:
    """Make a joint map of what its file says; errors as of `load_joint_map`."""
    content.expect_keys(_KEYS | SKINNED_KEYS)
    unit = "give the file's unit of length in metres"
    return JointMap(
        name=content.text("name", content.file.stem),
        left_handed=content.flag("left_handed", False),
        unit_m=content.number("unit_m", least=1e-6, most=1e6, right=unit),
        back=direction_of(
            content, "back", "give [x, y, z] out of the back of the hand"
        ),
        bones=_bones(content),
        exact=content.flag("exact", False),
    )


def direction_of(table: Table, key: str, right: str) -> Floats:
    """Return (3,) numbers as a unit vector.

    Raises
    ------
    FileError
        If they are none, or too short or too long for a direction.
    """
    direction: Floats = np.array(
        table.vector(key, 3, most=_MOST_DIRECTION, right=right)
    )
    length = float(np.linalg.norm(direction))
    if length < _LEAST_DIRECTION:
        raise table.wrong(key, right)
    return direction / length


def _bones(content: Table) -> dict[str, str]:
    bones = content.table("bones", "say which joint is at each bone's root")
    if not bones.values:
        right = "say which joint is at each bone's root"
        raise content.error("no [bones]", right)
    return {bone: bones.name(bone, "give a joint's name") for bone in bones}


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
