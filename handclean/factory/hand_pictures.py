"""``make pictures``: the template hand, its weights and a fist.

Run as ``python -m handclean.factory.hand_pictures FOLDER``.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.image import imsave

from handclean.arrays import Floats
from handclean.hand.model import neutral_pose
from handclean.hand.skinning import posed
from handclean.hand.surface import Surface
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.report.drawing import drawn, looking, side_by_side, skin_colors
from handclean.tree import POSE_HEAD, JointTree

FIST_DEG = {
    "mcp_flexion": 84.0,
    "pip_flexion": 100.0,
    "dip_flexion": 62.0,
    "thumb_cmc_abduction": 42.0,
    "thumb_cmc_flexion": 22.0,
    "thumb_mcp_flexion": 38.0,
    "thumb_ip_flexion": 48.0,
}
"""[degrees] hinges of a flexed fist, by name or by how their names end (chosen)."""

_HAND_COLOR = np.array([0.80, 0.80, 0.78])
"""Colour (red, green, blue; 0 to 1) of the palm (chosen)."""

_FINGER_COLORS = {
    "thumb": (0.84, 0.37, 0.00),
    "index": (0.90, 0.62, 0.00),
    "middle": (0.00, 0.62, 0.45),
    "ring": (0.00, 0.45, 0.70),
    "little": (0.80, 0.47, 0.65),
}
"""The same of each finger (Okabe and Ito: told apart by the colour-blind)."""

_WHITE_SHARES = (0.55, 0.0, 0.45)
"""Share of white in the colours along a finger (chosen)."""


def weight_colors(surface: Surface, tree: JointTree) -> Floats:
    """(V, 3) the bones' colours, mixed by the weights."""
    palette = np.tile(_HAND_COLOR, (len(tree.bones), 1))
    for finger, color in _FINGER_COLORS.items():
        own = [b for b, bone in enumerate(tree.bones) if bone.startswith(finger)]
        for b, white in zip(own, _WHITE_SHARES, strict=True):
            palette[b] = (1.0 - white) * np.array(color) + white
    out: Floats = np.einsum("vn,vnk->vk", surface.weights, palette[surface.bones])
    return out


def pose_with(tree: JointTree, degrees: Mapping[str, float]) -> Floats:
    """(7 + D,) a pose with some hinges turned, by name or by how their names end."""
    pose = neutral_pose(tree)
    for d, hinge in enumerate(tree.hinges):
        for name, angle in degrees.items():
            if hinge == name or hinge.endswith(f"_{name}"):
                pose[POSE_HEAD + d] = np.radians(angle)
    return pose


def write_pictures(folder: Path) -> list[Path]:
    """Write the pictures of the template that ship, and say which files."""
    tree = template("right")
    skin = template_surface(tree)
    fist = posed(skin, tree, pose_with(tree, FIST_DEG)[None])[0]
    weights, colors = weight_colors(skin, tree), skin_colors(skin)
    rows = {
        "template.png": [
            drawn(skin.vertices, skin.faces, paint, looking(azimuth, 0.0))
            for paint in (colors, weights)
            for azimuth in (0.0, 180.0)
        ],
        "fist.png": [
            drawn(fist, skin.faces, colors, looking(azimuth, elevation))
            for azimuth, elevation in ((-45.0, 15.0), (45.0, 15.0), (180.0, 0.0))
        ],
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, row in rows.items():
        imsave(folder / name, side_by_side(row))
    return [folder / name for name in rows]


if __name__ == "__main__":
    write_pictures(Path(sys.argv[1]))
