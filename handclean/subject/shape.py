"""What calibration may change about a hand, as one vector, and what it expects of it.

The N numbers of a shape, in this order:

- the offset of every joint but the root's in its parent's frame (3 each) [m];
- the tilt of every hinge axis about two tangents (2 each) [rad];
- the place of every marker in its bone's frame (3 each) [m];
- the size of the hand, lengthwise and across, against the expected one (2).

The expectation (prior) is a template of estimated size. Offsets and places of such a
template do not err independently: a hand 5 % longer has every bone 5 % longer. Hence
the two sizes, which no marker sees and which only shift what is expected of the rest:

    offset_b ~ sizes o expected_b + noise,     place_m ~ sizes o expected_m + noise

Zero angles, the root's place and the points along an axis at which a joint is drawn
are not decided by markers at all; there the expectation alone speaks, and so the zero
posture keeps its meaning: flat hand, fingers straight and parallel.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.model import Model
from handclean.kernels.bundle import Body, PoseBounds
from handclean.kernels.shape import Packing
from handclean.tree import ROOT_DOFS

SIZE_NUMBERS = 2
"""Numbers at the end of a shape: the size lengthwise and across the hand."""


@dataclass(frozen=True, kw_only=True)
class Expectation:
    """How far, one standard deviation, a hand may differ from its template.

    Attributes
    ----------
    length : of a bone's length, relative.
    joint_m : [m] of a joint across the bone that leads to it.
    knuckle_m : [m] of a finger's first joint in the hand, each way.
    tilt_rad : [rad] of a hinge axis.
    thumb_tilt_rad : [rad] the same, of the thumb and the wrist.
    place_m : [m] of a marker, each way.
    size : of the hand's length and breadth, relative.
    """

    length: float = 0.06
    joint_m: float = 0.0015
    knuckle_m: float = 0.004
    tilt_rad: float = 0.08
    thumb_tilt_rad: float = 0.20
    place_m: float = 0.005
    size: float = 0.10


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A hand under adjustment: the model and its size against the expected one."""

    model: Model
    sizes: Floats

    def stepped(self, step: Floats) -> "Shape":
        """Return the shape after a step (N,) in the order of the module's list."""
        tree = self.model.tree
        bones, hinges = len(tree.bones), len(tree.hinges)
        parts = np.split(step, np.cumsum(sections(self.model))[:-1])
        offsets = tree.offsets.copy()
        offsets[1:] += parts[0].reshape(bones - 1, 3)
        tilt = np.einsum("dik,dk->di", tangents(tree.axes), parts[1].reshape(hinges, 2))
        axes = tilted(tree.axes, tilt)
        model = replace(
            self.model,
            tree=replace(tree, offsets=offsets, axes=axes),
            at=self.model.at + parts[2].reshape(-1, 3),
        )
        return Shape(model=model, sizes=self.sizes + parts[3])


def sections(model: Model) -> tuple[int, int, int, int]:
    """How many numbers of a shape are offsets, tilts, places and sizes."""
    tree = model.tree
    return (
        3 * len(tree.bones) - 3,
        2 * len(tree.hinges),
        3 * len(model.labels),
        SIZE_NUMBERS,
    )


def tangents(axes: Floats) -> Floats:
    """(D, 3, 2) two unit vectors across each of (D, 3) axes and each other."""
    helper = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    first = np.cross(axes, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(axes, first)], axis=2)


def tilted(axes: Floats, tilt: Floats) -> Floats:
    """(D, 3) axes turned by rotation vectors (D, 3) across them."""
    angle = np.linalg.norm(tilt, axis=1, keepdims=True)
    out = np.cos(angle) * axes + np.sinc(angle / np.pi) * np.cross(tilt, axes)
    unit: Floats = out / np.linalg.norm(out, axis=1, keepdims=True)
    return unit


def _padded(rows: list[list[int]]) -> Ints:
    width = max([len(row) for row in rows] + [1])
    return np.array([row + [-1] * (width - len(row)) for row in rows], dtype=np.int64)


def body_of(
    model: Model, centre: Floats, hold: Floats, limits: Floats, bound: float
) -> Body:
    """Return the model as the bundle kernels want it.

    Parameters
    ----------
    centre, hold : (D,) [rad], [1/rad^2] where hinges are held, and how strongly.
    limits, bound : (D, 2) [rad], [1/rad^2] where they are held back, how strongly.
    """
    tree, links = model.tree, model.links
    hinges_at, places_at, _ = np.cumsum(sections(model))[:3]
    joint_up, turns, joint_column, turn_column = [], [], [], []
    for bone in model.bone:
        joints: list[int] = []
        while bone > 0:
            joints.append(int(bone))
            bone = tree.parents[bone]
        hinges = [h for b in joints for h in np.flatnonzero(tree.hinge_bone == b)]
        joint_up.append([int(links.bone_link[tree.parents[b]]) for b in joints])
        joint_column.append([3 * (b - 1) + n for b in joints for n in range(3)])
        turns.append([int(h) + 1 for h in hinges])
        turn_column.append([hinges_at + 2 * int(h) + n for h in hinges for n in (0, 1)])
    markers = np.arange(len(model.labels))[:, None]
    column = np.hstack(
        [
            places_at + 3 * markers + np.arange(3),
            _widened(joint_column, 3 * _padded(joint_up).shape[1]),
            _widened(turn_column, 2 * _padded(turns).shape[1]),
        ]
    )
    across = np.zeros((len(links.parent), 3, 2))
    across[1:] = tangents(tree.axes)
    return Body(
        links=links,
        link=model.link,
        at=model.link_at,
        packing=Packing(
            tangents=across,
            joint_up=_padded(joint_up),
            hinges=_padded(turns),
            column=column.astype(np.int64),
        ),
        prior=PoseBounds(centre=centre, hold=hold, limits=limits, bound=bound),
    )


