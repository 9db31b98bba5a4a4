"""Lengths, axes and angles of the fingers of a skinned hand, from its bind pose.

Lengths
    are distances between joints. Knuckles stay where they are in the hand's frame.
Axes
    of the knuckles and of the thumb's base are the template's. The outer two joints of
    a finger share one axis across the finger: the map's ``flexion``, or that of the
    finger's own bend with the template's as a prior.
Bind pose
    follows: two hinges turn a finger's first segment exactly into its direction, one
    each the outer segments up to what points out of the finger's plane.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from handclean.arrays import Floats
from handclean.hand.template import (
    FINGERS,
    HAND_LENGTH_M,
    bone_frame,
    distal_length,
    template,
)
from handclean.io.gltf.read import Glb
from handclean.io.gltf.skinned_map import SkinnedMap
from handclean.io.shared.rotations import about_line
from handclean.tree import MIRROR, POSE_HEAD, JointTree

_PRIOR_BEND_RAD = 0.3
"""[rad, about] bend at which a finger's own plane counts as much as the template's
(chosen)."""

ASKEW_COSINE = 0.5
"""Cosine of the angle between an axis that a map gives and one that makes sense
(chosen)."""


def finger_ends(
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


def hand_length(
    inside: dict[str, Floats], joint_map: SkinnedMap, ends: dict[str, Floats]
) -> float:
    """[m] wrist to tip of the straight middle finger, by the template's measure."""
    tree = template("left")
    knuckle = tree.bone("middle_proximal")
    ours = distal_length(tree, "middle")
    ours += float(np.linalg.norm(tree.offsets[knuckle : knuckle + 3], axis=1).sum())
    line = np.vstack([np.zeros(3), _line(inside, joint_map, ends["middle"], "middle")])
    theirs = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    return HAND_LENGTH_M * theirs / ours


def straightened(
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
        axis = _PRIOR_BEND_RAD * prior
        for one, two in pairwise(ways):
            bend = np.cross(one, two)
            axis = axis + np.copysign(1.0, bend @ prior) * bend
    axis = axis - (axis @ along) * along
    unit: Floats = axis / max(float(np.linalg.norm(axis)), 1e-12)
    if unit @ prior < ASKEW_COSINE:
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
