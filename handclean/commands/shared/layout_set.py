"""A layout as a marker set: names of its markers, their places, and files of it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.commands.shared.choices import LayingOut
from handclean.commands.shared.layout_hand import LayoutHand
from handclean.hand.marker_set import MarkerSet
from handclean.hand.model import Model
from handclean.hand.surface import vertex_normals
from handclean.hand.template import bone_frame
from handclean.io.gltf.write import write_hand
from handclean.io.marker_sets import write_marker_set
from handclean.layouts.optimize import Layout
from handclean.layouts.problem import Problem
from handclean.report.beads import with_beads
from handclean.report.placement_sheet import write_sheet
from handclean.runner.outcome import Entry
from handclean.tree import MIRROR, JointTree

_SEGMENTS = {
    "hand": "HAND",
    "distal": "TIP",
    "middle": "MID",
    "proximal": "PROX",
    "metacarpal": "BASE",
}


def labels_of(bones: Sequence[str], side: str) -> tuple[str, ...]:
    """Names of markers on these bones: R_INDEX_TIP, R_HAND_1, R_HAND_2."""
    plain = []
    for bone in bones:
        finger, _, segment = bone.partition("_")
        words = ["L" if side == "left" else "R"]
        words += [finger.upper()] if segment else []
        plain.append("_".join([*words, _SEGMENTS[segment or finger]]))
    return tuple(
        f"{name}_{plain[: n + 1].count(name)}" if plain.count(name) > 1 else name
        for n, name in enumerate(plain)
    )


def marker_set_of(
    found: Layout,
    problem: Problem,
    hand: LayoutHand,
    given: MarkerSet | None,
    settings: LayingOut,
    source: str,
) -> MarkerSet:
    """The layout as a marker set; ``name`` is left to the file if nobody gave one."""
    tree, model = hand.tree, problem.model
    if given is not None:
        labels = found.labels
        at = given.at[found.chosen]
    else:
        labels = labels_of(found.bones, tree.side)
        vertices = np.array([int(label) for label in found.labels])
        normals = vertex_normals(hand.surface.vertices, hand.surface.faces)
        lifted = 0.5e-3 * settings.marker_mm * normals[vertices]
        at = _at_rest(tree, found.bones, model.at[found.chosen] + lifted)
    return MarkerSet(
        name=settings.name,
        source=source,
        kind="hand",
        side=tree.side,
        labels=labels,
        bones=found.bones,
        at=at,
    )


def _at_rest(tree: JointTree, bones: Sequence[str], at: Floats) -> Floats:
    """(M, 3) side-free places on the template: what `bone_places` makes places of."""
    free = at / tree.scale * (MIRROR if tree.side == "right" else 1.0)
    out: Floats = np.array(
        [place @ bone_frame(bone) for bone, place in zip(bones, free, strict=True)]
    )
    return out


def writers_of(
    markers: MarkerSet, found: Layout, hand: LayoutHand, settings: LayingOut
) -> tuple[Any, ...]:
    """Return what writes the marker set, and what is wanted beside it."""
    tree, surface = hand.tree, hand.surface
    radius = max(0.5e-3 * settings.marker_mm, 0.5e-3)
    model: Model = markers.on(tree)
    remarks = (
        ()
        if settings.from_set
        else tuple(f"on vertex {label}" for label in found.labels)
    )

    def write_set(path: Path, _: tuple[Entry, ...]) -> None:
        write_marker_set(path, markers, remarks=remarks)

    def write_beside(path: Path, _: tuple[Entry, ...]) -> None:
        if path.suffix.lower() == ".glb":
            write_hand(path, tree, with_beads(surface, model, radius))
        else:
            title = markers.name or "Reduced marker layout"
            write_sheet(path, model, surface, radius, title=title, source=hand.name)

    return (write_set, *[write_beside for _ in settings.beside])
