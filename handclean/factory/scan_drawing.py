"""A picture of a scan, the template laid onto it, and the hand that comes of it."""

from pathlib import Path

import numpy as np
from matplotlib.image import imsave

from handclean.arrays import Bytes, Floats, Ints
from handclean.hand.surface import Surface
from handclean.report.drawing import drawn, looking, side_by_side, skin_colors

_VIEWS_DEG = ((-20.0, 10.0), (160.0, 10.0))
"""[degrees] as of `looking`: back and palm (chosen)."""

_PIXEL_M = 0.0009
"""[m] width of a pixel (chosen)."""

_DOT_M = 0.0007
"""[m] side of the triangle that stands for a point (chosen)."""


def scan_picture(
    points: Floats,
    normals: Floats,
    colors: Bytes,
    surface: Surface,
    aligned: Floats,
    fitted: Floats,
) -> Bytes:
    """(H, W, 3) back above palm; from left to right scan, aligned template, result.

    Parameters
    ----------
    points, normals : (P, 3) [m] of the scan, in the frame of the scanned hand.
    colors : (P, 3) red, green, blue.
    surface : the mesh of both hands.
    aligned, fitted : (V, 3) [m] its vertices before and after the skin was drawn on.
    """
    dots, faces, paint = _dots(points, normals, colors / 255.0)
    skin = skin_colors(surface)
    rows = []
    for view in (looking(*angles) for angles in _VIEWS_DEG):
        row = [drawn(dots, faces, paint, view, _PIXEL_M)]
        row += [
            drawn(places, surface.faces, skin, view, _PIXEL_M)
            for places in (aligned, fitted)
        ]
        rows.append(side_by_side(row))
    wide = max(row.shape[1] for row in rows)
    padded = [
        np.pad(row, ((0, 0), (0, wide - row.shape[1]), (0, 0)), constant_values=255)
        for row in rows
    ]
    return np.vstack(padded)


def write_scan_picture(path: Path, picture: Bytes) -> None:
    """Write that picture."""
    imsave(path, picture, pil_kwargs={"optimize": True})


def _dots(
    points: Floats, normals: Floats, colors: Floats
) -> tuple[Floats, Ints, Floats]:
    """Vertices, faces and colours of one small triangle for each point."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]])
    a = np.cross(normals, helper)
    a *= _DOT_M / np.linalg.norm(a, axis=1, keepdims=True)
    b = np.cross(normals, a)
    corners = np.stack([points - a - b, points + a - b, points + b], axis=1)
    faces = np.arange(3 * len(points)).reshape(-1, 3)
    return corners.reshape(-1, 3), faces, np.repeat(colors, 3, axis=0)
