"""Weighted alignment of corresponding points, in closed form.

Sought are a rotation R, a translation t and, if wanted, a scale s that minimise

    sum_i w_i | target_i - (s R source_i + t) |^2 .

With the weighted centroids a of the source and b of the target, t = b - s R a whatever
R and s are. What is left is maximising trace(R^T C) with the weighted covariance

    C = sum_i w_i (target_i - b) (source_i - a)^T = U S V^T ,

solved by R = U diag(1, 1, det(U V^T)) V^T and s = trace(S D) / sum_i w_i |source_i -
a|^2 (Umeyama, Least-squares estimation of transformation parameters between two point
patterns, IEEE PAMI 13 (1991), equations 39-43, with weights). The weights belong in
the covariance before the decomposition: weighting the centroids alone is not optimal.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, expect_shape
from handclean.errors import ShapeError


@dataclass(frozen=True, kw_only=True)
class Alignment:
    """Where ``source`` goes: ``scale * rotation @ point + translation``.

    Attributes
    ----------
    rotation : (3, 3) a proper rotation.
    translation : (3,) in the target's unit.
    scale : 1 for a rigid alignment.
    rms : weighted root mean square distance that is left, in the target's unit.
    """

    rotation: Floats
    translation: Floats
    scale: float
    rms: float

    def apply(self, points: Floats) -> Floats:
        """Return (..., 3) points where the alignment puts them."""
        return self.scale * points @ self.rotation.T + self.translation


def align(
    source: Floats,
    target: Floats,
    weights: Floats | None = None,
    *,
    scaled: bool = False,
) -> Alignment:
    """Return the best rigid (or similarity) motion of points onto their partners.

    Parameters
    ----------
    source, target : (P, 3) corresponding points; a row with weight 0 may hold NaN.
    weights : (P,) non-negative; all alike by default.
    scaled : whether the size may change, too.

    Raises
    ------
    ShapeError
        If the shapes do not fit, or no weight is positive.

    Notes
    -----
    Fewer than three points, or points on a line, leave the rotation open: one of the
    best is returned.
    """
    expect_shape("source", source, "P", 3)
    expect_shape("target", target, len(source), 3)
    if weights is None:
        weights = np.ones(len(source))
    expect_shape("weights", weights, len(source))
    used = weights > 0
    if not used.any():
        raise ShapeError("weights should hold at least one positive number")
    share = weights[used] / weights[used].sum()
    here, there = source[used], target[used]
    here_centre, there_centre = share @ here, share @ there
    here, there = here - here_centre, there - there_centre
    left, sizes, right = np.linalg.svd((there * share[:, None]).T @ here)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = (left * signs) @ right
    spread = float(share @ np.sum(here**2, axis=1))
    scale = float(sizes @ signs) / spread if scaled and spread > 0 else 1.0
    left_over = there - scale * here @ rotation.T
    return Alignment(
        rotation=rotation,
        translation=there_centre - scale * rotation @ here_centre,
        scale=scale,
        rms=float(np.sqrt(share @ np.sum(left_over**2, axis=1))),
    )
