"""Meshes, subjects and skinned hands as ``convert`` reads them and hands them back."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from handclean.commands.shared.formats import RECORDS
from handclean.commands.shared.take_options import options_of
from handclean.errors import UsageError
from handclean.hand.subject import Subject
from handclean.hand.surface import vertex_normals
from handclean.hand.template import HAND_LENGTH_M
from handclean.hand.template_surface import template_surface
from handclean.io.formats import HANDS, MESHES, SUBJECTS
from handclean.io.gltf.write import write_hand
from handclean.io.hdf5.file import format_of
from handclean.io.hdf5.subject import FORMAT, read_subject, write_subject
from handclean.io.mesh.meshes import Mesh, read_mesh, write_mesh
from handclean.io.shapes import read_hand
from handclean.remarks import Remark, remark
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome

_MOST_SKEW_DEG = 5.0
"""[degrees] out of a finger's plane from which it is said (chosen)."""


def is_mesh(source: Source) -> bool:
    """Whether an input is a mesh or a point cloud."""
    return source.path.suffix.lower() in MESHES


def is_skinned(source: Source) -> bool:
    """Whether an input is a file that may hold a skinned hand."""
    return source.path.suffix.lower() in HANDS


def is_subject(source: Source) -> bool:
    """Whether an input is a subject.

    Raises
    ------
    FileError
        If it ends in ``.h5`` and is none of ours.
    """
    return source.path.suffix.lower() == ".h5" and format_of(source.path) == FORMAT


def mesh(source: Source) -> Outcome:
    """Hand back a mesh in metres, for another mesh format.

    Raises
    ------
    HandcleanError
        If it cannot be read, or should become something else.
    """
    if source.target not in MESHES:
        raise UsageError(
            f"a mesh cannot be written as {source.target}, only as "
            + " ".join(MESHES)
            + "; 'handclean calibrate-hand scan' makes a subject of it",
            where=source.path,
        )
    found = read_mesh(source.path, unit=options_of(source).unit)

    def write(path: Path, provenance: tuple[Entry, ...]) -> tuple[Remark, ...]:
        return write_mesh(path, found)

    count, faces = len(found.vertices), len(found.faces)
    return Outcome(
        line=f"{count} vertices, {faces} faces" if faces else f"{count} points",
        figures={"vertices": count, "faces": faces},
        remarks=found.remarks,
        writers=(write,),
        history=RECORDS.of(source.path),
    )


def skinned(source: Source, joint_map: str) -> Outcome:
    """Make a subject of a skinned hand.

    Raises
    ------
    HandcleanError
        If the file holds none, or the joint map does not fit.
    """
    found = read_hand(source.path, joint_map)
    remarks: list[Remark] = []
    skew = float(np.degrees(found.missed))
    if skew > _MOST_SKEW_DEG:
        remarks.append(
            remark(
                "subject",
                f"a finger was drawn bent sideways by {skew:.1f} degrees, as its "
                "hinges cannot bend; it was straightened",
                skew_deg=skew,
            )
        )
    if found.animated:
        remarks.append(
            remark(
                "left-out",
                "its motion is not read, only the hand; convert what the file was made "
                "from (.h5, .bvh) for the motion",
            )
        )
    return subject(source, found.subject, remarks, RECORDS.of(source.path))


def subject_file(source: Source) -> Outcome:
    """Hand back a subject that was read from a file.

    Raises
    ------
    HandcleanError
        If it cannot be read.
    """
    return subject(source, read_subject(source.path), (), RECORDS.of(source.path))


def subject(
    source: Source,
    found: Subject,
    remarks: Sequence[Remark],
    history: tuple[Entry, ...],
) -> Outcome:
    """Hand back a subject, or its skin; the template's if it has none of its own.

    Raises
    ------
    UsageError
        If the output's format is none of a subject's.
    """
    if source.target not in SUBJECTS:
        raise UsageError(
            f"a subject cannot be written as {source.target}, only as "
            + " ".join(SUBJECTS),
            where=source.path,
        )
    tree = found.model.tree
    own = found.surface
    if tree.kind != "hand" and own is None and source.target != ".h5":
        raise UsageError(
            f"'{found.name}' is no hand and has no surface", where=source.path
        )
    skin = template_surface(tree) if own is None and tree.kind == "hand" else own

    def write(path: Path, provenance: tuple[Entry, ...]) -> tuple[Remark, ...]:
        if source.target == ".h5":
            write_subject(path, found, provenance)
            return ()
        assert skin is not None
        if source.target == ".glb":
            write_hand(path, tree, skin)
            return ()
        normals = vertex_normals(skin.vertices, skin.faces)
        made = Mesh(
            vertices=skin.vertices,
            faces=skin.faces,
            normals=normals,
            colors=skin.colors,
        )
        return write_mesh(path, made)

    length = 1e3 * tree.scale * HAND_LENGTH_M
    words = f"a {tree.side} hand of {length:.0f} mm" if tree.side else f"a {tree.kind}"
    figures = {"side": tree.side, "length_mm": length}
    if own is not None:
        words += f" with {len(own.vertices)} vertices, {len(own.faces)} faces"
        figures |= {"vertices": len(own.vertices), "faces": len(own.faces)}
    return Outcome(
        line=words,
        figures=figures,
        remarks=tuple(remarks),
        writers=(write,),
        history=history,
    )
