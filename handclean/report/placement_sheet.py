"""A sheet to print and put beside the performer: where markers are to be glued.

The hand's back at true scale with a numbered dot for every marker, and a table of how
far each is from places that can be felt or seen: straight, as calipers measure it, on
the flat hand. The thumb, whose nail looks sideways, is shown from there again if it has
markers. A ruler tells whether the printer kept the scale.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.hand.model import Model
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template import bone_frame
from handclean.report.drawing import MARGIN_M, drawn, looking, skin_colors
from handclean.report.placements import Placement, placements
from handclean.tree import MIRROR, JointTree

PAGES = {"A4": (210.0, 297.0), "A3": (297.0, 420.0)}
"""[mm] width and height of the paper (ISO 216); the first that has room is taken."""

PIXEL_M = 0.0002
"""[m] width of a pixel of the picture of the hand (chosen)."""

_MARGIN_MM = 10.0
"""[mm] of paper that printers leave white (chosen)."""

_ROW_MM, _GAP_MM, _DOT_MM, _RULER_MM = 4.4, 3.0, 2.2, 14.0
"""[mm] height of a row, gap above the table, least radius of a dot, width of the ruler
(chosen)."""

_INCH_MM = 25.4
"""[mm] of an inch."""

_INK, _RED = "#20242c", "#c8281e"
"""Colors of lines and texts, and of dots."""


def write_sheet(
    path: Path,
    markers: Model,
    surface: Surface,
    radius: float,
    *,
    title: str,
    source: str,
) -> tuple[str, ...]:
    """Write the sheet as PDF, SVG or PNG, by the path's suffix.

    Parameters
    ----------
    radius : [m] of the markers.
    source : whose hand it is.

    Returns
    -------
    what whoever prints it should know, one line each

    Raises
    ------
    FileError
        If it cannot be written.
    """
    rows = placements(markers, surface)
    size = 1e3 * (np.ptp(surface.vertices, axis=0) + 2.0 * MARGIN_M)
    name = _page_for(size, len(rows))
    wide, high = PAGES[name]
    figure = Figure(figsize=(wide / _INCH_MM, high / _INCH_MM), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    top = high - _MARGIN_MM
    thumb_left = markers.tree.side == "right"
    sides = (_MARGIN_MM, wide - _MARGIN_MM)
    thumb_edge, other_edge = sides if thumb_left else sides[::-1]
    lines = (f"{markers.tree.side} hand, from its back", source, f"100 % on {name}")
    _title(axes, title, lines, thumb_edge, top)
    _ruler(axes, other_edge, top - 100.0)
    free = wide - 2 * _MARGIN_MM - _RULER_MM - size[0]  # all of it on the thumb's side
    corner = _MARGIN_MM + (free if thumb_left else _RULER_MM), top
    numbers = {label: str(n) for n, label in enumerate(markers.labels, start=1)}
    _panel(axes, surface, looking(0.0, 0.0), markers, numbers, radius, corner)
    _thumb_panel(axes, surface, markers, numbers, radius, (thumb_edge, top - size[1]))
    axes.set(xlim=(0.0, wide), ylim=(0.0, high), aspect="equal")
    _table(axes, rows, top - size[1] - _GAP_MM, wide)
    try:
        _save(figure, path)
    except OSError as error:
        raise FileError(path, f"cannot be written: {error.strerror or error}") from None
    if name == "A4":
        return ()
    return (f"the sheet needs {name}: hand and table do not fit on A4",)


def _page_for(size: Floats, rows: int) -> str:
    """Name of the smallest page for a hand of a size [mm] and so many rows."""
    needed = 2 * _MARGIN_MM + size[1] + _GAP_MM + _ROW_MM * (rows + 1)
    fits = [
        name
        for name, page in PAGES.items()
        if needed <= page[1] and size[0] + 2 * _MARGIN_MM + _RULER_MM <= page[0]
    ]
    return fits[0] if fits else list(PAGES)[-1]


def _thumb_panel(
    axes: Any,
    surface: Surface,
    markers: Model,
    numbers: Mapping[str, str],
    radius: float,
    edge: tuple[float, float],
) -> None:
    """Draw the thumb from its nail, if it has markers; ``edge``: page's and hand's."""
    part, few = _thumb(surface, markers)
    if not few.labels:
        return
    view = _thumb_view(markers.tree)
    across = 1e3 * (np.ptp(part.vertices @ view.T, axis=0) + 2.0 * MARGIN_M)
    thumb_left = markers.tree.side == "right"
    left = edge[0] if thumb_left else edge[0] - across[0]
    corner = (left, edge[1] + across[1] + _ROW_MM)
    _panel(axes, part, view, few, numbers, radius, corner)
    below = corner[0] + 0.5 * across[0], corner[1] - across[1] - 1.0
    _write(axes, *below, "onto the thumb's nail", size=7, ha="center")


def _thumb(surface: Surface, markers: Model) -> tuple[Surface, Model]:
    """The part of the skin that the thumb's bones with markers, and all after, move.

    The markers keep their labels, by which they find their numbers.
    """
    bones = markers.tree.bones
    on = [n for n, b in enumerate(markers.bone) if bones[b].startswith("thumb")]
    first = min((int(markers.bone[n]) for n in on), default=len(bones))
    first = min(first, bones.index("thumb_proximal"))
    shown = [b for b, bone in enumerate(bones) if bone.startswith("thumb")]
    kept = np.isin(surface.bones[:, 0], [b for b in shown if b >= first])
    faces = surface.faces[kept[surface.faces].all(axis=1)]
    used, inverse = np.unique(faces, return_inverse=True)
    part = replace(
        surface,
        vertices=surface.vertices[used],
        faces=inverse.reshape(-1, 3).astype(np.int64),
        bones=surface.bones[used],
        weights=surface.weights[used],
        colors=None if surface.colors is None else surface.colors[used],
    )
    return part, markers.selected([markers.labels[n] for n in on])


def _thumb_view(tree: JointTree) -> Floats:
    """(3, 3) rows right, up and towards a viewer, who sees the thumb's nail."""
    frame = bone_frame("thumb_distal").T
    if tree.side == "right":
        frame = frame * MIRROR
        frame[0] = np.cross(frame[1], frame[2])
    return frame


