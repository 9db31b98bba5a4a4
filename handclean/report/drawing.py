"""Pictures of hands: shaded meshes, drawn without a graphics card.

Every triangle is sampled so densely that each pixel it covers gets a sample; in each
pixel the nearest sample stays. Light falls from above, from the left and from where the
viewer is.
"""

from collections.abc import Sequence

import numpy as np

from handclean.arrays import Bytes, Floats, Ints
from handclean.hand.surface import Surface, vertex_normals
from handclean.hand.template_surface import shipped_skin

PIXEL_M = 0.0006
"""[m] width of a pixel (chosen)."""

MARGIN_M = 0.004
"""[m] of white around a picture (chosen)."""

_SKIN_COLOR = np.array([0.94, 0.75, 0.63])
_NAIL_COLOR = np.array([0.98, 0.86, 0.80])
_LIGHT = np.array([-0.35, 0.55, 0.75]) / np.linalg.norm([-0.35, 0.55, 0.75])
"""Colors (red, green, blue; 0 to 1), and where light comes from (chosen)."""

_SAMPLES_PER_PIXEL = 2
"""Samples of a pixel, each way (chosen)."""

_BATCH_TRIANGLES = 1000
"""Triangles sampled at once (chosen; memory)."""


def looking(azimuth: float, elevation: float) -> Floats:
    """(3, 3) rows right, up and towards a viewer who sees the back at 0, 0 [degrees].

    Parameters
    ----------
    azimuth : how far the viewer walks round the fingers' axis, to the right.
    elevation : how far he then rises towards the finger tips.
    """
    a, e = np.radians([azimuth, elevation])
    here = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    return np.array([right, np.cross(here, right), here])


def skin_colors(surface: Surface) -> Floats:
    """(V, 3) skin and, on the fine template, nails."""
    out = np.tile(_SKIN_COLOR, (len(surface.vertices), 1))
    nails = shipped_skin().nails
    if len(nails) == len(out):
        out[nails] = _NAIL_COLOR
    return out


def drawn(
    vertices: Floats, faces: Ints, colors: Floats, view: Floats, pixel: float = PIXEL_M
) -> Bytes:
    """(H, W, 3) picture of a mesh on white.

    Parameters
    ----------
    vertices, faces : (V, 3) [m], (F, 3)
    colors : (V, 3) from 0 to 1.
    view : (3, 3) as from `looking`.
    pixel : [m] width of a pixel.
    """
    places = vertices @ view.T
    normals = vertex_normals(vertices, faces) @ view.T
    fine = pixel / _SAMPLES_PER_PIXEL
    low, high = places.min(axis=0) - MARGIN_M, places.max(axis=0) + MARGIN_M
    wide, tall = (
        _SAMPLES_PER_PIXEL * (int((high - low)[k] / pixel) + 1) for k in (0, 1)
    )
    picture, depth = np.ones((tall * wide, 3)), np.full(tall * wide, -np.inf)
    sides = np.linalg.norm(places[faces] - places[np.roll(faces, 1, axis=1)], axis=2)
    counts = (1.3 * sides.max(axis=1) / fine).astype(np.int64) + 2
    rows = np.argsort(counts, kind="stable")
    for start in range(0, len(faces), _BATCH_TRIANGLES):
        some = faces[rows[start : start + _BATCH_TRIANGLES]]
        shares = _samples(int(counts[rows[start : start + _BATCH_TRIANGLES]].max()))
        at, out, color = (
            np.einsum("sn,fnk->fsk", shares, values[some]).reshape(-1, 3)
            for values in (places, normals, colors)
        )
        column = ((at[:, 0] - low[0]) / fine).astype(np.int64)
        row = ((high[1] - at[:, 1]) / fine).astype(np.int64)
        spot = row * wide + column
        order = np.argsort(at[:, 2], kind="stable")
        order = order[at[order, 2] > depth[spot[order]]]
        # Of samples in one pixel the last assigned, the nearest, stays.
        depth[spot[order]] = at[order, 2]
        picture[spot[order]] = _shaded(out[order], color[order])
    blocks = picture.reshape(
        tall // _SAMPLES_PER_PIXEL,
        _SAMPLES_PER_PIXEL,
        wide // _SAMPLES_PER_PIXEL,
        _SAMPLES_PER_PIXEL,
        3,
    )
    # Steps of four make a file a third as large; nobody sees them.
    steps = np.round(64.0 * blocks.mean(axis=(1, 3)))
    rounded: Bytes = np.minimum(4.0 * steps, 255.0).astype(np.uint8)
    return rounded


def _samples(count: int) -> Floats:
    """(N, 3) barycentric coordinates of a grid, so many steps to a side."""
    i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1))
    keep = i + j <= count
    out: Floats = np.column_stack([i[keep], j[keep], count - i[keep] - j[keep]]) / count
    return out


def _shaded(normals: Floats, colors: Floats) -> Floats:
    size = np.maximum(np.linalg.norm(normals, axis=1), 1e-12)
    lit = np.clip(normals @ _LIGHT / size, 0.0, 1.0)
    faced = np.clip(normals[:, 2] / size, 0.0, 1.0)
    shade = 0.30 + 0.58 * lit + 0.14 * faced
    out: Floats = np.clip(shade[:, None] * colors, 0.0, 1.0)
    return out


def side_by_side(pictures: Sequence[Bytes]) -> Bytes:
    """Pictures in a row, standing on one line."""
    tall = max(len(picture) for picture in pictures)
    padded = [
        np.pad(
            picture,
            ((tall - len(picture), 0), (0, 0), (0, 0)),
            constant_values=255,
        )
        for picture in pictures
    ]
    return np.hstack(padded)
