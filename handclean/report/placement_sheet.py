"""A sheet to print and put beside the performer: where markers are to be glued.

The hand's back at true scale with a numbered dot for every marker, and a table of how
far each is from places that can be felt or seen: straight, as calipers measure it, on
the flat hand. The thumb, whose nail looks sideways, is shown from there again if it has
markers. A ruler tells whether the printer kept the scale.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
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
from handclean.hand.template_surface import landmarks, template_surface
from handclean.report.drawing import MARGIN, drawn, looking, skin_colors
from handclean.tree import MIRROR, JointTree

PAGES = {"A4": (210.0, 297.0), "A3": (297.0, 420.0)}
"""[mm] width and height of the paper, the first that has room is taken."""

PIXEL = 0.0002
"""[m] width of a pixel of the picture of the hand."""

TOLD = 3
"""Landmarks a marker's place is told by."""

_EDGE = 10.0  # [mm] that printers leave white
_ROW, _GAP, _DOT, _RULER = 4.4, 3.0, 2.2, 14.0  # [mm]
_ASIDE = 0.5  # sine of the least angle between directions to landmarks
_INCH = 25.4
_INK, _RED = "#20242c", "#c8281e"


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Where one marker goes.

    Attributes
    ----------
    label, bone : its name, and what it sits on.
    distances : (landmark, [m]) pairs, the nearest first.
    """

    label: str
    bone: str
    distances: tuple[tuple[str, float], ...]


def landmark_places(tree: JointTree, surface: Surface) -> dict[str, Floats]:
    """(3,) [m] places in the zero posture that can be found on a hand's back."""
    own = template_surface(tree)
    out = {}
    for name, vertex in landmarks(tree).items():
        if name.endswith("_crease"):
            continue  # in the palm
        place = own.vertices[vertex]
        if len(surface.vertices) == len(own.vertices):
            out[name] = surface.vertices[vertex]
        else:
            far = np.linalg.norm(surface.vertices - place, axis=1)
            out[name] = surface.vertices[far.argmin()]
    return out


def placements(markers: Model, surface: Surface) -> list[Placement]:
    """Say where every marker goes, its foot on the skin."""
    marks = landmark_places(markers.tree, surface)
    return [
        Placement(
            label=label,
            bone=markers.tree.bones[bone].replace("_", " "),
            distances=_told(foot, marks, markers.tree.bones[bone].split("_")[0]),
        )
        for label, bone, foot in zip(
            markers.labels, markers.bone, feet(markers, surface), strict=True
        )
    ]


def feet(markers: Model, surface: Surface) -> Floats:
    """(M, 3) [m] the vertices nearest to the markers in the zero posture."""
    homes = rest_joints(markers.tree)[markers.bone] + markers.at
    far = np.linalg.norm(surface.vertices[None] - homes[:, None], axis=2)
    out: Floats = surface.vertices[far.argmin(axis=1)]
    return out


