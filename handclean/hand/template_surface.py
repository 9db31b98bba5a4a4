"""The built-in hand's skin, on any hand of ours.

The template's skin ships as a mesh (made by `handclean.factory.sculpt`). A tree differs
from the template's by where its joints are and how its axes point. Every bone b brings
a place v of the template to

    f_b(v) = j'_b + R_b S_b (v - j_b),

j and j' its joint on both hands, S_b a stretch along the bone by its lengths' ratio and
across it by the hands' thickness, R_b the turn of its direction and its last axis. The
hand itself brings it to

    f_0(v) = D v + sum_k phi(|v - j_k|) c_k,    phi(r) = (1 - r/w)^4 (4 r/w + 1), r < w,

D a stretch by the hands' breadth, length and thickness, and c such that wrist and
knuckles come to where they are on the tree (Wendland's function; a place further than w
from them all is only stretched). A vertex goes to the mean of what its bones say, by
its weights; all agree at their joints.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.errors import UnknownNameError
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template import FINGERS, bone_frame, distal_length, template
from handclean.tree import JointTree

SHIPPED = Path(__file__).parents[1] / "data" / "template_hand.npz"

_PALM_REACH_M = 0.08
"""[m] on the template: how far (w) a knuckle's displacement takes the palm along
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Skin:
    """What ships: the left template hand's skin.

    Attributes
    ----------
    fine, coarse : the mesh and its coarse twin, for `template("left")`.
    nails : (V,) which vertices of the fine mesh lie on a nail.
    landmarks : vertex of the fine mesh of each landmark.
    """

    fine: Surface
    coarse: Surface
    nails: Bools
    landmarks: Mapping[str, int]


@cache
def shipped_skin() -> Skin:
    """Return the skin that ships; do not write into it."""
    with np.load(SHIPPED, allow_pickle=False) as file:
        own = [template("left").bone(str(name)) for name in file["bones"]]
        fine, coarse = (_surface(file, prefix, own) for prefix in ("", "coarse_"))
        names = [str(name) for name in file["landmark_names"]]
        places = [int(vertex) for vertex in file["landmarks"]]
        nails = file["nails"]
    marks = dict(zip(names, places, strict=True))
    return Skin(fine=fine, coarse=coarse, nails=nails, landmarks=marks)


def _surface(file: Mapping[str, Ints], prefix: str, own: list[int]) -> Surface:
    vertices: Floats = 1e-6 * file[f"{prefix}vertices_um"].astype(np.float64)
    return Surface(
        vertices=vertices,
        faces=file[f"{prefix}faces"].astype(np.int64),
        bones=np.array(own)[file[f"{prefix}bone"]],
        weights=file[f"{prefix}weights_1e4"] / 1e4,
    )


def template_surface(
    tree: JointTree,
    *,
    coarse: bool = False,
    plump: float = 1.0,
    tips: Mapping[str, float] | None = None,
) -> Surface:
    """Return the shipped skin fitted to a hand.

    Parameters
    ----------
    tree : a hand's, with or without forearm.
    coarse : the mesh of about 3000 vertices instead of that of about 12 000.
    plump : thickness against what the tree's size lets expect.
    tips : [m] lengths of some fingers' last segments; `distal_length` for the others.

    Raises
    ------
    UnknownNameError
        If the tree lacks a bone of the hand.
    """
    skin = shipped_skin().coarse if coarse else shipped_skin().fine
    start = template("left")
    number = np.array([_bone(tree, name) for name in start.bones])
    left = tree.mirrored() if tree.side == "right" else tree
    ends = {finger: distal_length(left, finger) for finger in FINGERS}
    ends.update(tips or {})
    told = _told(start, left, skin.vertices, ends, plump)
    vertices = np.zeros(skin.vertices.shape)
    for n in range(skin.bones.shape[1]):
        told_here = told[skin.bones[:, n], np.arange(len(vertices))]
        vertices += skin.weights[:, n : n + 1] * told_here
    surface = Surface(
        vertices=vertices,
        faces=skin.faces.copy(),
        bones=number[skin.bones],
        weights=skin.weights.copy(),
    )
    return surface.mirrored() if tree.side == "right" else surface


