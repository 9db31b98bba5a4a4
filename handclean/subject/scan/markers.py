"""Where on a scanned skin markers sit, from a take of the hand held still.

**Where they should be.** A marker of the set lies over a point of the template's skin,
so far out along its normal; there, and so far out, it lies on the scanned skin, which
is the same mesh. Template and hand are compared with fingers a little spread, so that a
marker does not come to lie on the neighbour.

**Where they are.** A neutral take alone cannot tell a marker glued on elsewhere from a
joint bent a little: every posture explains it by other places. What is known: markers
are glued on to some millimetres along the skin, but lie all about as far out of it, as
they are of one size. So the pose of each frame minimises, with r a marker's distance
from where it should be and n the normal there,

    sum_m (n.r - c)^2 / out^2 + |r - n (n.r)|^2 / along^2  +  prior of postures,

c being the median of n.r, which is what the set's places err in their height. It is
found by inverse kinematics towards targets in which the distance along the skin counts
for (out / along)^2 of itself: that has the same stationary points.

Then each marker's place is the mean of where it was measured, in the frame of its bone,
and its height that over the skin (`skinning.project`). Takes that move decide the rest
(`locate_markers`).
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats
from handclean.errors import HandcleanError, UsageError
from handclean.hand.marker_set import MarkerSet
from handclean.hand.model import (
    Model,
    bone_rotations,
    joint_positions,
    marker_positions,
    neutral_pose,
)
from handclean.hand.skinning import OnSkin, lifted, posed, project
from handclean.hand.subject import Subject
from handclean.hand.surface import Surface, vertex_normals
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.kernels import bundle, pose_fit
from handclean.numerics.rotations import rotated, rotated_back
from handclean.remarks import Remark, remark
from handclean.subject.frames import Frames, thinned
from handclean.subject.shape import PosePrior
from handclean.subject.start import first_poses
from handclean.tree import POSE_HEAD, JointTree

OUTWARD_SD_M, ALONG_SD_M = 0.0015, 0.005
"""[m] how far markers may lie from where they should, out of the skin and along it
(chosen)."""

NEUTRAL_POSTURE_SD_RAD = 0.35
"""[rad] how far a neutral posture is from the flat hand (chosen)."""

NEUTRAL_FRAMES = 12
"""Frames that places are found from, at most (chosen)."""

MOST_ROUNDS = 30
"""Rounds of inverse kinematics and median height, at most (chosen)."""

OUTLIER_M = 0.03
"""[m] a marker so far from where it should be counts little (chosen)."""

COMPARED_ABDUCTION_DEG = {"index": 10.0, "middle": 1.0, "ring": -8.0, "little": -16.0}
"""[degrees] abduction in which template and hand are compared (chosen)."""

USUAL_HEIGHTS_M = (-0.002, 0.025)
"""[m] markers lower or higher over the skin than this are named (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Markers on a scanned hand.

    Attributes
    ----------
    model : the hand with them.
    on : where on the skin each sits; those on a forearm have face -1.
    poses : (T, 7 + D) of the frames used.
    rms_m : [m] RMS distance of markers from these places in those frames.
    start_rms_m : [m] the same of the places they should have.
    remarks : what is odd.
    """

    model: Model
    on: OnSkin
    poses: Floats
    rms_m: float
    start_rms_m: float
    remarks: tuple[Remark, ...]


def with_forearm(tree: JointTree, forearm: bool) -> JointTree:
    """Hang a forearm on a hand that has none, if one is wanted."""
    if not forearm or "forearm" in tree.bones:
        return tree
    longer = template(tree.side, forearm=True)
    extra = len(longer.hinges) - len(template(tree.side).hinges)
    return replace(
        tree,
        bones=(*tree.bones, longer.bones[-1]),
        joints=(*tree.joints, longer.joints[-1]),
        parents=np.append(tree.parents, 0),
        offsets=np.vstack([tree.offsets, np.zeros(3)]),
        hinges=(*tree.hinges, *longer.hinges[-extra:]),
        hinge_bone=np.append(tree.hinge_bone, [len(tree.bones)] * extra),
        axes=np.vstack([tree.axes, longer.axes[-extra:]]),
        limits=np.vstack([tree.limits, longer.limits[-extra:]]),
    )


def put_on_skin(subject: Subject, marker_set: MarkerSet) -> tuple[Model, Floats]:
    """Put a marker set on a scanned hand.

    Returns
    -------
    The hand with the markers where they should be, and the skin's normals there,
    (M, 3) in the bones' frames; zero on a forearm.

    Raises
    ------
    UsageError
        If the subject has no skin, or the set is not one for hands.
    """
    if subject.surface is None:
        raise UsageError(
            f"--subject: '{subject.name}' has no skin; 'calibrate-hand scan' makes one "
            "that has"
        )
    if marker_set.kind != "hand":
        raise UsageError(f"marker set {marker_set.name}: is of no hand")
    side = subject.model.tree.side
    tree = with_forearm(subject.model.tree, marker_set.forearm)
    plain = marker_set.on(tree)
    rows = np.array([tree.bones[b] != "forearm" for b in plain.bone])
    start = marker_set.on(template(side, forearm=marker_set.forearm))
    skin = template_surface(start.tree)
    at, normals = plain.at.copy(), np.zeros(plain.at.shape)
    pose = _spread(tree)
    vertices = posed(subject.surface, tree, pose[None])[0]
    there = marker_positions(plain, pose[None])[0][rows]
    if np.array_equal(skin.faces, subject.surface.faces):
        before = posed(skin, start.tree, _spread(start.tree)[None])[0]
        meant = marker_positions(start, _spread(start.tree)[None])[0][rows]
        on = project(skin, before, meant)
        there = lifted(vertices, skin.faces, on)
    bone = plain.bone[rows]
    turn = bone_rotations(tree, pose[None])[0][bone]
    joint = joint_positions(tree, pose[None])[0][bone]
    at[rows] = rotated_back(turn, there - joint)
    on = project(subject.surface, vertices, there)
    out = _normals(subject.surface, vertices, on)
    normals[rows] = rotated_back(turn, out)
    return replace(plain, at=at), normals


def _spread(tree: JointTree) -> Floats:
    pose = neutral_pose(tree)
    for finger, degrees in COMPARED_ABDUCTION_DEG.items():
        hinge = tree.hinges.index(f"{finger}_mcp_abduction")
        pose[POSE_HEAD + hinge] = np.radians(degrees)
    return pose


def _normals(surface: Surface, vertices: Floats, on: OnSkin) -> Floats:
    """(M, 3) unit normals of the skin under markers."""
    corners = vertex_normals(vertices, surface.faces)[surface.faces[on.face]]
    out = np.einsum("mk,mkn->mn", on.share, corners)
    unit: Floats = out / np.linalg.norm(out, axis=1, keepdims=True)
    return unit


def place(subject: Subject, marker_set: MarkerSet, neutral: Frames) -> Placed:
    """Find where on a scanned hand markers sit.

    Parameters
    ----------
    subject : with a skin.
    neutral : frames of the hand held still, flat, about as in the scan.

    Raises
    ------
    HandcleanError
        If a marker is in none of the frames, or there are too few of them.
    UsageError
        As `put_on_skin`.
    """
    model, normals = put_on_skin(subject, marker_set)
    assert subject.surface is not None
    frames = neutral.only(thinned(neutral, NEUTRAL_FRAMES))
    unseen = [
        label for m, label in enumerate(model.labels) if not frames.seen[:, m].any()
    ]
    if unseen:
        raise HandcleanError(
            f"calibrate-hand: {unseen[0]} is not in the neutral take; every marker "
            "should be seen there"
        )
    poses = _poses(model, normals, frames)
    start = _rms(model, poses, frames)
    found = replace(model, at=_measured_places(model, poses, frames))
    on, remarks = _on_skin(subject.surface, found)
    return Placed(
        model=found,
        on=on,
        poses=poses,
        rms_m=_rms(found, poses, frames),
        start_rms_m=start,
        remarks=remarks,
    )


def _poses(model: Model, normals: Floats, frames: Frames) -> Floats:
    """(T, 7 + D) poses that the height over the skin decides more than places on it."""
    expected = PosePrior(
        centre=np.zeros(len(model.tree.hinges)),
        hold=NEUTRAL_POSTURE_SD_RAD**-2,
        limits=model.tree.limits,
        bound=0.1**-2,
    )
    body = expected.body(model)
    room, cost = bundle.make_room(body), np.zeros(len(frames))
    poses, _ = first_poses(model, frames.targets, frames.seen)
    weights = frames.seen / OUTWARD_SD_M**2
    little = (OUTWARD_SD_M / ALONG_SD_M) ** 2
    for _ in range(MOST_ROUNDS):
        here = marker_positions(model, poses)
        turn = bone_rotations(model.tree, poses)[:, model.bone]
        out = rotated(turn, normals)
        off = np.where(frames.seen[:, :, None], frames.targets - here, 0.0)
        high = np.einsum("tmi,tmi->tm", off, out)
        known = frames.seen & np.any(normals != 0.0, axis=1)
        common = np.median(high[known])
        lift = np.where(known, high - common, 0.0)
        along = off - high[:, :, None] * out
        targets = here + lift[:, :, None] * out + little * along
        before = poses.copy()
        pose_fit.fit_poses(poses, targets, weights, OUTLIER_M**-2, 20, body, room, cost)
        if np.abs(poses - before).max() < 1e-5:
            break
    return poses


def _measured_places(model: Model, poses: Floats, frames: Frames) -> Floats:
    """(M, 3) [m] mean places of the measured markers in their bones' frames."""
    turn = bone_rotations(model.tree, poses)[:, model.bone]
    joint = joint_positions(model.tree, poses)[:, model.bone]
    at = rotated_back(turn, frames.targets - joint)
    seen = frames.seen[:, :, None]
    mean: Floats = np.sum(np.where(seen, at, 0.0), axis=0) / seen.sum(axis=0)
    return mean


def _rms(model: Model, poses: Floats, frames: Frames) -> float:
    """[m] RMS distance of measured markers from the model's."""
    away = np.linalg.norm(frames.targets - marker_positions(model, poses), axis=2)
    return float(np.sqrt(np.mean(away[frames.seen] ** 2)))


def _on_skin(surface: Surface, model: Model) -> tuple[OnSkin, tuple[Remark, ...]]:
    """Find where on the skin the model's markers sit, and say what is odd."""
    tree = model.tree
    pose = _spread(tree)
    vertices = posed(surface, tree, pose[None])[0]
    on = project(surface, vertices, marker_positions(model, pose[None])[0])
    arm = np.array([tree.bones[b] == "forearm" for b in model.bone])
    remarks: list[Remark] = []
    for m, label in enumerate(model.labels):
        if not arm[m] and not USUAL_HEIGHTS_M[0] <= on.lift[m] <= USUAL_HEIGHTS_M[1]:
            remarks.append(
                remark(
                    "fit",
                    f"{label} lies {1e3 * on.lift[m]:.0f} mm over the scanned skin: is "
                    "it labelled right, and are scan and take of the same hand?",
                    marker=label,
                )
            )
    return replace(on, face=np.where(arm, -1, on.face)), tuple(remarks)