def _told(
    foot: Floats, marks: Mapping[str, Floats], finger: str
) -> tuple[tuple[str, float], ...]:
    """The nearest landmark of the own finger, then the nearest in other directions."""
    away = {name: float(np.linalg.norm(place - foot)) for name, place in marks.items()}
    names = sorted(away, key=away.__getitem__)
    own = [name for name in names if name.startswith(f"{finger}_")]
    chosen: list[str] = []
    ways: list[Floats] = []
    for aside in (_ASIDE, 0.0):
        for name in [*own[:1], *names]:
            unit = (marks[name] - foot) / max(away[name], 1e-9)
            apart = all(np.linalg.norm(np.cross(unit, w)) >= aside for w in ways)
            if apart and name not in chosen and len(chosen) < TOLD:
                chosen.append(name)
                ways.append(unit)
    return tuple(sorted(((name, away[name]) for name in chosen), key=lambda p: p[1]))


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
    told = placements(markers, surface)
    size = 1e3 * (np.ptp(surface.vertices, axis=0) + 2.0 * MARGIN)
    needed = 2 * _EDGE + size[1] + _GAP + _ROW * (len(told) + 1)
    fits = [
        name
        for name, page in PAGES.items()
        if needed <= page[1] and size[0] + 2 * _EDGE + _RULER <= page[0]
    ]
    name = fits[0] if fits else list(PAGES)[-1]
    wide, high = PAGES[name]
    figure = Figure(figsize=(wide / _INCH, high / _INCH), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    thumb_left = markers.tree.side == "right"
    sides = (_EDGE, wide - _EDGE) if thumb_left else (wide - _EDGE, _EDGE)
    lines = (f"{markers.tree.side} hand, from its back", source, f"100 % on {name}")
    _title(axes, title, lines, sides[0], high - _EDGE)
    _ruler(axes, sides[1], high - _EDGE - 100.0)
    numbers = {label: str(n) for n, label in enumerate(markers.labels, start=1)}
    free = wide - 2 * _EDGE - _RULER - size[0]  # all of it on the thumb's side
    corner = _EDGE + (free if thumb_left else _RULER), high - _EDGE
    _panel(axes, surface, looking(0.0, 0.0), markers, numbers, radius, corner)
    part, few = _thumb(surface, markers)
    if few.labels:
        view = _thumb_view(markers.tree)
        across = 1e3 * (np.ptp(part.vertices @ view.T, axis=0) + 2.0 * MARGIN)
        corner = (
            _EDGE if thumb_left else wide - _EDGE - across[0],
            high - _EDGE - size[1] + across[1] + _ROW,
        )
        _panel(axes, part, view, few, numbers, radius, corner)
        below = corner[0] + 0.5 * across[0], corner[1] - across[1] - 1.0
        _write(axes, *below, "onto the thumb's nail", size=7, ha="center")
    axes.set(xlim=(0.0, wide), ylim=(0.0, high), aspect="equal")
    _table(axes, told, high - _EDGE - size[1] - _GAP, wide)
    try:
        _save(figure, path)
    except OSError as error:
        raise FileError(path, f"cannot be written: {error.strerror or error}") from None
    if name == "A4":
        return ()
    return (f"the sheet needs {name}: hand and table do not fit on A4",)


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
    picture = drawn(surface.vertices, surface.faces, colors, view, PIXEL)
    tall, wide = (1e3 * PIXEL * size for size in picture.shape[:2])
    left, high = corner
    extent = (left, left + wide, high - tall, high)
    there = np.where((picture < 255).any(axis=2, keepdims=True), 255, 0)
    clear = np.concatenate([picture, there.astype(np.uint8)], axis=2)
    axes.imshow(clear, extent=extent, interpolation="bilinear", zorder=0)
    seen = surface.vertices @ view.T
    homes = (rest_joints(markers.tree)[markers.bone] + markers.at) @ view.T
    for label, home in zip(markers.labels, homes, strict=True):
        x = left + 1e3 * (home[0] - seen[:, 0].min() + MARGIN)
        y = high - 1e3 * (seen[:, 1].max() + MARGIN - home[1])
        size = max(1e3 * radius, _DOT)
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
    inwards, side = (1.0, "left") if edge <= _EDGE else (-1.0, "right")
    axes.plot([edge, edge], [low, low + 100], color=_INK, linewidth=0.8)
    for mm in range(0, 101, 5):
        size = inwards * (3.0 if mm % 10 == 0 else 1.6)
        axes.plot([edge, edge + size], [low + mm] * 2, color=_INK, linewidth=0.6)
    for mm in (0, 50, 100):
        style = {"size": 7, "ha": side, "va": "center"}
        _write(axes, edge + 4.0 * inwards, low + mm, f"{mm} mm", **style)


def _table(axes: Any, told: Sequence[Placement], high: float, wide: float) -> None:
    """Number, name, bone, distances."""
    columns = (_EDGE, _EDGE + 8.0, _EDGE + 42.0, _EDGE + 74.0)
    heads = ("", "marker", "on", "mm from (straight, hand flat)")
    y = high - _ROW
    for x, text in zip(columns, heads, strict=True):
        _write(axes, x, y, text, size=8, weight="bold")
    axes.plot([_EDGE, wide - _EDGE], [y - 1.4] * 2, color=_INK, linewidth=0.6)
    for n, one in enumerate(told, start=1):
        y -= _ROW
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
