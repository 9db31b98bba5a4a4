"""Paths of joint angles and of the root through the frames that leave them open.

Every gap of every hinge is bridged for itself and all of them at once. The root's
translation is bridged likewise, and its rotation in a chart: the rotation vector from
the last known orientation. A path that is smooth there is a motion whose angular
velocities match those at both ends.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.gaps.coupling import Coupling, couple
from handclean.gaps.cross_validation import Law, choose, fits_to_try, shape
from handclean.gaps.min_acceleration import Bridge, EndFit, bridge
from handclean.gaps.runs import Cluster, Gap, Limits, clusters_of
from handclean.kernels.rotations import product
from handclean.tree import POSE_HEAD, JointTree

SUPPORTED = 2.0
"""How much further off a path through several gaps is, whose inner velocities nothing
gives (chosen)."""

UNTRIED = Law(lengths=np.zeros(0), floor=np.zeros(0), gain=np.zeros(0))

LEAST_VARIANCE = 1e-10
"""[rad^2], [m^2] no bridge is surer than this (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Paths:
    """Poses led through the gaps of a take, and how sure they are.

    Attributes
    ----------
    poses : (T, 7 + D)
    hinge_variance : (T, D) [rad^2], 0 where a hinge is not bridged.
    root_variance : (T, 2) [m^2], [rad^2] per axis, 0 where the root is not bridged.
    clusters : of hinges (by column) and of the root (column D), refused ones too.
    """

    poses: Floats
    hinge_variance: Floats
    root_variance: Floats
    clusters: tuple[Cluster, ...]


@dataclass(frozen=True, kw_only=True)
class Tried:
    """What a take says about bridging its angles and its root: fits and laws.

    ``coupling`` is how its joints go together, if paths are to follow the others.
    """

    angles: tuple[EndFit, Law]
    places: tuple[EndFit, Law]
    coupling: Coupling | None


def try_bridging(
    poses: Floats,
    open_hinge: Bools,
    open_root: Bools,
    lost: Bools,
    limits: Limits,
    *,
    coupled: bool,
) -> Tried:
    """Ask a take how its angles and its root are best bridged.

    Parameters
    ----------
    poses : (T, 7 + D); open_hinge : (T, D); open_root : (T,)
    lost : (T, D) hinges that are neither open nor known, see `decided`.
    coupled : whether paths follow joints that are known, see `coupling`.
    """
    longest, rate = limits.longest, limits.rate
    untried = fits_to_try(rate)[0], UNTRIED
    angles, places, coupling = untried, untried, None
    if open_hinge.any():
        sure = ~(open_hinge | lost)
        angles = choose(poses[:, POSE_HEAD:], sure, longest, rate)
        if coupled:
            coupling = couple(poses[:, POSE_HEAD:], sure, longest, angles[0])
    if open_root.any():
        known = np.repeat(~open_root[:, None], 3, axis=1)
        places = choose(poses[:, :3], known, longest, rate)
    return Tried(angles=angles, places=places, coupling=coupling)


def lay_paths(
    tree: JointTree,
    solved: Floats,
    open_hinge: Bools,
    open_root: Bools,
    lost: Bools,
    limits: Limits,
    tried: Tried,
) -> Paths:
    """Bridge what is open in a take.

    Parameters
    ----------
    solved : (T, 7 + D) poses, to be kept where nothing is open.
    open_hinge : (T, D); open_root : (T,)
    lost : (T, D) hinges that are neither open nor known, see `decided`.
    """
    poses = solved.copy()
    hinge_variance, clusters = _lay_hinges(poses, open_hinge, lost, limits, tried)
    low, high = tree.limits.T
    poses[:, POSE_HEAD:] = np.clip(poses[:, POSE_HEAD:], low, high)
    root_variance, root_clusters = _lay_root(poses, open_root, limits, *tried.places)
    return Paths(
        poses=poses,
        hinge_variance=hinge_variance,
        root_variance=root_variance,
        clusters=(*clusters, *root_clusters),
    )


def _lay_hinges(
    poses: Floats, is_open: Bools, lost: Bools, limits: Limits, tried: Tried
) -> tuple[Floats, list[Cluster]]:
    """Bridge angles in place; return (T, D) variances and what was found."""
    variance = np.zeros(is_open.shape)
    angles, known = poses[:, POSE_HEAD:].copy(), ~is_open
    sure = known & ~lost
    fit, law = tried.angles
    reach = _reach(limits, fit)
    clusters: list[Cluster] = []
    for column in np.flatnonzero(is_open.any(axis=0)):
        found = clusters_of(known[:, column], limits, int(column))
        clusters += found
        here = angles[:, [column]], known[:, column], found, fit, limits
        for part in _bridges(*here, ~lost[:, column]):
            rows, path, left = slice(part.start, part.stop), part.path[:, 0], 1.0
            if tried.coupling is not None and not part.supported:
                gap = Gap(column=int(column), start=part.start, stop=part.stop)
                more, left = tried.coupling.guess(angles, sure, gap, fit, reach)
                path = path + more
            poses[rows, POSE_HEAD + column] = path
            variance[rows, column] = left * _along(part, law)
    return variance, clusters


def _reach(limits: Limits, fit: EndFit) -> int:
    """[frames] how far from the end of a gap to look for frames to fit."""
    return max(2 * limits.seed, fit.frames)


def _lay_root(
    poses: Floats, is_open: Bools, limits: Limits, fit: EndFit, law: Law
) -> tuple[Floats, list[Cluster]]:
    """Bridge the root in place; return (T, 2) variances and what was found."""
    variance, known = np.zeros((len(poses), 2)), ~is_open
    found = clusters_of(known, limits, poses.shape[1] - POSE_HEAD)
    if not found:
        return variance, []
    places, turns = poses[:, :3].copy(), poses[:, 3:POSE_HEAD].copy()
    for cluster in found:
        chart, origin = _chart(turns, known, cluster, _reach(limits, fit))
        both = np.hstack([places, chart])
        for part in _bridges(both, known, [cluster], fit, limits):
            rows = slice(part.start, part.stop)
            poses[rows, :3] = part.path[:, :3]
            turned = product(origin, quaternions(part.path[:, 3:]).T)
            poses[rows, 3:POSE_HEAD] = np.stack(turned, axis=1)
            variance[rows, 0] = _along(part, law, slice(0, 3))
            variance[rows, 1] = _along(part, UNTRIED, slice(3, 6))
    return variance, found


def _bridges(
    values: Floats,
    known: Bools,
    found: list[Cluster],
    fit: EndFit,
    limits: Limits,
    sure: Bools | None = None,
) -> list[Bridge]:
    reach = _reach(limits, fit)
    return [
        part
        for cluster in found
        if not cluster.refused
        for part in bridge(values, known, cluster, fit, reach, sure)
    ]


def _along(part: Bridge, law: Law, columns: slice = slice(None)) -> Floats:
    """(N,) variance per axis along a bridge: its law and the noise of its ends."""
    bend = part.bend[columns] * (SUPPORTED if part.supported else 1.0)
    frames = part.stop - part.start
    middle = float(np.mean(law.variance(frames, bend)))
    noise = float(np.mean(law.variance(1, np.zeros(1))))
    return np.asarray(middle * shape(frames) ** 2 + noise + LEAST_VARIANCE)


def _chart(
    turns: Floats, known: Bools, cluster: Cluster, reach: int
) -> tuple[Floats, Floats]:
    """(T, 3) [rad] known orientations near a cluster, from the last one before it.

    That one, (4,), comes with them.
    """
    vectors = np.zeros((len(turns), 3))
    first = max(cluster.start - reach, 0)
    frames = np.arange(first, min(cluster.stop + reach, len(turns)))
    frames = frames[known[frames]]
    last = int(np.searchsorted(frames, cluster.start)) - 1
    origin = turns[frames[max(last, 0)]]
    back = origin * (1.0, -1.0, -1.0, -1.0)
    between = np.stack(product(back, turns[frames].T), axis=1)
    vectors[frames] = rotation_vectors(between)
    return vectors, origin


def rotation_vectors(turns: Floats) -> Floats:
    """(N, 3) [rad] rotation vectors, at most pi long, of unit quaternions (N, 4)."""
    turns = np.where(turns[:, :1] < 0.0, -turns, turns)
    size = np.linalg.norm(turns[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(size, turns[:, :1])
    small = size < 1e-9
    scale = np.where(small, 2.0, angle / np.where(small, 1.0, size))
    return np.asarray(scale * turns[:, 1:])


def quaternions(vectors: Floats) -> Floats:
    """(N, 4) unit quaternions w, x, y, z of rotation vectors (N, 3) [rad]."""
    half = 0.5 * np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.hstack([np.cos(half), 0.5 * np.sinc(half / np.pi) * vectors])
