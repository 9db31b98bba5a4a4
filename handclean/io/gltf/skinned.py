"""Hands with their skins and motion in one glTF file (.glb).

The scene
    A node ``laboratory`` turns the take's up axis into y, as glTF wants it; below it
    are the bones, named as the joints of the tree (as in our BVH files) with one more
    node at each finger's end (``thumb_tip``). All bones' frames are parallel in the
    zero posture, so that nodes have no rest rotations, and lengths are in metres. Of
    several motions the names begin with ``MOTION_``.
The skin
    is a mesh in the zero posture with at most four bones a vertex, smooth normals, and
    colours where they are known (glTF wants them as light is measured, so 8 bits of
    sRGB become 16 bits linear).
The motion
    is one animation: a rotation for every bone with hinges, translation and rotation
    of the root, a key for every frame from time 0, to be interpolated linearly.
    Quaternions do not change their sign from frame to frame. Frames that are not
    trusted move like the others; the animation's ``extras`` list them,
    ``{"first_frame": 1, "not_trusted": {"right": [[501, 900]]}}``: by motion, first and
    last frame of each run as the take numbers them, and the number of the frame at
    time 0. (Files without that number are older; they count keys from 0 and leave the
    last one out.)
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bytes, Floats, expect_shape
from handclean.hand.surface import Surface, rest_joints, vertex_normals
from handclean.hand.template import FINGERS, bone_frame, distal_length
from handclean.io.gltf.block import INDICES, VERTICES, Block, write_file
from handclean.kernels.rotations import product
from handclean.tree import MIRROR, POSE_HEAD, JointTree

_SQRT_HALF = float(np.sqrt(0.5))
"""Cosine and sine of 45 degrees, in the quaternion of a quarter turn."""


_TO_Y = {
    "+x": (0.0, 0.0, _SQRT_HALF, _SQRT_HALF),
    "-x": (0.0, 0.0, -_SQRT_HALF, _SQRT_HALF),
    "+y": (0.0, 0.0, 0.0, 1.0),
    "-y": (1.0, 0.0, 0.0, 0.0),
    "+z": (-_SQRT_HALF, 0.0, 0.0, _SQRT_HALF),
    "-z": (_SQRT_HALF, 0.0, 0.0, _SQRT_HALF),
}
"""Rotations x, y, z, w that bring an axis to y."""


_SKIN_COLOR = (0.80, 0.56, 0.45, 1.0)
"""Colour (red, green, blue, opacity) of a hand whose own is not known (chosen)."""


@dataclass(frozen=True, kw_only=True)
class SkinnedHand:
    """What one hand, or one thing, brings into a file.

    Attributes
    ----------
    name : prefix of its nodes, or "".
    tree : its bones.
    surface : its skin in the zero posture, or None.
    poses : (T, 7 + D), finite, in the order of the tree's hinges; one row for a hand
        that does not move.
    doubt : number of the first and of the last frame of each run that is not trusted.
    """

    name: str
    tree: JointTree
    surface: Surface | None
    poses: Floats
    doubt: tuple[tuple[int, int], ...] = ()


def write_hands(
    path: Path,
    hands: list[SkinnedHand],
    *,
    rate: float | None,
    up_axis: str,
    first_frame: int = 1,
) -> None:
    """Write hands into one file.

    Parameters
    ----------
    rate : [Hz] of their poses, None for hands that do not move.
    up_axis : of their laboratory; z if it is not known.
    first_frame : number of the first of their poses.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    block = Block()
    turn = _TO_Y.get(up_axis, _TO_Y["+z"])
    root: dict[str, Any] = {"name": "laboratory", "rotation": turn, "children": []}
    nodes, meshes, skins = [root], list[dict[str, Any]](), list[dict[str, Any]]()
    materials: list[dict[str, Any]] = []
    times, tracks = None, _Tracks()
    if rate is not None:
        at = np.arange(len(hands[0].poses)) / rate
        times = block.add(at, "<f4", ranged=True)
    scene = [0]
    for hand in hands:
        start = len(nodes)
        root["children"].append(start)
        turns = bone_quaternions(hand.tree, hand.poses)
        nodes += _bone_nodes(hand, turns, start)
        if times is not None:
            tracks.add(block, times, hand, turns, start)
        if hand.surface is not None:
            scene.append(len(nodes))
            nodes.append(
                {"name": f"{hand.name}skin", "mesh": len(meshes), "skin": len(skins)}
            )
            meshes.append(_mesh(block, hand.name, hand.surface, len(materials)))
            materials.append(_material(hand.surface.colors))
            skins.append(_skin(block, hand.tree, start))
    tree: dict[str, Any] = {
        "scene": 0,
        "scenes": [{"nodes": scene}],
        "nodes": nodes,
        "meshes": meshes,
        "skins": skins,
        "materials": materials,
    }
    if tracks.channels:
        animation: dict[str, Any] = {
            "name": "motion",
            "channels": tracks.channels,
            "samplers": tracks.samplers,
        }
        if doubt := {_motion_name(hand): hand.doubt for hand in hands if hand.doubt}:
            animation["extras"] = {"first_frame": first_frame, "not_trusted": doubt}
        tree["animations"] = [animation]
    write_file(path, {key: value for key, value in tree.items() if value != []}, block)


def _motion_name(hand: SkinnedHand) -> str:
    return hand.name.removesuffix("_") or hand.tree.side or hand.tree.kind


