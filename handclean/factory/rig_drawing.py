"""A picture of an imported hand beside the built-in one, in the same postures."""

from pathlib import Path

import numpy as np
from matplotlib.image import imsave

from handclean.arrays import Bytes, Floats, Ints
from handclean.factory.hand_pictures import FIST_DEG, pose_with, weight_colors
from handclean.hand.skinning import posed
from handclean.hand.surface import Surface, edges_of
from handclean.hand.template_surface import template_surface
from handclean.report.drawing import drawn, looking, side_by_side
from handclean.tree import JointTree

FIST_SHARES = (0.0, 0.5, 1.0)
"""How much of a fist is made (chosen)."""

_VIEW_DEG = (150.0, 20.0)
"""[degrees] as of `looking`: the palm, from the thumb's side (chosen)."""

_PIXEL_M = 0.00085
"""[m] width of a pixel (chosen)."""

_FINE_MESH_FACES = 20_000
"""Faces from which on a mesh is fine enough to be drawn (chosen)."""


def rig_picture(tree: JointTree, surface: Surface) -> Bytes:
    """(H, W, 3) above, the built-in skin on a hand's joints; below, the hand's own.

    From left to right: the zero posture, half a fist, a fist; seen from the palm.
    """
    rows = [
        side_by_side([_one(skin, tree, share) for share in FIST_SHARES])
        for skin in (template_surface(tree), surface)
    ]
    wide = max(row.shape[1] for row in rows)
    padded = [
        np.pad(row, ((0, 0), (0, wide - row.shape[1]), (0, 0)), constant_values=255)
        for row in rows
    ]
    return np.vstack(padded)


def write_rig_picture(path: Path, tree: JointTree, surface: Surface) -> None:
    """Write that picture."""
    imsave(path, rig_picture(tree, surface), pil_kwargs={"optimize": True})


def _one(skin: Surface, tree: JointTree, share: float) -> Bytes:
    degrees = {hinge: share * angle for hinge, angle in FIST_DEG.items()}
    if share == 0.0:
        degrees = dict.fromkeys(tree.hinges, 0.0)
    places = posed(skin, tree, pose_with(tree, degrees)[None])[0]
    faces, colors = skin.faces, weight_colors(skin, tree)
    while len(faces) < _FINE_MESH_FACES:
        faces, places, colors = quartered(faces, places, colors)
    return drawn(places, faces, colors, looking(*_VIEW_DEG), _PIXEL_M)


def quartered(
    faces: Ints, places: Floats, colors: Floats
) -> tuple[Ints, Floats, Floats]:
    """Cut every triangle into four at the middles of its sides."""
    edges, count = edges_of(faces), len(places)
    key = edges[:, 0] * count + edges[:, 1]
    middle = []
    for n in range(3):
        ends = np.sort(faces[:, [n, (n + 1) % 3]], axis=1)
        middle.append(count + np.searchsorted(key, ends[:, 0] * count + ends[:, 1]))
    (a, b, c), (ab, bc, ca) = faces.T, middle
    parts = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
    cut = np.concatenate([np.column_stack(part) for part in parts])
    places, colors = (
        np.concatenate([values, values[edges].mean(axis=1)])
        for values in (places, colors)
    )
    return cut, places, colors
