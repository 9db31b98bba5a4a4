"""A skinned mesh out of a glTF file: vertices, and the joints that move them.

In the scene a vertex v goes to ``sum_j w_j W_j B_j v``, W_j where joint j's node is and
B_j its inverse bind matrix. The mesh was drawn around the joints at ``inv(B_j)``: that
*bind pose* is read, wherever the nodes stand now. Lengths are brought to metres as the
nodes would bring them: by the scale of ``W_j B_j``.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from handclean.arrays import Bytes, Floats, Ints
from handclean.io.gltf.nodes import Nodes, nodes_of
from handclean.io.gltf.read import Glb, accessor, floats
from handclean.io.mesh.raw import as_bytes

_MOST_PARTS = 256
"""Parts of a mesh, at most (chosen)."""

_TRIANGLES_MODE = 4
"""The mode of a part that consists of triangles (glTF 2.0)."""


@dataclass(frozen=True)
class SkinnedMesh:
    """V vertices around J joints, all in the mesh's own axes.

    Attributes
    ----------
    vertices : (V, 3) [m]; faces : (F, 3).
    joints : (V, K) joints that move each vertex; weights : (V, K), sum 1.
    names : (J,) of the joints.
    places : (4, 4) by name: the frame of each joint, and of each node below one, with
        unit axes and its origin in metres.
    up : by the name of each node, that of its parent, or "".
    colors : (V, 3) or None.
    """

    vertices: Floats
    faces: Ints
    joints: Ints
    weights: Floats
    names: tuple[str, ...]
    places: Mapping[str, Floats]
    up: Mapping[str, str]
    colors: Bytes | None


def skinned_mesh(glb: Glb) -> SkinnedMesh:
    """Return the skinned mesh of a file that has one skin.

    Raises
    ------
    FileError
        If it has none or several, or what it has is damaged.
    """
    nodes = nodes_of(glb)
    skins = glb.rows("skins")
    if len(skins) != 1:
        wrong = f"has {len(skins)} skins" if skins else "has no skin"
        right = "save one hand per file" if skins else "a rigged hand is needed"
        raise glb.fail(wrong, right)
    joints = _joints(glb, skins[0], nodes)
    bind = _bind(glb, skins[0], len(joints))
    scale = _scale(glb, nodes.world[joints[0]] @ np.linalg.inv(bind[0]))
    parts = [_part(glb, part, len(joints)) for part in _parts(glb)]
    counts = np.cumsum([0, *(len(part["vertices"]) for part in parts)])
    colors = [part["colors"] for part in parts]
    width = max(part["joints"].shape[1] for part in parts)
    return SkinnedMesh(
        vertices=scale * np.concatenate([part["vertices"] for part in parts]),
        faces=np.concatenate(
            [part["faces"] + start for part, start in zip(parts, counts, strict=False)]
        ),
        joints=np.concatenate([_padded(part["joints"], width) for part in parts]),
        weights=np.concatenate([_padded(part["weights"], width) for part in parts]),
        names=tuple(nodes.names[j] for j in joints),
        places=_places(glb, nodes, joints, bind, scale),
        up={
            name: nodes.names[up] if up >= 0 else ""
            for name, up in zip(nodes.names, nodes.parents, strict=True)
        },
        colors=None if any(c is None for c in colors) else np.concatenate(colors),
    )


def _joints(glb: Glb, skin: dict[str, Any], nodes: Nodes) -> list[int]:
    joints = skin.get("joints")
    if not isinstance(joints, list) or not joints:
        raise glb.fail("its skin has no joints")
    for joint in joints:
        glb.row("nodes", joint)
    for name, count in Counter(nodes.names[joint] for joint in joints).items():
        if count > 1 or not name:
            wrong = f"{count} joints are called '{name}'"
            raise glb.fail(wrong, "names should be unique")
    return joints


def _bind(glb: Glb, skin: dict[str, Any], count: int) -> Floats:
    """(J, 4, 4) where the joints are in the mesh's axes and unit."""
    if "inverseBindMatrices" not in skin:
        return np.tile(np.eye(4), (count, 1, 1))
    index = skin["inverseBindMatrices"]
    found = floats(glb, index, 16, "inverse bind matrices")
    if len(found) < count:
        raise glb.fail(f"has {len(found)} inverse bind matrices for {count} joints")
    inverse = found[:count].reshape(-1, 4, 4).transpose(0, 2, 1)
    plain = np.allclose(inverse[:, 3], [0.0, 0.0, 0.0, 1.0], atol=1e-4)
    if not plain or np.abs(np.linalg.det(inverse)).min() < 1e-12:
        raise glb.fail("its inverse bind matrices cannot be inverted")
    return np.linalg.inv(inverse).astype(np.float64)


def _scale(glb: Glb, matrix: Floats) -> float:
    """[m] per unit of the mesh."""
    size = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
    if not 1e-6 < size < 1e6:
        raise glb.fail("its skin is mirrored or has no size", "apply its scale")
    return size


