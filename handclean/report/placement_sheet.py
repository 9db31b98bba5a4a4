"""A sheet to print and put beside the performer: where markers are to be glued.

The hand's back at true scale with a numbered dot for every marker, and a table of how
far each is from places that can be felt or seen: straight, as calipers measure it, on
the flat hand. Where thumb markers look sideways the dots show them as the camera above
sees them. A ruler at the edge tells whether the printer kept the scale.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.hand.model import Model
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template_surface import landmarks, template_surface
from handclean.report.hand_pictures import drawn, looking, skin_colors
from handclean.tree import JointTree

PAGES = {"A4": (210.0, 297.0), "A3": (297.0, 420.0)}
"""[mm] width and height of the paper, the first that has room is taken."""

PIXEL = 0.0002
"""[m] width of a pixel of the picture of the hand."""

TOLD = 3
"""Landmarks a marker's place is told by."""

_EDGE = 12.0  # [mm] that printers leave white
_TITLE, _ROW, _GAP = 16.0, 4.6, 5.0  # [mm]
_ASIDE = 0.5  # sine of the least angle between directions to landmarks
_INCH = 25.4
_INK = "#20242c"


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
            distances=_told(foot, marks),
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


def _told(foot: Floats, marks: Mapping[str, Floats]) -> tuple[tuple[str, float], ...]:
    """The nearest landmarks, none in the direction of one that is nearer, or behind."""
    names = sorted(marks, key=lambda name: float(np.linalg.norm(marks[name] - foot)))
    chosen: list[str] = []
    ways: list[Floats] = []
    for aside in (_ASIDE, 0.0):
        for name in names:
            way = marks[name] - foot
            size = float(np.linalg.norm(way))
            unit = way / max(size, 1e-9)
            apart = all(np.linalg.norm(np.cross(unit, w)) >= aside for w in ways)
            if apart and name not in chosen and len(chosen) < TOLD:
                chosen.append(name)
                ways.append(unit)
    found = [(name, float(np.linalg.norm(marks[name] - foot))) for name in chosen]
    return tuple(sorted(found, key=lambda pair: pair[1]))


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
    picture = drawn(
        surface.vertices,
        surface.faces,
        0.35 * skin_colors(surface) + 0.65,
        looking(0.0, 0.0),
        PIXEL,
    )
    tall, wide = (1e3 * PIXEL * size for size in picture.shape[:2])
    needed = 2 * _EDGE + _TITLE + tall + 2 * _GAP + _ROW * (len(told) + 2)
    name, page = next(
        (
            (name, size)
            for name, size in PAGES.items()
            if needed <= size[1] and wide + 2 * _EDGE <= size[0]
        ),
        list(PAGES.items())[-1],
    )
    figure = Figure(figsize=(page[0] / _INCH, page[1] / _INCH), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, page[0]), ylim=(0.0, page[1]), aspect="equal")
    axes.set_axis_off()
    top = page[1] - _EDGE
    _write(axes, _EDGE, top - 5.0, title, size=15, weight="bold")
    words = f"{markers.tree.side} hand, back · {source} · print at 100 % on {name}"
    _write(axes, _EDGE, top - 11.5, words, size=8.5)
    left, high = 0.5 * (page[0] - wide), top - _TITLE
    axes.imshow(
        picture,
        extent=(left, left + wide, high - tall, high),
        interpolation="bilinear",
        zorder=0,
    )
    axes.set(xlim=(0.0, page[0]), ylim=(0.0, page[1]))
    corner = surface.vertices.min(axis=0)[0], surface.vertices.max(axis=0)[1]
    _dots(axes, markers, radius, (left, high), corner)
    _ruler(axes, page[0] - _EDGE, high - tall, 100)
    _table(axes, told, high - tall - _GAP, page[0])
    try:
        _save(figure, path)
    except OSError as error:
        raise FileError(path, f"cannot be written: {error.strerror or error}") from None
    if name == "A4":
        return ()
    return (f"the sheet needs {name}, as hand and table do not fit on A4",)


def _write(axes: Any, x: float, y: float, text: str, **style: Any) -> None:
    axes.text(x, y, text, **{"color": _INK, "va": "baseline", **style})


def _dots(
    axes: Any,
    markers: Model,
    radius: float,
    at: tuple[float, float],
    corner: tuple[float, float],
) -> None:
    """A dot of the marker's own size for each, with its number.

    Parameters
    ----------
    at : [mm] upper left corner of the picture on the page.
    corner : [m] least x and largest y of the skin, which the picture shows a margin
        from its corner.
    """
    homes = rest_joints(markers.tree)[markers.bone] + markers.at
    margin = 4.0
    for n, home in enumerate(homes, start=1):
        x = at[0] + margin + 1e3 * (home[0] - corner[0])
        y = at[1] - margin - 1e3 * (corner[1] - home[1])
        size = max(1e3 * radius, 2.2)
        circle = mpl.patches.Circle(
            (x, y), size, facecolor="#c8281e", edgecolor="white", linewidth=0.8
        )
        axes.add_patch(circle)
        style = {"ha": "center", "va": "center_baseline", "color": "white"}
        _write(axes, x, y, str(n), size=8, weight="bold", **style)


def _ruler(axes: Any, right: float, low: float, length: int) -> None:
    """A ruler to check the printed scale by [mm], standing at the right edge."""
    axes.plot([right, right], [low, low + length], color=_INK, linewidth=0.8)
    for mm in range(0, length + 1, 5):
        size = 3.0 if mm % 10 == 0 else 1.6
        axes.plot([right - size, right], [low + mm] * 2, color=_INK, linewidth=0.6)
    for mm in range(0, length + 1, 50):
        style = {"size": 7, "ha": "right", "va": "center"}
        _write(axes, right - 4.0, low + mm, f"{mm} mm", **style)


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
