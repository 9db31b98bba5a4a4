"""Where the hand is, how large, and in what posture: before its shape is fitted.

Landmarks alone first: the size that fits them best out of some, in the best of some
postures; and the same for the mirrored hand, which must fit worse. Then in turn, with
landmarks and closest points (Besl and McKay 1992):

- the similarity that carries the template onto them, in closed form (Horn 1987);
- the posture, by the inverse kinematics of ``kernels.pose_fit``. Vertices are markers
  on the bone that moves them most, at the place where skinning has them just then; a
  prior of postures holds joints that points leave open, and limits are widened.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError, UsageError
from handclean.hand.model import Model, bone_rotations, joint_positions
from handclean.hand.skinning import posed
from handclean.hand.surface import Surface, rest_joints, vertex_normals
from handclean.hand.template import HAND_LENGTH_M
from handclean.kernels import bundle, pose_fit
from handclean.numerics.cloud import thinned
from handclean.numerics.procrustes import align
from handclean.numerics.rotations import rotated_back
from handclean.subject.scan.cloud import Cloud, Pairs
from handclean.subject.shape import body_of
from handclean.subject.start import first_poses, scaled
from handclean.tree import JointTree

TRIED_SIZE_RATIOS = np.exp(np.linspace(np.log(0.5), np.log(1.6), 18))
"""Sizes of hands to try, against the template's (chosen: from small children to large
men)."""

POSTURE_VERTICES = 800
"""Vertices that the posture is found from (chosen)."""

LANDMARK_SD_M, SKIN_SD_M = 0.004, 0.002
"""[m] how far the template's landmarks and skin lie from those of other hands
(chosen)."""

INDEPENDENT_POINTS = 100
"""Closest points count as so many: their neighbours are off by about the same
(chosen)."""

OUTLIER_M = 0.015
"""[m] a vertex so far from its counterpart counts little (chosen)."""

LIMIT_MARGIN_RAD, LIMIT_SD_RAD = 0.1, 0.03
"""[rad] how far beyond the template's limits a joint may go freely, and in all
(chosen)."""

MIRRORED_FIT_RATIO = 1.5
"""By what factor the mirrored hand must fit landmarks better to be called it
(chosen)."""

MOST_FIT_STEPS = 30
"""Steps of the inverse kinematics in every round, at most (chosen)."""

FIRST_REACH_M = 0.025
"""[m] how far the first closest points may be (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Template:
    """A hand to be fitted.

    Attributes
    ----------
    tree, surface : its joints and skin.
    landmarks : (N,) vertices of the landmarks in use.
    """

    tree: JointTree
    surface: Surface
    landmarks: Ints

    def sized(self, size: float) -> "Template":
        """Return the template ``size`` times as large."""
        tree, surface = self.tree, self.surface
        return replace(
            self,
            tree=replace(tree, offsets=size * tree.offsets, scale=size * tree.scale),
            surface=replace(surface, vertices=size * surface.vertices),
        )

    def mirrored(self) -> "Template":
        """Return the other hand."""
        return replace(self, tree=self.tree.mirrored(), surface=self.surface.mirrored())


@dataclass(frozen=True, kw_only=True)
class Aligned:
    """The template in the scan's frame.

    Attributes
    ----------
    template : in the size of the scan; pose : (7 + D,).
    landmark_m : [m] RMS distance of its landmarks from the scan's.
    """

    template: Template
    pose: Floats
    landmark_m: float

    def vertices(self) -> Floats:
        """(V, 3) [m] of the skin in the scan's frame."""
        out: Floats = posed(self.template.surface, self.template.tree, self.pose[None])[
            0
        ]
        return out


def to_landmarks(template: Template, places: Floats) -> Aligned:
    """Align the template with landmarks alone.

    Parameters
    ----------
    places : (N, 3) [m] of the landmarks.

    Raises
    ------
    HandcleanError
        If they are not of a hand's size.
    UsageError
        If they are clearly those of the other hand.
    """
    _expect_a_hand(template, places)
    found = _from_landmarks(template, places)
    other = _from_landmarks(template.mirrored(), places)
    if found.landmark_m > MIRRORED_FIT_RATIO * other.landmark_m:
        side, wrong = other.template.tree.side, found.template.tree.side
        raise UsageError(
            f"landmarks: they are those of a {side} hand, not of a {wrong} one "
            f"({1e3 * other.landmark_m:.1f} against {1e3 * found.landmark_m:.1f} mm); "
            f"give --side {side}"
        )
    return found


def _from_landmarks(template: Template, places: Floats) -> Aligned:
    """Find size and pose from landmarks, whatever the side."""
    surface, tree = template.surface, template.tree
    rows = template.landmarks
    bone = _leading_bones(surface, rows)
    from_joint = surface.vertices[rows] - rest_joints(tree)[bone]
    names = tuple(f"landmark {n}" for n in range(len(rows)))
    model = Model(tree=tree, labels=names, bone=bone, at=from_joint)
    seen = np.ones((1, len(rows)), dtype=bool)
    tried = []
    for size in TRIED_SIZE_RATIOS:
        poses, cost = first_poses(scaled(model, size), places[None], seen)
        tried.append((float(cost[0]), float(size), poses[0]))
    _, size, pose = min(tried, key=lambda one: one[0])
    found = Aligned(template=template.sized(size), pose=pose, landmark_m=np.inf)
    marks = Pairs(rows=rows, places=places)
    for _ in range(8):
        found = _step(found, marks, _NONE)
    return found


_NONE = Pairs(rows=np.zeros(0, dtype=np.int64), places=np.zeros((0, 3)))


def to_cloud(
    start: Aligned,
    places: Floats,
    cloud: Cloud,
    rounds: int,
    reach_m: float,
    angle_rad: float,
    progress: Callable[[int], None] = lambda _: None,
) -> Aligned:
    """Align the template with landmarks and closest points.

    Parameters
    ----------
    places : (N, 3) [m] of the landmarks.
    rounds : how often both are done in turn.
    reach_m, angle_rad : how far a point may be at the end, and how normals differ.
    progress : called with the number of every round.
    """
    found = start
    marks = Pairs(rows=start.template.landmarks, places=places)
    some = thinned(start.template.surface.vertices, POSTURE_VERTICES)
    reaches = np.geomspace(max(FIRST_REACH_M, reach_m), reach_m, rounds)
    for number, reach in enumerate(reaches):
        progress(number)
        vertices = found.vertices()
        normals = vertex_normals(vertices, found.template.surface.faces)
        pairs = cloud.pairs(vertices[some], normals[some], float(reach), angle_rad)
        found = _step(found, marks, Pairs(rows=some[pairs.rows], places=pairs.places))
    return found


def _step(now: Aligned, marks: Pairs, points: Pairs) -> Aligned:
    """Align and pose once, towards landmarks and points."""
    rows = np.concatenate([marks.rows, points.rows])
    places = np.vstack([marks.places, points.places])
    each = min(INDEPENDENT_POINTS / max(len(points.rows), 1), 1.0)
    weight = np.concatenate(
        [
            np.full(len(marks.rows), 1.0 / LANDMARK_SD_M**2),
            np.full(len(points.rows), each / SKIN_SD_M**2),
        ]
    )
    here = now.vertices()[rows]
    away2 = np.sum((here - places) ** 2, axis=1)
    robust = weight / (1.0 + away2 / OUTLIER_M**2)
    whole = align(here, places, robust, scaled=True)
    pose = now.pose.copy()
    pose[:3] = whole.apply(pose[:3])
    turn = Rotation.from_quat(pose[[4, 5, 6, 3]])
    pose[[4, 5, 6, 3]] = (Rotation.from_matrix(whole.rotation) * turn).as_quat()
    template = now.template.sized(whole.scale)
    model = riding(template, pose, rows)
    pose = _posture(model, pose, places, weight)
    moved = Aligned(template=template, pose=pose, landmark_m=0.0)
    left = moved.vertices()[marks.rows] - marks.places
    return replace(moved, landmark_m=float(np.sqrt(np.mean(np.sum(left**2, axis=1)))))


def riding(template: Template, pose: Floats, rows: Ints) -> Model:
    """Return vertices as markers on their leading bones, where the skin has them now.

    Parameters
    ----------
    pose : (7 + D,); rows : (M,) vertices.
    """
    tree, surface = template.tree, template.surface
    bone = _leading_bones(surface, rows)
    now = posed(surface, tree, pose[None])[0][rows]
    from_joint = now - joint_positions(tree, pose[None])[0][bone]
    turn = bone_rotations(tree, pose[None])[0][bone]
    at = rotated_back(turn, from_joint)
    names = tuple(f"vertex {n}" for n in range(len(rows)))
    return Model(tree=tree, labels=names, bone=bone, at=at)


def _posture(model: Model, pose: Floats, places: Floats, weight: Floats) -> Floats:
    """(7 + D,) the pose that brings markers to their places."""
    tree = model.tree
    centre, sd = relaxed(tree)
    limits = tree.limits + np.array([-LIMIT_MARGIN_RAD, LIMIT_MARGIN_RAD])
    body = body_of(model, centre, sd**-2, limits, LIMIT_SD_RAD**-2)
    out, cost = pose[None].copy(), np.zeros(1)
    pose_fit.fit_poses(
        out,
        places[None],
        weight[None],
        OUTLIER_M**-2,
        MOST_FIT_STEPS,
        body,
        bundle.make_room(body),
        cost,
    )
    found: Floats = out[0]
    return found


def relaxed(tree: JointTree) -> tuple[Floats, Floats]:
    """(D,), (D,) [rad] what posture a hand has in a scanner, and how far from it.

    Outer joints are held more: a chain of short bones between two landmarks could
    otherwise fold up where the scanned finger is shorter than the template's.
    """
    centre, sd = np.zeros(len(tree.hinges)), np.full(len(tree.hinges), 0.5)
    for d, name in enumerate(tree.hinges):
        if name.endswith("_flexion") and not name.startswith("wrist"):
            centre[d] = np.radians(12.0)
        if name.endswith(("_dip_flexion", "thumb_ip_flexion")):
            sd[d] = 0.2
        if name.endswith("_mcp_abduction"):
            sd[d] = 0.25
    return centre, sd


def _leading_bones(surface: Surface, rows: Ints) -> Ints:
    """(M,) the bone of the largest weight of each vertex."""
    first = surface.weights[rows].argmax(axis=1)
    return np.take_along_axis(surface.bones[rows], first[:, None], axis=1)[:, 0]


def _expect_a_hand(template: Template, places: Floats) -> None:
    """Compare how far landmarks spread with how far the template's do."""
    own = template.surface.vertices[template.landmarks]
    ratio = _spread(places) / _spread(own)
    if 0.35 < ratio < 2.0:
        return
    power = 10.0 ** np.round(np.log10(max(ratio, 1e-12)))
    what = f"the landmarks span a hand about {1e3 * ratio * HAND_LENGTH_M:.3g} mm long"
    if power >= 10 or power <= 0.1:
        factor = power if power > 1 else 1 / power
        much = "large" if power > 1 else "small"
        what += f", some {factor:g} times too {much}; is the unit right (--unit)?"
    else:
        what += "; hands of 90 to 300 mm are known; are the landmarks named right?"
    raise HandcleanError(f"landmarks: {what}")


def _spread(points: Floats) -> float:
    """[m] root mean square distance from the centre."""
    return float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))
