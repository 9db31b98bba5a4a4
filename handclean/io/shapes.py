"""What is in meshes, point clouds and skinned hands, as plain values."""

from pathlib import Path
from typing import Any

import numpy as np

from handclean.errors import FileError, HandcleanError, UsageError
from handclean.hand.surface import is_closed
from handclean.io.gltf.hand import ImportedHand, import_hand
from handclean.io.gltf.nodes import nodes_of
from handclean.io.gltf.read import Glb, floats, read_glb
from handclean.io.gltf.skinned_map import SkinnedMap, load_skinned_map, of_hands
from handclean.io.mesh.meshes import looks_inwards, read_mesh
from handclean.io.shared.joint_map import SHIPPED
from handclean.io.shared.reading import reported
from handclean.recording import Numbering
from handclean.remarks import Remark, remark


def read_hand(path: Path, joint_map: str = "") -> ImportedHand:
    """Read a skinned hand.

    Parameters
    ----------
    joint_map : name of one that ships, or a TOML file; "" for the one that ships whose
        joints the file has.

    Raises
    ------
    FileError, UsageError
        If the file or the joint map is none, or they do not go together.
    """
    glb = read_glb(path)
    names = set(nodes_of(glb).names)
    given = load_skinned_map(joint_map) if joint_map else None
    if given is not None and not given.bones.sides:
        return import_hand(glb, given)
    fitting = _fitting(names) if given is None else of_hands(given, names)
    if not fitting:
        some = ", ".join(sorted(names - {""})[:4])
        which = "no shipped joint map" if given is None else f"joint map {joint_map}"
        wrong = f"{which} has {'not ' if given else ''}its joints ({some} ...)"
        right = "name a TOML file that says whose they are by --joint-map"
        raise FileError(path, wrong, right)
    if len(fitting) > 1:
        wrong = f"holds {len(fitting)} hands of joint map {fitting[0].bones.name}"
        raise FileError(path, wrong, "a file should hold one hand with its skin")
    return import_hand(glb, fitting[0])


def _fitting(names: set[str]) -> list[SkinnedMap]:
    """Return the shipped map all of whose joints are there, for each hand."""
    for path in sorted(SHIPPED.glob("*.toml")):
        try:
            found = load_skinned_map(path.stem)
        except HandcleanError:  # one of other formats, with left-handed axes
            continue
        if hands := of_hands(found, names):
            return hands
    return []


def inspect_glb(path: Path) -> dict[str, Any]:
    """Return what is in a glTF file.

    Raises
    ------
    FileError
        If it is not one.
    """
    glb = read_glb(path)
    names = nodes_of(glb).names
    about: dict[str, Any] = {
        "format": "glb",
        "unit": "m",
        "up_axis": "+y",
        "generator": _generator(glb),
        "joints": _joints(glb, names),
        "animations": len(glb.rows("animations")),
        "skeletons": {},
        **reported([]),
    }
    if len(glb.rows("skins")) != 1:
        return about | _motion(glb)
    try:
        hand = read_hand(path)
    except HandcleanError as error:
        about |= reported([remark("left-out", error.wrong)])
    else:
        tree, surface = hand.subject.model.tree, hand.subject.surface
        assert surface is not None, "an imported hand has a skin"
        about["skeletons"] = {
            tree.side: {"kind": tree.kind, "side": tree.side, "subject": tree.subject}
        }
        about |= {"vertices": len(surface.vertices), "faces": len(surface.faces)}
        about["closed"] = is_closed(surface.faces)
    return about | _motion(glb)


def _generator(glb: Glb) -> str:
    asset = glb.tree.get("asset")
    return str(asset.get("generator", ""))[:80] if isinstance(asset, dict) else ""


def _joints(glb: Glb, names: tuple[str, ...]) -> list[str]:
    found: list[str] = []
    for skin in glb.rows("skins"):
        joints = skin.get("joints")
        for joint in joints if isinstance(joints, list) else []:
            glb.row("nodes", joint)
            found.append(names[joint])
    return found


def _motion(glb: Glb) -> dict[str, Any]:
    """Return keys and length of the longest track of an animated file."""
    keys, seconds = 0, 0.0
    done: set[int] = set()
    for animation in glb.rows("animations"):
        samplers = animation.get("samplers")
        for sampler in samplers if isinstance(samplers, list) else []:
            index = sampler.get("input") if isinstance(sampler, dict) else None
            if not isinstance(index, int) or index in done:
                continue
            done.add(index)
            times = floats(glb, index, 1, "times")
            keys = max(keys, len(times))
            seconds = max(seconds, float(times.max()))
    if not keys:
        return {}
    rate = float(f"{(keys - 1) / seconds:.6g}") if seconds > 0.0 else None
    about: dict[str, Any] = {"frames": keys, "rate": rate, "duration_s": seconds}
    return about | _extras(glb)


def _extras(glb: Glb) -> dict[str, Any]:
    """Frames that are not trusted, first and last number of each run, in files of ours.

    And the first frame's number; older files have none and count from 0, without the
    last, which becomes the numbers from 1.
    """
    about: dict[str, Any] = {}
    for animation in glb.rows("animations"):
        extras = animation.get("extras")
        listed = extras.get("not_trusted") if isinstance(extras, dict) else None
        if not isinstance(extras, dict) or not isinstance(listed, dict):
            continue
        first = extras.get("first_frame")
        if isinstance(first, int):
            about["first_frame"] = first
        else:
            listed = {name: _numbered(runs) for name, runs in listed.items()}
        about["not_trusted"] = about.get("not_trusted", {}) | listed
    return about


def _numbered(runs: Any) -> Any:
    """Runs of an older file by number; whatever else it is stays."""
    numbering = Numbering(1)
    try:
        return [list(numbering.span(start, stop)) for start, stop in runs]
    except (TypeError, ValueError, OverflowError):
        return runs


def inspect_mesh(path: Path, *, unit: str | None = None) -> dict[str, Any]:
    """Return what is in a mesh or a point cloud; without a unit, as far as it goes.

    Raises
    ------
    FileError
        If it is neither.
    """
    remarks: list[Remark] = []
    is_said = True
    try:
        mesh = read_mesh(path, unit=unit)
    except UsageError as error:
        if unit is not None:
            raise
        remarks.append(remark("unit", error.wrong, option="--unit"))
        is_said = False
        mesh = read_mesh(path, unit=_plausible(path))
    remarks += mesh.remarks
    size = np.ptp(mesh.vertices, axis=0) * 1e3
    if len(mesh.faces) and looks_inwards(mesh):
        remarks.append(remark("implausible", "it is inside out"))
    return {
        "format": path.suffix.lower().removeprefix("."),
        "unit": mesh.unit if is_said else None,
        "vertices": len(mesh.vertices),
        "faces": len(mesh.faces),
        "closed": bool(len(mesh.faces)) and is_closed(mesh.faces),
        "size_mm": size.round(2).tolist(),
        "normals": mesh.normals is not None,
        "colors": mesh.colors is not None,
        **reported(remarks),
    }


def _plausible(path: Path) -> str:
    """Return the first unit in which a file can be read."""
    for unit in ("mm", "cm"):
        try:
            read_mesh(path, unit=unit)
        except HandcleanError:
            continue
        return unit
    return "m"