def _panel(
    axes: Any,
    surface: Surface,
    view: Floats,
    markers: Model,
    numbers: Mapping[str, str],
    radius: float,
    corner: tuple[float, float],
) -> None:
    """Draw skin at true scale, and a dot of the marker's own size for each.

    Parameters
    ----------
    numbers : by the markers' labels.
    corner : [mm] the upper left one, on the page.
    """
    colors = 0.35 * skin_colors(surface) + 0.65
    picture = drawn(surface.vertices, surface.faces, colors, view, PIXEL_M)
    tall, wide = (1e3 * PIXEL_M * size for size in picture.shape[:2])
    left, high = corner
    extent = (left, left + wide, high - tall, high)
    there = np.where((picture < 255).any(axis=2, keepdims=True), 255, 0)
    clear = np.concatenate([picture, there.astype(np.uint8)], axis=2)
    axes.imshow(clear, extent=extent, interpolation="bilinear", zorder=0)
    seen = surface.vertices @ view.T
    homes = (rest_joints(markers.tree)[markers.bone] + markers.at) @ view.T
    for label, home in zip(markers.labels, homes, strict=True):
        x = left + 1e3 * (home[0] - seen[:, 0].min() + MARGIN_M)
        y = high - 1e3 * (seen[:, 1].max() + MARGIN_M - home[1])
        size = max(1e3 * radius, _DOT_MM)
        axes.add_patch(Circle((x, y), size, facecolor=_RED, edgecolor="white"))
        style = {"ha": "center", "va": "center_baseline", "color": "white"}
        _write(axes, x, y, numbers[label], size=8, weight="bold", **style)


def _title(axes: Any, title: str, lines: Sequence[str], x: float, high: float) -> None:
    """The title and what is said below it, from a page's edge, over the thumb."""
    side = "left" if x < 0.5 * PAGES["A4"][0] else "right"
    _write(axes, x, high - 5.0, title, size=13, weight="bold", ha=side)
    for n, line in enumerate(lines):
        _write(axes, x, high - 11.0 - 4.5 * n, line, size=8.5, ha=side)


def _write(axes: Any, x: float, y: float, text: str, **style: Any) -> None:
    axes.text(x, y, text, **{"color": _INK, "va": "baseline", **style})


def _ruler(axes: Any, edge: float, low: float) -> None:
    """A ruler of 100 mm to check the printed scale by, standing at a page's edge."""
    inwards, side = (1.0, "left") if edge <= _MARGIN_MM else (-1.0, "right")
    axes.plot([edge, edge], [low, low + 100], color=_INK, linewidth=0.8)
    for mm in range(0, 101, 5):
        size = inwards * (3.0 if mm % 10 == 0 else 1.6)
        axes.plot([edge, edge + size], [low + mm] * 2, color=_INK, linewidth=0.6)
    for mm in (0, 50, 100):
        style = {"size": 7, "ha": side, "va": "center"}
        _write(axes, edge + 4.0 * inwards, low + mm, f"{mm} mm", **style)


def _table(axes: Any, told: Sequence[Placement], high: float, wide: float) -> None:
    """Number, name, bone, distances."""
    columns = (_MARGIN_MM, _MARGIN_MM + 8.0, _MARGIN_MM + 42.0, _MARGIN_MM + 74.0)
    heads = ("", "marker", "on", "mm from (straight, hand flat)")
    y = high - _ROW_MM
    for x, text in zip(columns, heads, strict=True):
        _write(axes, x, y, text, size=8, weight="bold")
    axes.plot([_MARGIN_MM, wide - _MARGIN_MM], [y - 1.4] * 2, color=_INK, linewidth=0.6)
    for n, one in enumerate(told, start=1):
        y -= _ROW_MM
        far = ",  ".join(
            f"{1e3 * size:.0f} {name.replace('_', ' ')}" for name, size in one.distances
        )
        row = (str(n), one.label, one.bone, far)
        for x, text in zip(columns, row, strict=True):
            _write(axes, x, y, text, size=8)


def _save(figure: Figure, path: Path) -> None:
    """Write a figure so that the same figure gives the same bytes."""
    kind = path.suffix.lower().removeprefix(".")
    silent: dict[str, dict[str, str | None]] = {
        "pdf": {"CreationDate": None, "Producer": None, "Creator": "handclean"},
        "svg": {"Date": None, "Creator": "handclean"},
        "png": {"Software": None},
    }
    with mpl.rc_context({"svg.hashsalt": "handclean", "pdf.fonttype": 42}):
        figure.savefig(path, format=kind, dpi=200, metadata=silent[kind])
