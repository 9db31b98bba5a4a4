"""Where markers go on a hand: how far each is from landmarks that are found on it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.hand.model import Model
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template_surface import landmarks, template_surface
from handclean.tree import JointTree

LANDMARKS_OF_A_MARKER = 3
"""Landmarks by which a marker's place is told: three distances fix it (chosen)."""

_LEAST_SINE = 0.5
"""[-] sine of the least angle between directions to landmarks (chosen)."""


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
            distances=_distances(foot, marks, markers.tree.bones[bone].split("_")[0]),
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


def _distances(
    foot: Floats, marks: Mapping[str, Floats], finger: str
) -> tuple[tuple[str, float], ...]:
    """Names and distances [m] of landmarks: the own finger's, then others around."""
    away = {name: float(np.linalg.norm(place - foot)) for name, place in marks.items()}
    names = sorted(away, key=away.__getitem__)
    own = [name for name in names if name.startswith(f"{finger}_")]
    chosen: list[str] = []
    ways: list[Floats] = []
    for least in (_LEAST_SINE, 0.0):
        for name in [*own[:1], *names]:
            unit = (marks[name] - foot) / max(away[name], 1e-9)
            apart = all(np.linalg.norm(np.cross(unit, w)) >= least for w in ways)
            if apart and name not in chosen and len(chosen) < LANDMARKS_OF_A_MARKER:
                chosen.append(name)
                ways.append(unit)
    return tuple(sorted(((name, away[name]) for name in chosen), key=lambda p: p[1]))