def bone_quaternions(tree: JointTree, poses: Floats) -> Floats:
    """(B, T, 4) rotation x, y, z, w of each bone in its parent, the root in the lab.

    Parameters
    ----------
    poses : (T, 7 + D), finite.
    """
    expect_shape("poses", poses, "T", POSE_HEAD + len(tree.hinges))
    out = np.zeros((len(tree.bones), len(poses), 4))
    out[:, :, 0] = 1.0
    root = poses[:, 3:POSE_HEAD] / np.linalg.norm(poses[:, 3:7], axis=1, keepdims=True)
    out[0] = _steady(root)
    for hinge, (bone, axis) in enumerate(zip(tree.hinge_bone, tree.axes, strict=True)):
        half = 0.5 * poses[:, POSE_HEAD + hinge]
        step = np.column_stack([np.cos(half), np.sin(half)[:, None] * axis])
        out[bone] = np.column_stack(product(out[bone].T, step.T))
    return out[:, :, [1, 2, 3, 0]]


def _steady(turns: Floats) -> Floats:
    """(T, 4) quaternions with the signs that make each the nearer to the one before."""
    near = np.where(np.sum(turns[1:] * turns[:-1], axis=1) < 0.0, -1.0, 1.0)
    out: Floats = turns * np.cumprod(np.concatenate([[1.0], near]))[:, None]
    return out


def _bone_nodes(hand: SkinnedHand, turns: Floats, start: int) -> list[dict[str, Any]]:
    """Nodes of a hand's bones as they are in its first pose, then of its tips."""
    tree, nodes = hand.tree, list[dict[str, Any]]()
    shift = tree.offsets.copy()
    shift[0] = hand.poses[0, :3]
    for b, joint in enumerate(tree.joints):
        nodes.append(
            {
                "name": hand.name + joint,
                "translation": shift[b].tolist(),
                "rotation": turns[b, 0].tolist(),
            }
        )
        if b:
            _hang(nodes, int(tree.parents[b]), start + b)
    for b, bone in enumerate(tree.bones):
        finger, _, segment = bone.partition("_")
        if tree.kind == "hand" and segment == "distal" and finger in FINGERS:
            along = bone_frame(finger)[:, 1]
            along = along * (MIRROR if tree.side == "right" else 1.0)
            _hang(nodes, b, start + len(nodes))
            place = distal_length(tree, finger) * along
            name = f"{hand.name}{finger}_tip"
            nodes.append({"name": name, "translation": place.tolist()})
    return nodes


def _hang(nodes: list[dict[str, Any]], parent: int, child: int) -> None:
    nodes[parent].setdefault("children", []).append(child)


def _mesh(block: Block, name: str, surface: Surface, material: int) -> dict[str, Any]:
    normals = vertex_normals(surface.vertices, surface.faces)
    normals[~normals.any(axis=1)] = [0.0, 0.0, 1.0]
    shares = surface.weights.astype(np.float32)
    shares[:, 0] += (1.0 - shares.sum(axis=1, dtype=np.float64)).astype(np.float32)
    moved_by = np.where(shares > 0.0, surface.bones, 0)
    whole = "<u2" if len(surface.vertices) < 2**16 else "<u4"
    at = {
        "POSITION": block.add(surface.vertices, "<f4", target=VERTICES, ranged=True),
        "NORMAL": block.add(normals, "<f4", target=VERTICES),
        "JOINTS_0": block.add(moved_by, "u1", target=VERTICES),
        "WEIGHTS_0": block.add(shares, "<f4", target=VERTICES),
    }
    if surface.colors is not None:
        light = _light(surface.colors)
        at["COLOR_0"] = block.add(light, "<u2", target=VERTICES, shares=True)
    part = {
        "attributes": at,
        "indices": block.add(surface.faces.ravel(), whole, target=INDICES),
        "material": material,
    }
    return {"name": f"{name}skin", "primitives": [part]}


def _light(colors: Bytes) -> Floats:
    """(V, 4) colours as light is measured, of 65535, opaque."""
    share = colors / 255.0
    bright = ((share + 0.055) / 1.055) ** 2.4
    out = np.full((len(colors), 4), 65535.0)
    out[:, :3] = np.rint(65535.0 * np.where(share > 0.04045, bright, share / 12.92))
    return out


def _material(colors: Bytes | None) -> dict[str, Any]:
    color = _SKIN_COLOR if colors is None else (1.0, 1.0, 1.0, 1.0)
    about = {"baseColorFactor": color, "metallicFactor": 0.0, "roughnessFactor": 0.7}
    return {"name": "skin", "pbrMetallicRoughness": about}


def _skin(block: Block, tree: JointTree, start: int) -> dict[str, Any]:
    inverse = np.tile(np.eye(4), (len(tree.bones), 1, 1))
    inverse[:, 3, :3] = -rest_joints(tree)  # transposed: glTF lists columns
    return {
        "inverseBindMatrices": block.add(inverse.reshape(-1, 16), "<f4"),
        "skeleton": start,
        "joints": [start + b for b in range(len(tree.bones))],
    }


class _Tracks:
    """What moves which node."""

    def __init__(self) -> None:
        self.channels: list[dict[str, Any]] = []
        self.samplers: list[dict[str, Any]] = []

    def add(
        self, block: Block, times: int, hand: SkinnedHand, turns: Floats, start: int
    ) -> None:
        """Add a hand's motion."""
        self._one(block, times, start, "translation", hand.poses[:, :3])
        for b in range(len(hand.tree.bones)):
            if b == 0 or np.any(hand.tree.hinge_bone == b):
                self._one(block, times, start + b, "rotation", turns[b])

    def _one(
        self, block: Block, times: int, node: int, path: str, values: Floats
    ) -> None:
        target = {"node": node, "path": path}
        self.channels.append({"sampler": len(self.samplers), "target": target})
        self.samplers.append({"input": times, "output": block.add(values, "<f4")})
