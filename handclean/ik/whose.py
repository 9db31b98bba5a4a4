"""Why markers do not fit a subject: its unit, its person, its side, or its names?

The distance of two markers on one bone is the same in every posture, and in the mirror
image of a hand. So if such distances are all longer or shorter by much, it is the
unit; if they differ by millimetres, another person or other places of the markers;
and if they are the subject's while its markers do not fit, the other hand, or names
that were exchanged between bones.

Measured on simulated people and sets with two such distances or more, RMS of their
errors over that of ``marker_sigma``: up to 1.4 with the subject's own take and its
mirror image, 6.9 to 33 with another's.
"""

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.subject import Subject

MIN_DISTANCE_M = 5e-3
"""[m] markers of one bone that are nearer to each other tell too little. Chosen."""

MAX_SIZE_RATIO = 2.0
"""By how many times distances are larger or smaller than the subject's in no hand.
Chosen."""

MAX_ERROR_RATIO = 3.0
"""How many times the error of a marker's place (RMS) distances may be wrong (RMS).
Between the 1.4 and 6.9 above."""


def pairs(subject: Subject) -> Ints:
    """(N, 2) markers that sit on one bone, apart from each other."""
    model = subject.model
    one, two = np.triu_indices(len(model.bone), 1)
    apart = np.linalg.norm(model.at[one] - model.at[two], axis=1)
    good = (model.bone[one] == model.bone[two]) & (apart >= MIN_DISTANCE_M)
    return np.stack([one[good], two[good]], axis=1)


def reason(subject: Subject, positions: Floats) -> str:
    """Say why a take hardly shows a subject, as far as its markers tell.

    Parameters
    ----------
    positions : (T, M, 3) [m] of the subject's markers, NaN where missing.
    """
    both = pairs(subject)
    away = positions[:, both[:, 0]] - positions[:, both[:, 1]]
    lengths = np.linalg.norm(away, axis=2)
    told = np.isfinite(lengths).any(axis=0)
    if told.sum() < 2:
        return "another person's subject, the other hand, or exchanged names?"
    both = both[told]
    found = np.nanmedian(lengths[:, told], axis=0)
    at = subject.model.at
    expected = np.linalg.norm(at[both[:, 0]] - at[both[:, 1]], axis=1)
    size = float(np.median(found / expected))
    if not 1.0 / MAX_SIZE_RATIO < size < MAX_SIZE_RATIO:
        return (
            f"markers of one bone are {size:.3g} times as far apart as this subject's"
        )
    sigma = subject.marker_sigma
    known = float(np.sqrt(np.nanmean(sigma**2))) if np.isfinite(sigma).any() else np.nan
    wrong = float(np.sqrt(np.mean((found - expected) ** 2)))
    if not np.isfinite(known):
        return "another marker set, or the other hand?"
    if wrong > MAX_ERROR_RATIO * known:
        return (
            f"markers of one bone are {1e3 * wrong:.2g} mm nearer or farther apart "
            "than this subject's: another person's subject, or markers moved since "
            "its calibration?"
        )
    return (
        "markers of one bone are as far apart as this subject's: the other hand, or "
        "exchanged names?"
    )
