"""Subject files: a hand, its markers and its skin, and how well they are known (HDF5).

The skin, where the file has one, is the group ``surface``: ``vertices`` [m] in the zero
posture and the root's frame, ``faces``, ``bones`` and ``weights`` of every vertex, and
``colors`` where they are known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from handclean.errors import FileError, HandcleanError
from handclean.hand.model import Model
from handclean.hand.skeleton import load_skeleton
from handclean.hand.subject import Subject
from handclean.hand.surface import BONES_PER_VERTEX, Surface
from handclean.hand.template import HAND_LENGTH_M
from handclean.io.formats import HAND, MESH, TAKE, by_suffix
from handclean.io.hdf5.file import read_h5, write_h5
from handclean.io.hdf5.parts import (
    Array,
    Fact,
    Part,
    expect_finite,
    tree_from,
    tree_part,
)
from handclean.io.hdf5.provenance import provenance_from, provenance_item
from handclean.io.shared.reading import reported

FORMAT = "handclean subject"

_MOST_SIGMA_M = 1.0
"""[m] no marker of a hand is less sure; chosen, only to bound what is read."""

_OTHERS = {
    TAKE: (
        "is a take, not a subject",
        "'handclean calibrate-hand markers' makes a subject of a labelled one",
    ),
    MESH: (
        "is a mesh, not a subject",
        "'handclean calibrate-hand scan' makes a subject of it",
    ),
    HAND: (
        "is a rigged hand, not a subject",
        "'handclean convert' makes a subject of it",
    ),
}
"""What else is given for a subject, and what makes a subject of it."""


def write_subject(
    path: Path, subject: Subject, provenance: Sequence[Mapping[str, Any]] = ()
) -> None:
    """Write a subject; the file holds all that labelling and solving need."""
    markers = Part(
        items={
            "labels": list(subject.model.labels),
            "bone": Array(subject.model.bone),
            "at": Array(subject.model.at, "m"),
            "sigma": Array(np.asarray(subject.marker_sigma, dtype=np.float64), "m"),
        }
    )
    names = sorted(subject.errors)
    items: dict[str, Any] = {
        "skeleton": tree_part(subject.model.tree),
        "markers": markers,
        "errors": Part(
            items={
                "names": names,
                "values": Array(np.array([float(subject.errors[n]) for n in names])),
            }
        ),
        **provenance_item(provenance),
    }
    if subject.surface is not None:
        items["surface"] = _surface_part(subject.surface)
    facts: dict[str, Fact] = {
        "name": subject.name,
        "marker_set": subject.marker_set,
        "calibrated": bool(subject.calibrated),
    }
    write_h5(path, FORMAT, Part(facts, items))


def read_subject(path: Path) -> Subject:
    """Read a subject from ``.h5``, or a joint tree with markers from ``.toml``.

    One without a name is called by its file.

    Raises
    ------
    FileError
        If the file is neither.
    """
    if path.suffix == ".toml":
        found = load_skeleton(path)
        return replace(found, name=found.name or _called(path))
    given = by_suffix(path)
    if given is not None and given.suffix != ".h5" and path.exists():
        raise FileError(path, *_OTHERS[given.holds])
    part = read_h5(path, FORMAT)
    expect_finite(part, unknown=("sigma", "values"))
    tree = tree_from(part.part("skeleton"))
    markers = part.part("markers")
    labels = markers.names("labels")
    count = len(labels)
    bone = markers.array("bone", "", np.int64, count)
    at = markers.array("at", "m", np.float64, count, 3)
    if count and (bone.min() < 0 or bone.max() >= len(tree.bones)):
        raise markers.fail(f"bone should be 0 to {len(tree.bones) - 1}")
    if len(set(labels)) != count:
        raise markers.fail("labels should be unique")
    sigma = markers.array("sigma", "m", np.float64, count)
    if np.any((sigma < 0.0) | (sigma > _MOST_SIGMA_M)):
        raise markers.fail(f"sigma should be 0 to {_MOST_SIGMA_M:g} m, or NaN")
    errors = part.part("errors")
    names = errors.names("names") if errors.has("names") else ()
    values = errors.array("values", "", np.float64, len(names)) if names else ()
    return Subject(
        name=part.text("name", "") or _called(path),
        model=Model(tree=tree, labels=labels, bone=bone, at=at),
        marker_set=part.text("marker_set", ""),
        marker_sigma=sigma,
        errors=dict(zip(names, map(float, values), strict=True)),
        calibrated=bool(part.attrs.get("calibrated", True)),
        surface=_surface_from(part, len(tree.bones)),
        provenance=provenance_from(part),
    )


def _called(path: Path) -> str:
    """Return what to call a subject that has no name."""
    return path.stem.removesuffix(".subject")


def inspect_subject(path: Path) -> dict[str, Any]:
    """Return what is in a subject file, as plain values.

    Raises
    ------
    FileError
        If it is none.
    """
    subject = read_subject(path)
    tree, sigma = subject.model.tree, subject.marker_sigma
    known = sigma[np.isfinite(sigma)]
    residual = subject.errors.get("heldout_rms_m", np.nan)
    if not np.isfinite(residual) and len(known):
        residual = float(np.sqrt(np.mean(known**2)))
    about: dict[str, Any] = {
        "format": FORMAT,
        "name": subject.name,
        "side": tree.side,
        "size": tree.scale,
        "length_mm": 1e3 * tree.scale * HAND_LENGTH_M if tree.kind == "hand" else None,
        "marker_set": subject.marker_set,
        "markers": list(subject.model.labels),
        "calibrated": subject.calibrated,
        "residual_mm": 1e3 * float(residual) if np.isfinite(residual) else None,
        "skin": subject.surface is not None,
        "steps": [str(entry.get("command", "?")) for entry in subject.provenance],
        **reported([]),
    }
    if subject.surface is not None:
        about["vertices"] = len(subject.surface.vertices)
        about["faces"] = len(subject.surface.faces)
    return about


def _surface_part(surface: Surface) -> Part:
    items = {
        "vertices": Array(surface.vertices, "m"),
        "faces": Array(surface.faces.astype(np.int64)),
        "bones": Array(surface.bones.astype(np.int64)),
        "weights": Array(surface.weights),
    }
    if surface.colors is not None:
        items["colors"] = Array(surface.colors)
    return Part(items=items)


def _surface_from(root: Part, bones: int) -> Surface | None:
    """Return the skin that a subject file holds, None if it holds none.

    Raises
    ------
    FileError
        If it is not one of a tree of that many bones.
    """
    if not root.has("surface"):
        return None
    part = root.part("surface")
    vertices = part.array("vertices", "m", np.float64, None, 3)
    count = len(vertices)
    moved_by = part.array("bones", "", np.int64, count, BONES_PER_VERTEX)
    if count and moved_by.max() >= bones:
        raise part.fail(f"bones should be 0 to {bones - 1}")
    colors = None
    if part.has("colors"):
        colors = part.array("colors", "", np.uint8, count, 3)
    try:
        return Surface(
            vertices=vertices,
            faces=part.array("faces", "", np.int64, None, 3),
            bones=moved_by,
            weights=part.array("weights", "", np.float64, count, BONES_PER_VERTEX),
            colors=colors,
        )
    except FileError:
        raise
    except HandcleanError as error:
        raise part.fail(error.wrong) from None