def landmarks(tree: JointTree) -> dict[str, int]:
    """Return the vertex of each landmark on the fine `template_surface` of any hand.

    Parameters
    ----------
    tree : of the hand.

    Returns
    -------
    vertex by the landmark's name

    Raises
    ------
    UnknownNameError
        If the tree lacks a bone of the template.
    """
    for name in template("left").bones:
        _bone(tree, name)
    return dict(shipped_skin().landmarks)


def _bone(tree: JointTree, name: str) -> int:
    if name not in tree.bones:
        where = f"joint tree of '{tree.subject or tree.kind}'"
        raise UnknownNameError(where, "bone", name, tree.bones)
    return tree.bone(name)


def _told(
    start: JointTree,
    tree: JointTree,
    vertices: Floats,
    tips: Mapping[str, float],
    plump: float,
) -> Floats:
    """(B, V, 3) [m] where each bone of the template brings (V, 3) [m], left hands."""
    own = [tree.bone(name) for name in start.bones]
    joint, target = rest_joints(start), rest_joints(tree)[own]
    thick = plump * _breadth(target, start) / _breadth(joint, start)
    out = np.zeros((len(joint), *vertices.shape))
    out[0] = _hand_told(start, joint, target, vertices, plump)
    turn = np.eye(3)
    for b, name in enumerate(start.bones[1:], start=1):
        finger = name.split("_")[0]
        frame = bone_frame(name)
        if name.endswith("distal"):
            stretch = tips[finger] / distal_length(start, finger)
            along = turn @ frame[:, 1]
        else:
            size = np.linalg.norm(joint[b + 1] - joint[b])
            reached = target[b + 1] - target[b]
            stretch = float(np.linalg.norm(reached) / size)
            along = reached / np.linalg.norm(reached)
        turn = _turn(frame[:, 1], along, _axis(start, b), _axis(tree, own[b]))
        stretched = thick * np.eye(3)
        stretched += (stretch - thick) * np.outer(frame[:, 1], frame[:, 1])
        out[b] = target[b] + (vertices - joint[b]) @ (turn @ stretched).T
    return out


def _breadth(joints: Floats, start: JointTree) -> float:
    """[m] from the index finger's knuckle to the little finger's."""
    ends = [start.bone("index_proximal"), start.bone("little_proximal")]
    return float(np.linalg.norm(joints[ends[0]] - joints[ends[1]]))


def _knuckles(start: JointTree) -> list[int]:
    return [b for b in range(1, len(start.bones)) if start.parents[b] == 0]


def _hand_told(
    start: JointTree, joint: Floats, target: Floats, vertices: Floats, plump: float
) -> Floats:
    """(V, 3) [m] where the hand itself brings places: a stretch, and a smooth rest."""
    knuckles = _knuckles(start)
    wide = _breadth(target, start) / _breadth(joint, start)
    reach = [np.linalg.norm(place[knuckles[1:]], axis=1) for place in (joint, target)]
    stretch = np.array([wide, reach[1].sum() / reach[0].sum(), plump * wide])
    centres = np.vstack([np.zeros(3), joint[knuckles]])
    rest = np.vstack([np.zeros(3), target[knuckles]]) - stretch * centres
    share = np.linalg.solve(_bump(centres, centres), rest)
    out: Floats = stretch * vertices + _bump(vertices, centres) @ share
    return out


def _bump(places: Floats, centres: Floats) -> Floats:
    """(V, N) Wendland's function of the distances of places from N centres."""
    gap = np.linalg.norm(places[:, None] - centres[None], axis=2) / _PALM_REACH_M
    out: Floats = np.maximum(1.0 - gap, 0.0) ** 4 * (4.0 * gap + 1.0)
    return out


def _axis(tree: JointTree, bone: int) -> Floats:
    """(3,) the last of a bone's axes: what it flexes about."""
    axis: Floats = tree.axes[np.flatnonzero(tree.hinge_bone == bone)[-1]]
    return axis


def _turn(along: Floats, to: Floats, axis: Floats, axis_to: Floats) -> Floats:
    """(3, 3) rotation that takes a direction to another, and an axis as near as can be.

    Both axes are taken across their directions.
    """
    pair = []
    for y, x in ((along, axis), (to, axis_to)):
        across = x - (x @ y) * y
        across /= np.linalg.norm(across)
        pair.append(np.column_stack([across, y, np.cross(across, y)]))
    out: Floats = pair[1] @ pair[0].T
    return out
