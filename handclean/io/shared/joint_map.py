"""Joint maps: which joint of somebody's BVH hierarchy belongs to which bone of ours.

A TOML file with ``left_handed`` (the file's axes), ``unit_m`` (its unit of length),
``back`` (out of the back of the hand, in the frame of the root bone's joint) and a
table ``[bones]``: the joint at the root end of each bone. It says nothing of angles;
`handclean.io.bvh.angles` finds them from the motion. With ``exact = true`` the frames
of all joints are parallel in the zero posture, as `handclean.io.bvh.write` writes
them, and the hinge angles are what went in (`handclean.io.bvh.own`). What a map says of
skinned hands besides is read by `handclean.io.gltf.skinned_map`.

Where a program names the sides, a table ``[sides]`` has its word for each, which stands
for ``{side}`` in the joints' names; then the names tell a left hand from a right one,
and ``back`` is not needed. In a file such names may begin with anything, the same for
all (``mixamorig:LeftHand``). A file may hold several hands so. ``other_units_m`` are
units in which such files come, too: the first with which a hand has a hand's size.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UnknownNameError
from handclean.tomlfile import Table, read_table
from handclean.tree import JointTree

SHIPPED = Path(__file__).parents[2] / "data" / "joint_maps"

_KEYS = {"name", "source", "note", "left_handed", "unit_m", "back", "exact", "bones"}
_KEYS |= {"sides", "other_units_m"}

_SIDE = "{side}"
"""What stands for a program's word for a side, in the names of joints."""

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
    back : (3,) unit vector out of the back of the hand, in its joint's frame; None
        where the joints' names say which hand it is.
    bones : the joint at the root end of each bone.
    exact : whether the file is as handclean writes them.
    sides : the word for each side in the joints' names; none where they have none.
    side : "left" or "right" of a map for one hand of a file, or "".
    head : what the joints' names begin with, of such a map.
    other_units_m : [m] units of length that files have, too.
    """

    name: str
    left_handed: bool
    unit_m: float
    back: Floats | None
    bones: Mapping[str, str]
    exact: bool = False
    sides: Mapping[str, str] = field(default_factory=dict)
    side: str = ""
    head: str = ""
    other_units_m: tuple[float, ...] = ()

    def renamed(self, joint: str, side: str, head: str) -> str:
        """Return a joint's name in a file, for one side of it."""
        return head + joint.replace(_SIDE, self.sides[side])


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
    unit_m = content.number("unit_m", least=1e-6, most=1e6, right=unit)
    back = None
    if "back" in content or "sides" not in content:
        right = "give [x, y, z] out of the back of the hand"
        back = direction_of(content, "back", right)
    bones = _bones(content)
    return JointMap(
        name=content.text("name", content.file.stem),
        left_handed=content.flag("left_handed", False),
        unit_m=unit_m,
        back=back,
        bones=bones,
        exact=content.flag("exact", False),
        sides=_sides(content, bones),
        other_units_m=_units(content),
    )


def _sides(content: Table, bones: Mapping[str, str]) -> dict[str, str]:
    """Return the word for each side, none where names have none."""
    table = content.table("sides", "write left = WORD and right = WORD")
    table.expect_keys(("left", "right"), "side")
    sides = {side: table.name(side, "give the word in joints' names") for side in table}
    if not sides:
        return {}
    if set(sides) != {"left", "right"}:
        raise content.error("[sides] lacks one", "write left = WORD and right = WORD")
    for joint in bones.values():
        if _SIDE not in joint:
            raise content.error(
                f"joint '{joint}' has no {_SIDE}", "as there are [sides]"
            )
    return sides


def _units(content: Table) -> tuple[float, ...]:
    """Return further units of length that files have."""
    key, right = "other_units_m", "give a list of lengths in metres"
    if key not in content:
        return ()
    given = content.values[key]
    if not isinstance(given, list) or not given:
        raise content.wrong(key, right)
    units = content.vector(key, len(given), most=1e6, right=right)
    if min(units) < 1e-6:
        raise content.wrong(key, right)
    return tuple(units)


def for_hands(joint_map: JointMap, names: Collection[str]) -> list[JointMap]:
    """Return the map for each hand of a file, by the names of its joints.

    A map without sides is for one hand, which is there if all its joints are.
    """
    known = set(names)
    if not joint_map.sides:
        return [joint_map] if known.issuperset(joint_map.bones.values()) else []
    found = []
    for side in joint_map.sides:
        root = joint_map.renamed(joint_map.bones["hand"], side, "")
        for head in (n.removesuffix(root) for n in names if n.endswith(root)):
            bones = {
                bone: joint_map.renamed(joint, side, head)
                for bone, joint in joint_map.bones.items()
            }
            if known.issuperset(bones.values()):
                found.append(replace(joint_map, bones=bones, side=side, head=head))
    return found


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