def _widened(rows: list[list[int]], width: int) -> Ints:
    return np.array([row + [-1] * (width - len(row)) for row in rows], dtype=np.int64)


@dataclass(frozen=True, kw_only=True)
class PosePrior:
    """What is expected of postures.

    Attributes
    ----------
    centre, hold : (D,) [rad], [1/rad^2] where hinges are held, and how strongly.
    limits, bound : (D, 2) [rad], [1/rad^2] beyond what they are held back, and how.
    """

    centre: Floats
    hold: float
    limits: Floats
    bound: float

    def times(self, factor: float) -> "PosePrior":
        """Return the same expectation, ``factor`` times as strong."""
        return replace(self, hold=factor * self.hold, bound=factor * self.bound)

    def body(self, model: Model) -> Body:
        """Return the model with this expectation, for the bundle kernels."""
        hold = np.full(len(self.centre), self.hold)
        return body_of(model, self.centre, hold, self.limits, self.bound)


def expected_offsets(model: Model, sizes: Floats) -> tuple[Floats, Floats]:
    """Offsets of the joints beyond the root on a template of other sizes.

    Returns
    -------
    (B - 1, 3) [m] the offsets and (B - 1, 3, 2) [m] their derivative by the sizes:
    fingers lengthen with the hand; across the hand and out of its back joints spread
    with its breadth.
    """
    offsets, first = model.tree.offsets[1:], model.tree.parents[1:] == 0
    by_size = np.zeros((len(offsets), 3, SIZE_NUMBERS))
    by_size[:, :, 0] = offsets
    by_size[first, 0, 0] = by_size[first, 2, 0] = 0.0
    by_size[first, 0, 1] = offsets[first, 0]
    by_size[first, 2, 1] = offsets[first, 2]
    return by_size @ sizes, by_size


def _offset_roots(model: Model, expect: Expectation) -> Floats:
    """(B - 1, 3, 3) square roots of what offsets tell: rows divided by sigmas."""
    tree = model.tree
    out = np.zeros((len(tree.bones) - 1, 3, 3))
    for b in range(1, len(tree.bones)):
        size = float(np.linalg.norm(tree.offsets[b]))
        if tree.parents[b] == 0 or size == 0.0:
            out[b - 1] = np.eye(3) / expect.knuckle_m
            continue
        along = tree.offsets[b] / size
        across = np.eye(3) - np.outer(along, along)
        out[b - 1] = across / expect.joint_m
        out[b - 1] += np.outer(along, along) / (expect.length * size)
    return out


def tilt_sigmas(model: Model, expect: Expectation) -> Floats:
    """(D,) [rad] standard deviation of each axis' tilt, each way."""
    loose = [name.startswith(("thumb", "wrist")) for name in model.tree.hinges]
    return np.where(loose, expect.thumb_tilt_rad, expect.tilt_rad)


def prior(
    shape: Shape, template: Model, expect: Expectation, tilt_rad: Floats
) -> tuple[Floats, Floats]:
    """How far a shape is from what is expected, in standard deviations.

    Parameters
    ----------
    template : the expected hand, of size (1, 1).
    tilt_rad : (D,) [rad] standard deviation of each axis' tilt, see `tilt_sigmas`.

    Returns
    -------
    (K,) residuals e, to be small in squares, and (K, N) their derivative.
    """
    model, tree = shape.model, shape.model.tree
    counts = sections(model)
    at = np.concatenate([[0], np.cumsum(counts)])
    roots = _offset_roots(template, expect)
    wanted, by_size = expected_offsets(template, shape.sizes)
    joints = np.einsum("bij,bj->bi", roots, tree.offsets[1:] - wanted).ravel()
    tilts = (tree.axes - template.tree.axes) / tilt_rad[:, None]
    places = (model.at - shape.sizes[0] * template.at) / expect.place_m
    sizes = (shape.sizes - 1.0) / expect.size
    rows = np.zeros((len(joints) + tilts.size + places.size + SIZE_NUMBERS, at[-1]))
    for b, root in enumerate(roots):
        rows[3 * b : 3 * b + 3, 3 * b : 3 * b + 3] = root
        rows[3 * b : 3 * b + 3, at[3] :] = -root @ by_size[b]
    start = len(joints)
    across = tangents(tree.axes)
    for d, sigma in enumerate(tilt_rad):
        turned = np.cross(across[d].T, tree.axes[d]).T / sigma
        row, col = start + 3 * d, at[1] + 2 * d
        rows[row : row + 3, col : col + 2] = turned
    start += tilts.size
    span = np.arange(places.size)
    rows[start + span, at[2] + span] = 1.0 / expect.place_m
    rows[start + span, at[3]] = -template.at.ravel() / expect.place_m
    rows[
        start + places.size + np.arange(SIZE_NUMBERS), at[3] + np.arange(SIZE_NUMBERS)
    ] = 1.0 / expect.size
    return np.concatenate([joints, tilts.ravel(), places.ravel(), sizes]), rows


def pose_numbers(model: Model) -> int:
    """P, the degrees of freedom of one frame."""
    return ROOT_DOFS + len(model.tree.hinges)
