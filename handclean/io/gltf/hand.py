"""A skinned hand of any program becomes one of ours.

The joint map says which joint is at the root of each bone. What the rig's joints mean
by their angles is not asked; all comes from where they are in the bind pose:

The hand's frame
    has its origin at the wrist and lies such that wrist and knuckles point as the
    template's do (Kabsch's rotation); the back of the hand, which the map gives, tells
    a left hand from a right one. Of a file as handclean writes it (``exact`` in the
    map) it is the wrist's own.
Lengths
    are distances between joints. Knuckles stay where they are in the hand's frame.
Axes
    of the knuckles and of the thumb's base are the template's. The outer two joints of
    a finger share one axis across the finger: the map's ``flexion``, or that of the
    finger's own bend with the template's as a prior.
Bind pose
    follows: two hinges turn a finger's first segment exactly into its direction, one
    each the outer segments up to what points out of the finger's plane.

The skin is then brought to the zero posture, fingers straight and parallel, by undoing
the bones' full rotations: for each vertex the mean of its bones' transforms, by its
weights, is inverted. Joints that are merged into one bone stood still in the bind pose,
so their weights add up. At most four bones are kept, the heaviest. Vertices of one
place, which programs repeat along seams of a texture, become one.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError, UnknownNameError
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.hand.surface import MOST_BONES, Surface, is_closed, rest_joints, volume
from handclean.hand.template import (
    FINGERS,
    HAND_LENGTH,
    bone_frame,
    distal_length,
    template,
)
from handclean.io.gltf.read import Glb
from handclean.io.gltf.skin import SkinnedMesh, skinned_mesh
from handclean.io.gltf.skinned_map import SkinnedMap
from handclean.io.shared.rotations import about_line
from handclean.tree import MIRROR, POSE_HEAD, JointTree

_PRIOR_BEND = 0.3
"""[rad, about] bend at which a finger's own plane counts as much as the template's."""

_ASKEW = 0.5
"""Cosine of the angle between an axis that a map gives and one that makes sense."""

_LENGTHS = (0.08, 0.30)
"""[m] length of a hand."""


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
    ends = _ends(glb, inside, joint_map, vertices, weights)
    length = _hand_length(inside, joint_map, ends)
    if not _LENGTHS[0] <= length <= _LENGTHS[1]:
        size = f"{length:.4g} m" if length >= 1.0 else f"{1e3 * length:.4g} mm"
        wrong = f"the hand is {size} long"
        low, high = (round(1e3 * limit) for limit in _LENGTHS)
        right = f"glTF is in metres; a hand has {low} to {high} mm"
        raise glb.fail(wrong, right)
    tree, bind, turns, missed = _straightened(glb, inside, joint_map, side, ends)
    tree = replace(tree, subject=glb.path.stem, scale=length / HAND_LENGTH)
    at = np.array([inside[joint_map.bones.bones[bone]][:3, 3] for bone in tree.bones])
    surface = _surface(glb, mesh, vertices, weights, tree, turns, at)
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
    if frame[:3, 2] @ back < _ASKEW:
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


def _ends(
    glb: Glb,
    inside: dict[str, Floats],
    joint_map: SkinnedMap,
    vertices: Floats,
    weights: Floats,
) -> dict[str, Floats]:
    """(3,) [m] the end of each finger; without a tip, beyond its skin's middle."""
    bones = template("left").bones
    ends: dict[str, Floats] = {}
    for finger in FINGERS:
        if finger in joint_map.tips:
            ends[finger] = inside[joint_map.tips[finger]][:3, 3]
            continue
        share = weights[:, bones.index(f"{finger}_distal")]
        if not share.any():
            wrong = f"nothing is moved by the end of the {finger}"
            raise glb.fail(wrong, "name it in [tips] of the joint map")
        last = inside[joint_map.bones.bones[f"{finger}_distal"]][:3, 3]
        middle = share @ vertices / share.sum()
        reach = ((vertices[share > 0.5] - last) @ (middle - last)).max(initial=0.0)
        ends[finger] = last + reach * (middle - last) / np.sum((middle - last) ** 2)
    return ends


