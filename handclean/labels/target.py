"""What is looked for in a cloud of points.

One hand for now. Rigid objects and second hands are further rows of the same kind: a
`Sought` is any joint tree with markers, a rigid object being a tree of one bone.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from handclean.arrays import Floats
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.hand.subject import Subject
from handclean.hand.template import FINGERS
from handclean.ik.prior import PosturePrior
from handclean.ik.solve import chain_of, prior_arrays, start_postures
from handclean.kernels.gauss_newton import Chain
from handclean.labels.clusters import longest_step

TEMPLATE_M = 6e-3
"""[m] RMS distance of markers from a template that nobody has measured."""

LEAST_M = 3e-4
"""[m] no model is better than this, whatever its calibration says."""


@dataclass(frozen=True, kw_only=True)
class Sought:
    """A model to be found and followed.

    Attributes
    ----------
    name : of its skeleton and motion in the session.
    model : joint tree with M markers; chain : the same for the kernels.
    sigma : (M,) [m] RMS distance of each marker from its place in the model.
    spacing : [m] mean distance of a marker from its nearest neighbour.
    step : [m] longest step of the tree that links all markers, largest over postures.
    starts : (S, D) [rad] postures to start from, the likeliest first.
    mean, basis : (D,), (D, K) posture prior.
    fixed_size : False for a template, which is scaled to what is found.
    """

    name: str
    model: Model
    chain: Chain
    sigma: Floats
    spacing: float
    step: float
    starts: Floats
    mean: Floats
    basis: Floats
    fixed_size: bool


def sought(subject: Subject, prior: PosturePrior | None, name: str = "") -> Sought:
    """Return a subject's hand as something to look for."""
    model = subject.model
    known = np.isfinite(subject.marker_sigma)
    sigma = np.where(known, subject.marker_sigma, TEMPLATE_M)
    mean, basis = prior_arrays(model, prior)
    starts = many_postures(model, mean)
    places = marker_positions(model, _posed(model, starts[:4]))
    apart = np.linalg.norm(places[0][:, None] - places[0][None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return Sought(
        name=name or model.tree.side or model.tree.kind,
        model=model,
        chain=chain_of(model),
        sigma=np.maximum(sigma, LEAST_M),
        spacing=float(np.mean(apart.min(axis=1))),
        step=max(longest_step(place) for place in places),
        starts=starts,
        mean=mean,
        basis=basis,
        fixed_size=subject.calibrated,
    )


def scaled(thing: Sought, scale: float) -> Sought:
    """Return a model stretched or shrunk as a whole."""
    tree = thing.model.tree
    tree = replace(tree, offsets=tree.offsets * scale, scale=tree.scale * scale)
    model = replace(thing.model, tree=tree, at=thing.model.at * scale)
    return replace(
        thing,
        model=model,
        chain=chain_of(model),
        spacing=thing.spacing * scale,
        step=thing.step * scale,
    )


def many_postures(model: Model, mean: Floats) -> Floats:
    """(S, D) [rad] a few whole-hand postures, then every mix of bent fingers."""
    few = start_postures(model, mean)
    limits = model.tree.limits
    rows = []
    for bent in product((0.08, 0.55), repeat=len(FINGERS)):
        row = few[0].copy()
        for share, finger in zip(bent, FINGERS, strict=True):
            for d, hinge in enumerate(model.tree.hinges):
                if hinge.startswith(finger) and hinge.endswith("flexion"):
                    row[d] = share * limits[d, 1]
        rows.append(row)
    mixed = np.array(rows).reshape(len(rows), -1)
    return np.ascontiguousarray(np.vstack([few, mixed]))


def _posed(model: Model, angles: Floats) -> Floats:
    poses = np.tile(neutral_pose(model.tree), (len(angles), 1))
    poses[:, 7:] = angles
    return poses
