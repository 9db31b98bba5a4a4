"""Markers as small spheres on a hand's skin, in one mesh with it."""

from dataclasses import replace

import numpy as np

from handclean.arrays import Bytes, Floats, Ints
from handclean.hand.model import Model
from handclean.hand.surface import BONES_PER_VERTEX, Surface, rest_joints
from handclean.report.drawing import skin_colors

RED = (200, 30, 40)
"""Colour of the spheres."""

_AROUND, _RINGS = 12, 7
"""Vertices of a ring of the sphere, and rings (chosen)."""


def sphere(radius: float) -> tuple[Floats, Ints]:
    """(V, 3) [m] and (F, 3) of a sphere about the origin, seen from outside."""
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    rise = np.pi * (np.arange(1, _RINGS + 1) / (_RINGS + 1) - 0.5)
    rings = [
        np.column_stack(
            [np.cos(r) * np.cos(turn), np.cos(r) * np.sin(turn), 0 * turn + np.sin(r)]
        )
        for r in rise
    ]
    vertices = radius * np.vstack([[[0, 0, -1.0]], *rings, [[0, 0, 1.0]]])
    top = len(vertices) - 1
    faces = []
    for a in range(_AROUND):
        b = (a + 1) % _AROUND
        faces.append([0, 1 + b, 1 + a])
        for ring in range(_RINGS - 1):
            low, high = 1 + ring * _AROUND, 1 + (ring + 1) * _AROUND
            faces += [[low + a, low + b, high + b], [low + a, high + b, high + a]]
        last = 1 + (_RINGS - 1) * _AROUND
        faces.append([last + a, last + b, top])
    return vertices, np.array(faces, dtype=np.int64)


def with_beads(
    surface: Surface,
    markers: Model,
    radius: float,
    color: tuple[int, int, int] = RED,
) -> Surface:
    """Return a skin with a sphere for every marker, moved by its bone.

    Parameters
    ----------
    radius : [m]
    """
    ball, around = sphere(radius)
    homes = rest_joints(markers.tree)[markers.bone] + markers.at
    count, size, first = len(homes), len(ball), len(surface.vertices)
    bones = np.zeros((count * size, BONES_PER_VERTEX), dtype=np.int64)
    bones[:, 0] = np.repeat(markers.bone, size)
    weights = np.zeros((count * size, BONES_PER_VERTEX))
    weights[:, 0] = 1.0
    faces = around[None] + first + size * np.arange(count)[:, None, None]
    return replace(
        surface,
        vertices=np.vstack([surface.vertices, *(home + ball for home in homes)]),
        faces=np.vstack([surface.faces, faces.reshape(-1, 3)]),
        bones=np.vstack([surface.bones, bones]),
        weights=np.vstack([surface.weights, weights]),
        colors=np.vstack([_colors(surface), np.tile(color, (count * size, 1))]).astype(
            np.uint8
        ),
    )


def _colors(surface: Surface) -> Bytes:
    if surface.colors is not None:
        return surface.colors
    out: Bytes = np.round(255.0 * skin_colors(surface)).astype(np.uint8)
    return out
