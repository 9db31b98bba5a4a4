"""What is looked for in a cloud of points.

One hand for now. Rigid objects and second hands are further targets of the same kind: a
`TrackTarget` is any joint tree with markers, a rigid object being a tree of one bone.
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

TEMPLATE_SIGMA_M = 6e-3
"""[m] RMS distance of markers from a template that nobody has measured. Chosen; fits of
templates to real takes leave 4 mm (`checks.side`)."""

MIN_SIGMA_M = 3e-4
"""[m] no model is better than this, whatever its calibration says. Chosen: the noise of
a motion capture system."""

FLEXION_SHARES = (0.08, 0.55)
"""Share of its largest flexion by which a straight, and a bent, finger is bent in the
postures that a search starts from. Chosen."""

MEASURED_POSTURES = 4
"""How many of the start postures the longest step between markers is taken from: the
whole-hand postures, which `start_postures` lists first."""


@dataclass(frozen=True, kw_only=True)
class TrackTarget:
    """A model to be found and tracked.

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


def make_target(
    subject: Subject, prior: PosturePrior | None, name: str = ""
) -> TrackTarget:
    """Return a subject's hand as something to look for.

    Parameters
    ----------
    prior : posture subspace for what markers leave open, or None.
    name : of the motion; "" for the hand's side.
    """
    model = subject.model
    known = np.isfinite(subject.marker_sigma)
    sigma = np.where(known, subject.marker_sigma, TEMPLATE_SIGMA_M)
    mean, basis = prior_arrays(model, prior)
    starts = search_postures(model, mean)
    places = marker_positions(model, _poses_of(model, starts[:MEASURED_POSTURES]))
    apart = np.linalg.norm(places[0][:, None] - places[0][None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return TrackTarget(
        name=name or model.tree.side or model.tree.kind,
        model=model,
        chain=chain_of(model),
        sigma=np.maximum(sigma, MIN_SIGMA_M),
        spacing=float(np.mean(apart.min(axis=1))),
        step=max(longest_step(place) for place in places),
        starts=starts,
        mean=mean,
        basis=basis,
        fixed_size=subject.calibrated,
    )


def scale_target(target: TrackTarget, scale: float) -> TrackTarget:
    """Return a target stretched or shrunk as a whole."""
    tree = target.model.tree
    tree = replace(tree, offsets=tree.offsets * scale, scale=tree.scale * scale)
    model = replace(target.model, tree=tree, at=target.model.at * scale)
    return replace(
        target,
        model=model,
        chain=chain_of(model),
        spacing=target.spacing * scale,
        step=target.step * scale,
    )


def search_postures(model: Model, mean: Floats) -> Floats:
    """(S, D) [rad] a few whole-hand postures, then every mix of bent fingers."""
    few = start_postures(model, mean)
    limits = model.tree.limits
    rows = []
    for bent in product(FLEXION_SHARES, repeat=len(FINGERS)):
        row = few[0].copy()
        for share, finger in zip(bent, FINGERS, strict=True):
            for d, hinge in enumerate(model.tree.hinges):
                if hinge.startswith(finger) and hinge.endswith("flexion"):
                    row[d] = share * limits[d, 1]
        rows.append(row)
    mixed = np.array(rows).reshape(len(rows), -1)
    return np.ascontiguousarray(np.vstack([few, mixed]))


def _poses_of(model: Model, angles: Floats) -> Floats:
    """(S, 7 + D) poses of (S, D) [rad] angles, the root unturned at the origin."""
    poses = np.tile(neutral_pose(model.tree), (len(angles), 1))
    poses[:, 7:] = angles
    return poses