def _line(
    inside: dict[str, Floats], joint_map: SkinnedMap, end: Floats, finger: str
) -> Floats:
    """(4, 3) [m] a finger's joints and its end."""
    bones = joint_map.bones.bones
    names = [name for name in bones if name.startswith(f"{finger}_")]
    order = sorted(names, key=template("left").bones.index)
    return np.array([*(inside[bones[name]][:3, 3] for name in order), end])


def _hand_length(
    inside: dict[str, Floats], joint_map: SkinnedMap, ends: dict[str, Floats]
) -> float:
    """[m] wrist to tip of the straight middle finger, by the template's measure."""
    tree = template("left")
    knuckle = tree.bone("middle_proximal")
    ours = distal_length(tree, "middle")
    ours += float(np.linalg.norm(tree.offsets[knuckle : knuckle + 3], axis=1).sum())
    line = np.vstack([np.zeros(3), _line(inside, joint_map, ends["middle"], "middle")])
    theirs = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    return HAND_LENGTH * theirs / ours


def _straightened(
    glb: Glb,
    inside: dict[str, Floats],
    joint_map: SkinnedMap,
    side: str,
    ends: dict[str, Floats],
) -> tuple[JointTree, Floats, Floats, float]:
    """Return tree, bind pose, (B, 3, 3) full rotations, and [rad] what is missed."""
    start = template(side)
    mirror = MIRROR if side == "right" else np.ones(3)
    offsets, axes = start.offsets.copy(), start.axes.copy()
    pose = np.zeros(POSE_HEAD + len(start.hinges))
    pose[3] = 1.0
    turns, missed = np.tile(np.eye(3), (len(start.bones), 1, 1)), 0.0
    for finger in FINGERS:
        line = _line(inside, joint_map, ends[finger], finger)
        sizes = np.linalg.norm(np.diff(line, axis=0), axis=1)
        if sizes.min() < 1e-4:
            raise glb.fail(f"two joints of the {finger} are in one place")
        ways = np.diff(line, axis=0) / sizes[:, None]
        along = bone_frame(finger)[:, 1] * mirror
        own = [b for b, name in enumerate(start.bones) if name.startswith(finger)]
        offsets[own] = [line[0], sizes[0] * along, sizes[1] * along]
        first = int(np.flatnonzero(start.hinge_bone == own[0])[0])
        angles, turn = _two_hinges(axes[first : first + 2], along, ways[0])
        frames = [
            inside[joint_map.bones.bones[start.bones[b]]][:3, :3] for b in own[1:]
        ]
        axis = _flexion(
            glb, joint_map, axes[first + 2], along, ways @ turn, turn, frames
        )
        axes[first + 2 : first + 4] = axis
        pose[POSE_HEAD + first : POSE_HEAD + first + 2] = angles
        turns[own[0]] = turn
        for n in (1, 2):
            angle, out_of_plane, turn = _one_hinge(turn, axis, along, ways[n])
            pose[POSE_HEAD + first + 1 + n] = angle
            turns[own[n]] = turn
            missed = max(missed, abs(out_of_plane))
    tree = replace(start, offsets=offsets, axes=axes)
    return tree, pose, turns, missed


def _two_hinges(axes: Floats, along: Floats, way: Floats) -> tuple[Floats, Floats]:
    """(2,) [rad] by how much two hinges turn a direction into another, and (3, 3).

    Both axes are across the direction and each other, as all our finger roots' are.
    """
    swing = np.cross(axes[1], along)
    inner = np.arcsin(np.clip((way @ axes[0]) * (swing @ axes[0]), -1.0, 1.0))
    lifted = _about(axes[1], inner) @ along
    outer = _angle(axes[0], lifted, way)
    turn = _about(axes[0], outer) @ _about(axes[1], inner)
    return np.array([outer, inner]), turn


