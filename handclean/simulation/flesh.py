"""The hand as capsules, which touch objects; its forearm's also hide markers.

Sizes are those of the template hand: finger breadths and depths at the joints after
Garrett, The adult human hand: some anthropometric and biomechanical considerations,
Human Factors 13 (1971) 117-131, palm 27 mm thick. Written side-free, as the template.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.model import Model, marker_positions
from handclean.hand.template import FINGERS, bone_frame
from handclean.tree import JointTree

_RADII_MM = {
    "thumb": (13.0, 10.0, 9.0),
    "index": (9.0, 8.2, 7.2),
    "middle": (9.2, 8.4, 7.4),
    "ring": (8.7, 7.9, 7.0),
    "little": (7.8, 7.0, 6.3),
}
"""[mm] of the segments' capsules, proximal to distal (Garrett 1971)."""

_PALM = (
    ((0.14, 0.05, -2.0), (0.30, 0.40, -2.0), 12.5),
    ((0.05, 0.05, -2.0), (0.05, 0.40, -1.5), 13.0),
    ((-0.08, 0.05, -2.0), (-0.19, 0.37, -2.0), 12.5),
    ((-0.17, 0.05, -3.5), (-0.38, 0.33, -6.0), 10.5),
    ((-0.19, 0.09, -9.0), (-0.33, 0.26, -9.0), 10.5),
)
"""Start, stop, radius [mm] of the palm's capsules; x as a share of hand breadth, y of
length (palm 27 mm thick, see above)."""

_FOREARM_MM = (
    ((-11.0, -25.0, 0.0), (-14.0, -220.0, 0.0), 19.0),
    ((11.0, -25.0, 0.0), (14.0, -220.0, 0.0), 19.0),
)
"""Start, stop, radius [mm] of the forearm's capsules (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Flesh:
    """L capsules on the bones of a hand.

    Attributes
    ----------
    ends : model whose 2 L "markers" are the capsules' starts, then their stops.
    radius : (L,) [m]
    bone : (L,) bone each capsule belongs to.
    """

    ends: Model
    radius: Floats
    bone: Ints

    def capsules(self, poses: Floats) -> tuple[Floats, Floats]:
        """(T, L, 3) [m] starts and stops of the capsules in (T, 7 + D) poses."""
        ends = marker_positions(self.ends, poses)
        half = len(self.radius)
        return ends[:, :half], ends[:, half:]


def clothe(tree: JointTree, tips: dict[str, float], plump: float) -> Flesh:
    """Put capsules on a left hand with a forearm.

    Parameters
    ----------
    tree : side-free, that is a left hand.
    tips : [m] length of each finger's last segment.
    plump : thickness against the template's.
    """
    length = float(np.linalg.norm(tree.offsets[tree.bone("middle_proximal")])) / 0.446
    width = tree.offsets[tree.bone("index_proximal"), 0]
    breadth = (width - tree.offsets[tree.bone("little_proximal"), 0]) / 0.685
    scale = np.array([breadth, length, 1e-3 * plump])
    rows = [
        ("hand", np.array(start) * scale, np.array(stop) * scale, radius)
        for start, stop, radius in _PALM
    ]
    for finger in FINGERS:
        rows += _segments(tree, finger, tips[finger], 1e-3 * plump)
    rows += [
        ("forearm", 1e-3 * np.array(start), 1e-3 * np.array(stop), radius)
        for start, stop, radius in _FOREARM_MM
    ]
    bone = np.array([tree.bone(row[0]) for row in rows], dtype=np.int64)
    ends = Model(
        tree=tree,
        labels=tuple(f"end{n}" for n in range(2 * len(rows))),
        bone=np.concatenate([bone, bone]),
        at=np.array([row[1] for row in rows] + [row[2] for row in rows]),
    )
    radii = 1e-3 * plump * np.array([row[3] for row in rows])
    return Flesh(ends=ends, radius=radii, bone=bone)


def _segments(
    tree: JointTree, finger: str, tip: float, plump: float
) -> list[tuple[str, Floats, Floats, float]]:
    """Bone, start, stop [m] and template radius [mm] of a finger's three capsules."""
    bones = [bone for bone in tree.bones if bone.startswith(finger)]
    children = [tree.offsets[tree.bone(bone)] for bone in bones[1:]]
    end = (tip - plump * _RADII_MM[finger][2]) * bone_frame(finger)[:, 1]
    return [
        (bone, np.zeros(3), stop, radius)
        for bone, stop, radius in zip(
            bones, [*children, end], _RADII_MM[finger], strict=True
        )
    ]
