"""Weighted principal components of nearby markers (Gloersen and Federolf 2016).

Frames with all donors and the hidden marker give rows X, those with zeros in place of
the hidden marker X0, both less their means. A marker counts by how near it is to the
hidden one on average, d: its coordinates are divided by their deviation and multiplied
by exp(-d^2 / (2 s^2)); those of the hidden marker by 0.02, so that it hardly turns the
directions. With the principal directions P of X and Q of X0, as many as hold 99 % of
the sum of the singular values of both, a row x0 of the gap is taken into the one and
then into the other (Federolf 2013, equation 1) ::

    x = x0 Q (Q^T P) P^T ,

whose entries of the hidden marker, divided again, are its place. This is the paper's
strategy R2: one hidden marker after the other, without markers that are hidden with it;
`donors` leaves out others for the reason the paper has, that their gaps cost frames.

Three things are not the paper's, which is about walking on a treadmill: a frame is
rotated onto the body, not only shifted; the deviation is that of a marker, not of each
coordinate, so that the body's axes do not matter; and s, 200 mm there for markers on a
whole body, is a share of how far the donors are from the hidden marker.

Gloersen and Federolf, Predicting missing marker trajectories in human motion data using
marker intercorrelations, PLoS ONE 11(3) (2016) e0152616.
"""

import numpy as np

from handclean.arrays import Floats
from handclean.gaps.family.rule import prepare_rule
from handclean.gaps.tracks import Fill, Tracks

WEIGHT_SCALE = 0.7
"""s over the donors' mean distance (chosen on two recordings of hands, other gaps than
it is judged by; from 0.5 to 2 the error differs by 4 %, at 0.3 it is 18 % more)."""

HIDDEN_WEIGHT = 0.02
"""Weight of the hidden marker (the paper's)."""

KEPT_SHARE = 0.99
"""Of the sum of singular values, in the directions that are kept (the paper's)."""


def prepare(tracks: Tracks) -> Fill:
    """Fill by principal components of nearby markers."""
    return prepare_rule(tracks, pca_slopes)


def pca_slopes(donors: Floats, places: Floats) -> Floats:
    """(3 V, 3) the module's formula as slopes, x0 to the hidden marker's place.

    Parameters
    ----------
    donors : (N, V, 3) [m]; places : (N, 3) [m]; in the body's coordinates.
    """
    apart = np.linalg.norm(donors - places[:, None], axis=2).mean(axis=0)
    weight = np.exp(-0.5 * (apart / (WEIGHT_SCALE * apart.mean())) ** 2)
    both = np.concatenate([donors, places[:, None]], axis=1)
    both = both - both.mean(axis=0)
    deviation = np.sqrt(np.mean(both**2, axis=(0, 2)))
    deviation[deviation == 0.0] = 1.0
    scale = np.repeat(np.append(weight, HIDDEN_WEIGHT) / deviation, 3)
    rows = both.reshape(len(both), -1) * scale
    square = rows.T @ rows
    sizes, p = _directions(square)
    sizes_0, q = _directions(square[:-3, :-3])
    kept = max(_enough(sizes), _enough(sizes_0))
    p, q = p[:, :kept], q[:, :kept]
    slopes = q @ (q.T @ p[:-3]) @ p[-3:].T
    return np.asarray(scale[:-3, None] * slopes / scale[-3:])


def _directions(square: Floats) -> tuple[Floats, Floats]:
    """Singular values, falling, and directions of rows with this X^T X."""
    variances, directions = np.linalg.eigh(square)
    return np.sqrt(np.maximum(variances[::-1], 0.0)), directions[:, ::-1]


def _enough(sizes: Floats) -> int:
    """How many directions hold their share of the singular values."""
    return int(np.argmax(np.cumsum(sizes) >= KEPT_SHARE * sizes.sum())) + 1
