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

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from handclean.arrays import Floats
from handclean.errors import FileError, UsageError
from handclean.hand.template import FINGERS, template
from handclean.io.shared.joint_map import (
    SHIPPED,
    JointMap,
    direction_of,
    for_hands,
    joint_map_of,
)
from handclean.tomlfile import read_table, shipped_names


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


def of_hands(found: SkinnedMap, names: Collection[str]) -> list[SkinnedMap]:
    """Return the map for each hand of a file, by the names of its joints."""
    if not found.bones.sides:
        return [found] if for_hands(found.bones, names) else []
    return [_of_hand(found, bones, names) for bones in for_hands(found.bones, names)]


def _of_hand(found: SkinnedMap, bones: JointMap, names: Collection[str]) -> SkinnedMap:
    """Return a map with the names of one hand; ends of fingers may not be there."""

    def renamed(joint: str) -> str:
        return found.bones.renamed(joint, bones.side, bones.head)

    tips = {finger: renamed(joint) for finger, joint in found.tips.items()}
    return SkinnedMap(
        bones=bones,
        flexion=found.flexion,
        tips={finger: joint for finger, joint in tips.items() if joint in names},
        merged={bone: tuple(map(renamed, all_)) for bone, all_ in found.merged.items()},
    )


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
        names = shipped_names(SHIPPED)
        if name not in names:
            known = ", ".join(names)
            raise UsageError(
                f"--joint-map: none is called '{name}'; shipped: {known}; "
                "or name a .toml file"
            )
        path = SHIPPED / f"{name}.toml"
    content = read_table(path, "not a joint map")
    bones = joint_map_of(content)
    if bones.left_handed:
        raise FileError(path, "left_handed is true", "glTF's axes are right-handed")
    ours = template("left").bones
    content.table("bones", "").expect_keys(ours, "bone")
    for bone in ours:
        if bone not in bones.bones:
            right = f"say in [bones] which joint is at the root of {bone}"
            raise FileError(path, f"bone {bone} is not mapped", right)
    tips = content.table("tips", "write finger = joint")
    tips.expect_keys(FINGERS, "finger")
    merged = content.table("merged", "write bone = [joint, ...]")
    merged.expect_keys(ours, "bone")
    several = "give a list of joints' names"
    axis = "give an axis [x, y, z]"
    return SkinnedMap(
        bones=bones,
        flexion=direction_of(content, "flexion", axis)
        if "flexion" in content
        else None,
        tips={finger: tips.name(finger, "give a joint's name") for finger in tips},
        merged={bone: merged.texts(bone, several) for bone in merged},
    )