def _places(
    glb: Glb, nodes: Nodes, joints: list[int], bind: Floats, scale: float
) -> dict[str, Floats]:
    own = {joint: n for n, joint in enumerate(joints)}
    under = _joint_above(nodes, set(joints))
    chosen: dict[str, int] = {}
    for n, name in enumerate(nodes.names):
        if under[n] >= 0 and (name not in chosen or n in own):
            chosen[name] = n
    those = list(chosen.values())
    up = [own[under[n]] for n in those]
    inverse = np.linalg.pinv(nodes.world[joints])
    frames = bind[up] @ (inverse[up] @ nodes.world[those])
    turns, _, flips = np.linalg.svd(frames[:, :3, :3])
    places = np.tile(np.eye(4), (len(those), 1, 1))
    places[:, :3, :3] = turns @ flips
    places[:, :3, 3] = scale * frames[:, :3, 3]
    return dict(zip(chosen, places, strict=True))


def _joint_above(nodes: Nodes, joints: set[int]) -> list[int]:
    """Return the joint that each node is, or is below; -1 for none."""
    above: dict[int, int] = {joint: joint for joint in joints} | {-1: -1}
    for n in range(len(nodes.parents)):
        line = []
        while n not in above:
            line.append(n)
            n = nodes.parents[n]
        above.update(dict.fromkeys(line, above[n]))
    return [above[n] for n in range(len(nodes.parents))]


def _parts(glb: Glb) -> list[dict[str, Any]]:
    """Return the triangles that the skin moves."""
    found: list[dict[str, Any]] = []
    for node in glb.rows("nodes"):
        if "skin" in node and "mesh" in node:
            parts = glb.row("meshes", node["mesh"]).get("primitives", [])
            if not isinstance(parts, list) or not all(
                isinstance(part, dict) and isinstance(part.get("attributes"), dict)
                for part in parts
            ):
                raise glb.fail("a mesh has no list of primitives")
            found += [
                p for p in parts if p.get("mode", _TRIANGLES_MODE) == _TRIANGLES_MODE
            ]
    if not found:
        raise glb.fail("no mesh of triangles has its skin")
    if len(found) > _MOST_PARTS:
        raise glb.fail(f"its mesh has {len(found)} parts", f"at most {_MOST_PARTS}")
    return found


def _part(glb: Glb, part: dict[str, Any], joints: int) -> dict[str, Any]:
    """Return the numbers of one primitive."""
    at = part["attributes"]
    vertices = floats(glb, at.get("POSITION"), 3, "vertices")
    count = len(vertices)
    used, weights = [], []
    for n in range(4):
        if f"JOINTS_{n}" in at:
            used.append(accessor(glb, at[f"JOINTS_{n}"], 4, "joints of vertices"))
            weights.append(floats(glb, at.get(f"WEIGHTS_{n}"), 4, "weights"))
            if len(used[-1]) != count or len(weights[-1]) != count:
                raise glb.fail(f"joints and weights should be of {count} vertices")
    if not used:
        raise glb.fail("its mesh has no joints and weights", "a rigged hand is needed")
    share = np.hstack(weights)
    moved_by = np.where(share > 0.0, np.hstack(used), 0).astype(np.int64)
    if moved_by.min() < 0 or moved_by.max() >= joints:
        raise glb.fail(f"a vertex is moved by a joint that is none of its {joints}")
    total = share.sum(axis=1, keepdims=True)
    if share.min() < 0.0 or total.min() < 1e-3:
        raise glb.fail("a vertex has no weights, or negative ones")
    colors = None
    if "COLOR_0" in at:
        colors = _colors(glb, at["COLOR_0"], count)
    return {
        "vertices": vertices,
        "faces": _faces(glb, part, count),
        "joints": moved_by,
        "weights": share / total,
        "colors": colors,
    }


def _faces(glb: Glb, part: dict[str, Any], count: int) -> Ints:
    if "indices" not in part:
        flat = np.arange(count - count % 3)
    else:
        flat = accessor(glb, part["indices"], 1, "faces")[:, 0]
    if flat.dtype.kind == "f" or len(flat) % 3 or not len(flat):
        raise glb.fail("its faces are no triangles")
    faces: Ints = flat.astype(np.int64).reshape(-1, 3)
    if faces.min() < 0 or faces.max() >= count:
        right = f"its vertices are 0 to {count - 1}"
        raise glb.fail("a face names a vertex that is not there", right)
    return faces


def _colors(glb: Glb, index: Any, count: int) -> Bytes | None:
    width = 4 if glb.row("accessors", index).get("type") == "VEC4" else 3
    colors = floats(glb, index, width, "colours")
    if len(colors) != count:
        return None
    light = np.clip(colors[:, :3], 0.0, 1.0)
    return as_bytes(np.where(light > 0.0031308, _curve(light), 12.92 * light))


def _curve(light: Floats) -> Floats:
    """Colours as light is measured, in sRGB's numbers (IEC 61966-2-1)."""
    out: Floats = 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
    return out


def _padded(rows: Any, width: int) -> Any:
    return np.pad(rows, ((0, 0), (0, width - rows.shape[1])))