def _one_hinge(
    turn: Floats, axis: Floats, along: Floats, way: Floats
) -> tuple[float, float, Floats]:
    """[rad] flexion, [rad] what it misses, and the (3, 3) that misses nothing."""
    inner = way @ turn
    flexion = _angle(axis, along, inner)
    bent = _about(axis, flexion) @ along
    aside = np.cross(bent, inner)
    size = float(np.linalg.norm(aside))
    rest = float(np.arctan2(size, bent @ inner))
    full = turn @ _about(axis, flexion)
    if size > 1e-12:
        full = turn @ _about(aside / size, rest) @ _about(axis, flexion)
    return flexion, rest, full


def _flexion(
    glb: Glb,
    joint_map: SkinnedMap,
    prior: Floats,
    along: Floats,
    ways: Floats,
    turn: Floats,
    frames: list[Floats],
) -> Floats:
    """(3,) what the outer joints of a finger flex about, in the zero posture.

    Parameters
    ----------
    prior : (3,) the template's.
    ways : (3, 3) directions of its segments as seen by the first one.
    turn : (3, 3) of the first segment; frames : of the outer joints, in the bind pose.
    """
    if joint_map.flexion is not None:
        axis = sum(frame @ joint_map.flexion for frame in frames) @ turn
    else:
        axis = _PRIOR_BEND * prior
        for one, two in pairwise(ways):
            bend = np.cross(one, two)
            axis = axis + np.copysign(1.0, bend @ prior) * bend
    axis = axis - (axis @ along) * along
    unit: Floats = axis / max(float(np.linalg.norm(axis)), 1e-12)
    if unit @ prior < _ASKEW:
        right = "it should be the axis about which fingers bend to the palm"
        raise glb.fail(f"joint map {joint_map.bones.name}: flexion is askew", right)
    return unit


def _about(axis: Floats, angle: float) -> Floats:
    turn: Floats = about_line(axis, np.array([angle]))[0]
    return turn


def _angle(axis: Floats, one: Floats, two: Floats) -> float:
    """[rad] from one direction to the other about an axis, as seen along it."""
    flat_one, flat_two = one - (one @ axis) * axis, two - (two @ axis) * axis
    return float(np.arctan2(np.cross(flat_one, flat_two) @ axis, flat_one @ flat_two))


def _surface(
    glb: Glb,
    mesh: SkinnedMesh,
    vertices: Floats,
    weights: Floats,
    tree: JointTree,
    turns: Floats,
    at: Floats,
) -> Surface:
    """Return the skin in the zero posture."""
    _, first, place = np.unique(
        vertices, axis=0, return_index=True, return_inverse=True
    )
    faces: Ints = place.ravel()[mesh.faces]
    flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    bones, shares = _heaviest(weights[first])
    shift = at - np.einsum("bij,bj->bi", turns, rest_joints(tree))
    mean = np.einsum("vk,vkij->vij", shares, turns[bones])
    away = vertices[first] - np.einsum("vk,vki->vi", shares, shift[bones])
    if np.linalg.det(mean).min() < 1e-3:
        raise glb.fail("its bind pose folds the skin", "save it with an open hand")
    rest = np.linalg.solve(mean, away[:, :, None])[:, :, 0]
    faces = np.ascontiguousarray(faces[~flat])
    if is_closed(faces) and volume(rest, faces) < 0.0:
        raise glb.fail("its faces look inwards", "turn them round in its editor")
    try:
        return Surface(
            vertices=rest,
            faces=faces,
            bones=bones,
            weights=shares,
            colors=None if mesh.colors is None else mesh.colors[first],
        )
    except HandcleanError as error:
        raise glb.fail(error.wrong) from None


def _heaviest(weights: Floats) -> tuple[Ints, Floats]:
    """(V, 4) the bones with the largest of (V, B) shares, and these, summing to 1."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :MOST_BONES]
    shares = np.take_along_axis(weights, order, axis=1)
    shares /= shares.sum(axis=1, keepdims=True)
    return np.where(shares > 0.0, order, 0).astype(np.int64), shares
