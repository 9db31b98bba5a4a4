"""A joint tree with markers on it: from poses to places and their derivatives."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from handclean.arrays import Floats, Ints, expect_shape
from handclean.errors import UnknownNameError
from handclean.kernels import chain, rotations
from handclean.kernels.chain import Links
from handclean.tree import POSE_HEAD, ROOT_DOFS, JointTree


def links_of(tree: JointTree) -> Links:
    """Turn bones with any number of hinges into links with one each.

    A bone without hinges becomes part of its parent's link.
    """
    count = len(tree.hinges) + 1
    parent, axis = np.full(count, -1), np.zeros((count, 3))
    offset, carries = np.zeros((count, 3)), np.zeros((count, count), dtype=bool)
    bone_link = np.zeros(len(tree.bones), dtype=np.int64)
    bone_at = np.zeros((len(tree.bones), 3))
    axis[1:] = tree.axes
    for b in range(1, len(tree.bones)):
        up = tree.parents[b]
        link = bone_link[up]
        at = bone_at[up] + tree.offsets[b]
        for hinge in np.flatnonzero(tree.hinge_bone == b):
            parent[hinge + 1], offset[hinge + 1] = link, at
            carries[hinge + 1] = carries[link]
            carries[hinge + 1, hinge + 1] = True
            link, at = hinge + 1, np.zeros(3)
        bone_link[b], bone_at[b] = link, at
    return Links(
        parent=parent.astype(np.int64),
        offset=offset,
        axis=axis,
        carries=carries,
        bone_link=bone_link,
        bone_at=bone_at,
    )


@dataclass(frozen=True, kw_only=True)
class Model:
    """A joint tree with M named markers on its bones.

    Attributes
    ----------
    tree : what moves.
    labels : M marker names.
    bone : (M,) the bone each sits on.
    at : (M, 3) [m] places in the bones' frames.
    links : the tree as the kernels want it.
    link, link_at : (M,), (M, 3) [m] the markers' links and places in their frames.
    """

    tree: JointTree
    labels: tuple[str, ...]
    bone: Ints
    at: Floats
    links: Links = field(init=False, repr=False, compare=False)
    link: Ints = field(init=False, repr=False, compare=False)
    link_at: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        expect_shape("bone", self.bone, len(self.labels))
        expect_shape("at", self.at, len(self.labels), 3)
        links = links_of(self.tree)
        object.__setattr__(self, "links", links)
        object.__setattr__(self, "link", links.bone_link[self.bone])
        object.__setattr__(self, "link_at", self.at + links.bone_at[self.bone])

    def selected(self, labels: Sequence[str], where: str = "marker set") -> "Model":
        """Return the model with only these markers, in this order.

        Raises
        ------
        UnknownNameError
            If a label is not one of the model's.
        """
        for label in labels:
            if label not in self.labels:
                raise UnknownNameError(where, "marker", label, self.labels)
        rows = [self.labels.index(label) for label in labels]
        return replace(
            self, labels=tuple(labels), bone=self.bone[rows], at=self.at[rows]
        )


def workspace(links: Links) -> tuple[Floats, Floats, Floats]:
    """Room for `chain.place_links`: turn, origin and column of every link."""
    count = len(links.parent)
    return np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros((count, 6))


def neutral_pose(tree: JointTree) -> Floats:
    """Return the pose of the zero posture at the laboratory's origin, unturned.

    Returns
    -------
    (7 + D,) place [m], unit quaternion w, x, y, z, hinge angles [rad]
    """
    pose = np.zeros(POSE_HEAD + len(tree.hinges))
    pose[3] = 1.0
    return pose


def _places(links: Links, link: Ints, at: Floats, poses: Floats) -> Floats:
    count = len(links.parent)
    expect_shape("poses", poses, "T", POSE_HEAD + count - 1)
    out = np.zeros((len(poses), len(link), 3))
    poses = np.ascontiguousarray(poses, dtype=np.float64)
    chain.place_markers(poses, links.parent, links.offset, links.axis, link, at, out)
    return out


def marker_positions(model: Model, poses: Floats) -> Floats:
    """Compute where the markers are in each pose.

    Parameters
    ----------
    model : the hand with its M markers.
    poses : (T, 7 + D) place [m], unit quaternion w, x, y, z, hinge angles [rad].

    Returns
    -------
    (T, M, 3) [m] in the laboratory's frame

    Raises
    ------
    ShapeError
        If the poses do not fit the tree.
    """
    return _places(model.links, model.link, model.link_at, poses)


def joint_positions(tree: JointTree, poses: Floats) -> Floats:
    """Compute where the joints are in each pose.

    Parameters
    ----------
    poses : (T, 7 + D) place [m], unit quaternion w, x, y, z, hinge angles [rad].

    Returns
    -------
    (T, B, 3) [m] in the laboratory's frame, in the order of the tree's bones

    Raises
    ------
    ShapeError
        If the poses do not fit the tree.
    """
    links = links_of(tree)
    return _places(links, links.bone_link, links.bone_at, poses)


def bone_rotations(tree: JointTree, poses: Floats) -> Floats:
    """Compute how the bones are turned in each pose.

    Parameters
    ----------
    poses : (T, 7 + D) place [m], unit quaternion w, x, y, z, hinge angles [rad].

    Returns
    -------
    (T, B, 3, 3) laboratory from bone; columns are the bone's axes

    Raises
    ------
    ShapeError
        If the poses do not fit the tree.
    """
    links = links_of(tree)
    size = len(tree.bones)
    link = np.repeat(links.bone_link, 4)
    corners = np.vstack([np.zeros(3), np.eye(3)])
    at = np.tile(corners, (size, 1))
    places = _places(links, link, at, poses).reshape(len(poses), size, 4, 3)
    return np.swapaxes(places[:, :, 1:] - places[:, :, :1], 2, 3)


def jacobian(model: Model, pose: Floats) -> Floats:
    """Compute the derivative of the markers' places at one pose.

    Parameters
    ----------
    pose : (7 + D,) place [m], unit quaternion w, x, y, z, hinge angles [rad].

    Returns
    -------
    (M, 3, 6 + D) [1, m/rad]
        Columns: translation, rotation about the laboratory's axes through the root's
        origin (the pose's rotation becomes exp(omega) times itself), hinge angles.
    """
    links = model.links
    turn, origin, column = workspace(links)
    points = np.zeros((len(model.labels), 3))
    chain.place_links(
        pose, links.parent, links.offset, links.axis, turn, origin, column
    )
    chain.place_points(turn, origin, model.link, model.link_at, points)
    out = np.zeros((len(model.labels), 3, ROOT_DOFS + len(model.tree.hinges)))
    chain.marker_jacobian(points, column, model.link, links.carries, out)
    return out


def moved(pose: Floats, step: Floats) -> Floats:
    """Move a pose by a step: the counterpart of `jacobian`.

    Parameters
    ----------
    pose : (7 + D,) place [m], unit quaternion w, x, y, z, hinge angles [rad].
    step : (6 + D,) translation [m], rotation vector about the laboratory's axes [rad],
        hinge angles [rad].

    Raises
    ------
    ShapeError
        If the step does not fit the pose.
    """
    expect_shape("step", step, len(pose) - 1)
    after = pose.copy()
    after[:3] += step[:3]
    turn = np.zeros(4)
    rotations.exponential(np.ascontiguousarray(step[3:6]), turn)
    rotations.compose(turn, pose[3:7].copy(), after[3:7])
    after[POSE_HEAD:] += step[6:]
    return after
