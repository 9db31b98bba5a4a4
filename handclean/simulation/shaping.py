"""Hands of shapes that no scaling of the template reaches.

Each segment is thicker or thinner than its bone's length foretells, and more so at one
end than at the other; the palm is deep or flat; and the skin has swellings and hollows
a centimetre wide. Joints stay where they are.
"""

from dataclasses import replace

import numpy as np

from handclean.arrays import Floats
from handclean.hand.surface import Surface, rest_joints, vertex_normals
from handclean.hand.template import FINGERS, bone_frame, distal_length
from handclean.tree import MIRROR, JointTree

_LOG_GIRTH_SD, _LOG_TAPER_SD = 0.06, 0.05
"""Standard deviation of the logarithm of a segment's girth, and of that of its ends
(chosen)."""

_LOG_DEPTH_SD = 0.05
"""Standard deviation of the logarithm of the palm's depth (chosen)."""

_SWELLINGS, _SWELLING_SD_M, _SWELLING_HEIGHT_SD_M = 60, 0.011, 0.001
"""How many there are; [m] width and height, one standard deviation (chosen)."""


def reshaped(surface: Surface, tree: JointTree, rng: np.random.Generator) -> Surface:
    """Return the skin of somebody with the same joints and other flesh.

    Parameters
    ----------
    surface : in the zero posture of the tree.
    """
    places = surface.vertices + _girth(surface, tree, rng)
    normals = vertex_normals(places, surface.faces)
    centres = places[rng.integers(0, len(places), _SWELLINGS)]
    height = np.zeros(len(places))
    for centre, size in zip(
        centres, rng.normal(0.0, _SWELLING_HEIGHT_SD_M, _SWELLINGS), strict=True
    ):
        away2 = ((places - centre) ** 2).sum(axis=1)
        height += size * np.exp(-0.5 * away2 / _SWELLING_SD_M**2)
    return replace(surface, vertices=places + height[:, None] * normals)


def _girth(surface: Surface, tree: JointTree, rng: np.random.Generator) -> Floats:
    """(V, 3) [m] by how much vertices move away from the axes of their bones."""
    joints = rest_joints(tree)
    mirror = MIRROR if tree.side == "right" else np.ones(3)
    out = np.zeros(surface.vertices.shape)
    for b, bone in enumerate(tree.bones):
        size, taper = rng.normal(0.0, _LOG_GIRTH_SD), rng.normal(0.0, _LOG_TAPER_SD)
        share = np.where(surface.bones == b, surface.weights, 0.0).sum(axis=1)
        if b == 0:
            deep = np.exp(_LOG_DEPTH_SD * rng.normal()) - 1.0
            out[:, 2] += share * deep * surface.vertices[:, 2]
            continue
        finger, segment = bone.split("_")[0], bone.split("_")[-1]
        if finger not in FINGERS:
            continue
        along = bone_frame(bone)[:, 1] * mirror
        if segment == "distal":
            long = distal_length(tree, finger)
        else:
            long = float(np.linalg.norm(tree.offsets[b + 1]))
        away = surface.vertices - joints[b]
        at = away @ along
        away = away - at[:, None] * along
        grows = np.exp(size + taper * np.clip(at / long - 0.5, -1.0, 1.0)) - 1.0
        out += (share * grows)[:, None] * away
    return out
