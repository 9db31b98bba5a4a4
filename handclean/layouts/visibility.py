"""How often a marker cannot be seen: a term of the energy that users ask for.

Not in the papers. A capture volume has cameras all around, and nobody knows how the
hand will be held, so the directions are spread evenly over the whole sphere (a
Fibonacci lattice), a camera `CAMERA_DISTANCE_M` off in each. In a keyframe a marker is
hidden from a direction if the hand's skin stands between; whatever the marker's own
height, a `MARKER_LIFT_M` of it counts. A marker on flat skin is hidden from half of all
directions; what matters is how much more than that, between fingers or when the hand
closes.
"""

import numpy as np

from handclean.arrays import Floats
from handclean.hand.model import Model, marker_positions
from handclean.hand.skinning import posed
from handclean.hand.surface import Surface, vertex_normals
from handclean.numerics.triangles import box_tree, closest, hidden_behind

VIEW_DIRECTIONS = 48
"""Directions from which the hand is looked at (chosen)."""

CAMERA_DISTANCE_M = 2.0
"""[m] how far cameras are from the hand (chosen: as around a table)."""

MARKER_LIFT_M = 0.003
"""[m] how far a marker's centre is from the skin: the radius of one of 6 mm."""

_SKIN_IGNORED_M = 0.001
"""[m] skin this close to a marker's centre does not hide it (chosen)."""


def directions(count: int = VIEW_DIRECTIONS) -> Floats:
    """(C, 3) unit vectors spread evenly over the sphere."""
    n = np.arange(count) + 0.5
    height = 1.0 - 2.0 * n / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * n
    flat = np.sqrt(1.0 - height**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height])


def hidden_share(model: Model, surface: Surface, poses: Floats) -> Floats:
    """(N,) share of poses and directions from which each candidate is not seen.

    Parameters
    ----------
    model : the candidates; surface : the skin of their hand.
    poses : (F, 7 + D) keyframes, the wrist at the origin.
    """
    skin = posed(surface, model.tree, poses)
    places = marker_positions(model, poses)
    boxes = box_tree(surface.vertices, surface.faces)
    for f in range(len(poses)):
        feet = closest(skin[f], surface.faces, places[f], boxes)
        normals = vertex_normals(skin[f], surface.faces)[surface.faces[feet.face]]
        out = np.einsum("nk,nkm->nm", feet.share, normals)
        low = np.maximum(MARKER_LIFT_M - feet.distance, 0.0)
        places[f] += low[:, None] * out / np.linalg.norm(out, axis=1, keepdims=True)
    cameras = CAMERA_DISTANCE_M * directions()
    hidden = hidden_behind(skin, boxes, places, cameras, skip_m=_SKIN_IGNORED_M)
    share: Floats = hidden.mean(axis=(0, 2))
    return share
