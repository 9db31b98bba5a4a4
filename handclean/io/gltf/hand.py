"""A skinned hand of any program becomes one of ours.

The joint map says which joint is at the root of each bone. What the rig's joints mean
by their angles is not asked; all comes from where they are in the bind pose:

The hand's frame
    has its origin at the wrist and lies such that wrist and knuckles point as the
    template's do (Kabsch's rotation); the back of the hand, which the map gives, tells
    a left hand from a right one. Of a file as handclean writes it (``exact`` in the
    map) it is the wrist's own.
Fingers
    get their lengths, axes and angles from where their joints are; see
    `handclean.io.gltf.fingers`.
Skin
    is brought to the zero posture; see `handclean.io.gltf.rest_skin`.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats
from handclean.errors import UnknownNameError
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.hand.template import (
    FINGERS,
    HAND_LENGTH_M,
    template,
)
from handclean.io.gltf.fingers import (
    ASKEW_COSINE,
    finger_ends,
    hand_length,
    straightened,
)
from handclean.io.gltf.read import Glb
from handclean.io.gltf.rest_skin import rest_skin
from handclean.io.gltf.skin import SkinnedMesh, skinned_mesh
from handclean.io.gltf.skinned_map import SkinnedMap

_HAND_LENGTHS_M = (0.08, 0.30)
"""[m] shortest and longest hand that is believed (chosen)."""


@dataclass(frozen=True, kw_only=True)
class ImportedHand:
    """A hand of ours out of a skinned mesh.

    Attributes
    ----------
    subject : the hand with its skin and without markers.
    bind : (7 + D,) the mesh's own pose, as near as our hinges come to it.
    frame : (4, 4) from the hand's frame to the file's mesh [m].
    missed : [rad] the most that a segment of the bind pose points out of the plane that
        its finger's hinges allow.
    animated : whether the file has a motion besides, which is not read.
    """

    subject: Subject
    bind: Floats
    frame: Floats
    missed: float
    animated: bool = False


def import_hand(glb: Glb, joint_map: SkinnedMap) -> ImportedHand:
    """Make a hand of ours of a skinned one.

    Raises
    ------
    FileError, UnknownNameError
        If the file holds no skinned hand of these joints.
    """
    return hand_of(glb, skinned_mesh(glb), joint_map)


def hand_of(glb: Glb, mesh: SkinnedMesh, joint_map: SkinnedMap) -> ImportedHand:
    """Make a hand of ours of a skinned mesh; ``glb`` names the file in messages.

    Raises
    ------
    FileError, UnknownNameError
        If it is not a skinned hand of these joints.
    """
    frame, side = _frame(glb, mesh, joint_map)
    outside = np.linalg.inv(frame)
    inside = {name: outside @ at for name, at in mesh.places.items()}
    weights = _bone_weights(glb, mesh, joint_map)
    vertices = (mesh.vertices - frame[:3, 3]) @ frame[:3, :3]
    ends = finger_ends(glb, inside, joint_map, vertices, weights)
    length = hand_length(inside, joint_map, ends)
    if not _HAND_LENGTHS_M[0] <= length <= _HAND_LENGTHS_M[1]:
        size = f"{length:.4g} m" if length >= 1.0 else f"{1e3 * length:.4g} mm"
        wrong = f"the hand is {size} long"
        low, high = (round(1e3 * limit) for limit in _HAND_LENGTHS_M)
        right = f"glTF is in metres; a hand has {low} to {high} mm"
        raise glb.fail(wrong, right)
    tree, bind, turns, missed = straightened(glb, inside, joint_map, side, ends)
    tree = replace(tree, subject=glb.path.stem, scale=length / HAND_LENGTH_M)
    at = np.array([inside[joint_map.bones.bones[bone]][:3, 3] for bone in tree.bones])
    surface = rest_skin(glb, mesh, vertices, weights, tree, turns, at)
    model = Model(tree=tree, labels=(), bone=np.zeros(0, np.int64), at=np.zeros((0, 3)))
    subject = Subject(
        name=glb.path.stem,
        model=model,
        marker_set="",
        marker_sigma=np.zeros(0),
        errors={"bind_missed_rad": missed},
        surface=surface,
    )
    return ImportedHand(
        subject=subject,
        bind=bind,
        frame=frame,
        missed=missed,
        animated=bool(glb.rows("animations")),
    )


def _frame(glb: Glb, mesh: SkinnedMesh, joint_map: SkinnedMap) -> tuple[Floats, str]:
    """(4, 4) from the hand's frame to the mesh, and which hand it is."""
    bones = joint_map.bones.bones
    for name in (*bones.values(), *joint_map.tips.values()):
        if name not in mesh.places:
            raise UnknownNameError(glb.path, "joint", name, tuple(mesh.places))
    wrist = mesh.places[bones["hand"]]
    knuckles = [f"{finger}_proximal" for finger in FINGERS[1:]]
    there = np.array([mesh.places[bones[b]][:3, 3] for b in knuckles]) - wrist[:3, 3]
    side, back = joint_map.bones.side, None
    if joint_map.bones.back is not None:
        back = wrist[:3, :3] @ joint_map.bones.back
        across = np.cross(there.mean(axis=0), back)
        side = "left" if (there[0] - there[-1]) @ across > 0.0 else "right"
    tree = template(side)
    ours = np.array([tree.offsets[tree.bone(b)] for b in knuckles])
    left, _, right = np.linalg.svd(there.T @ ours)
    flip = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    frame = np.eye(4)
    exact = joint_map.bones.exact
    frame[:3, :3] = wrist[:3, :3] if exact else left @ flip @ right
    frame[:3, 3] = wrist[:3, 3]
    if back is not None and frame[:3, 2] @ back < ASKEW_COSINE:
        right_is = "back should point out of the back of the hand, in its joint's frame"
        raise glb.fail(f"joint map {joint_map.bones.name}: back is askew", right_is)
    return frame, side


def _bone_weights(glb: Glb, mesh: SkinnedMesh, joint_map: SkinnedMap) -> Floats:
    """(V, B) share of each bone of ours in each vertex."""
    bones = template("left").bones
    owner = {joint: bones.index(bone) for bone, joint in joint_map.bones.bones.items()}
    for bone, joints in joint_map.merged.items():
        owner.update({joint: bones.index(bone) for joint in joints})
    out = np.zeros((len(mesh.vertices), len(bones)))
    rows = np.arange(len(mesh.vertices))
    column = np.full(len(mesh.names), -1)
    for j, name in enumerate(mesh.names):
        up = name
        for _ in mesh.up:
            if up in owner or not up:
                break
            up = mesh.up.get(up, "")
        if up in owner:
            column[j] = owner[up]
        elif np.any(mesh.weights[mesh.joints == j] > 0.0):
            wrong = f"joint '{name}' moves vertices, and no bone is said to be its own"
            raise glb.fail(wrong, "list it in [merged] of the joint map")
    for k in range(mesh.joints.shape[1]):
        np.add.at(out, (rows, column[mesh.joints[:, k]]), mesh.weights[:, k])
    return out
