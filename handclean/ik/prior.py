"""The posture prior: hand postures as a mean and a few directions (PCA)."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, expect_shape
from handclean.errors import HandcleanError, UsageError
from handclean.numerics import subspace

MIN_TAKE_FRAMES = 200
"""Frames that a take gives to a prior at least. Chosen."""


@dataclass(frozen=True, kw_only=True)
class PosturePrior:
    """A posture subspace (Schroeder 2016 section 3.2).

    Attributes
    ----------
    names : D hinge names.
    mean : (D,) [rad]
    components : (D, K) orthonormal directions, the most varied first.
    deviations : (K,) [rad] standard deviation along each.
    variance_share : (K,) share of the training variance each direction holds.
    source : what it was learnt from.
    """

    names: tuple[str, ...]
    mean: Floats
    components: Floats
    deviations: Floats
    variance_share: Floats
    source: str = ""

    def __post_init__(self) -> None:
        hinges, directions = len(self.names), len(self.deviations)
        expect_shape("mean", self.mean, hinges)
        expect_shape("components", self.components, hinges, directions)
        expect_shape("variance_share", self.variance_share, directions)


def learn(
    takes: Sequence[Floats],
    names: tuple[str, ...],
    *,
    directions: int | None = None,
    share: float = 0.95,
    source: str = "",
) -> PosturePrior:
    """Learn a prior from joint angles by PCA (Schroeder 2016, equation 3).

    Every take counts the same, however many frames it has; frames with an unknown
    angle are left out.

    Parameters
    ----------
    takes : (T, D) angles each [rad].
    names : D hinge names.
    directions : how many to keep; else as many as hold ``share`` of the variance.
    source : what the takes are, for the record.

    Raises
    ------
    UsageError
        If ``directions`` or ``share`` ask for what cannot be.
    HandcleanError
        If nothing is left to learn from.
    """
    hinges = len(names)
    if directions is not None and not 1 <= directions <= hinges:
        right = f"directions should lie between 1 and {hinges}, the number of angles"
        raise UsageError(f"{right}, not {directions}")
    if not 0.0 < share <= 1.0:
        raise UsageError(f"share should lie between 0 and 1, not {share}")
    known = [_known(take, hinges) for take in takes]
    known = [take for take in known if len(take)]
    if not known:
        raise HandcleanError("no frame with all angles known to learn a prior from")
    found = subspace.principal_components(_evened(known))
    if directions is None:
        directions = int(np.searchsorted(np.cumsum(found.share), share - 1e-9)) + 1
    kept = slice(0, directions)
    return PosturePrior(
        names=names,
        mean=found.mean,
        components=np.ascontiguousarray(found.components[:, kept]),
        deviations=found.deviations[kept],
        variance_share=found.share[kept],
        source=source,
    )


def knowing(prior: PosturePrior | None, hinges: Collection[str]) -> PosturePrior | None:
    """Return a prior for a tree with these hinges.

    Returns
    -------
    the prior itself; None where it knows none of the hinges, or there is none
    """
    return prior if prior and not set(hinges).isdisjoint(prior.names) else None


def coverage(prior: PosturePrior, angles: Floats) -> Floats:
    """(K,) share of angles' variance that the first 1, 2, ... K directions hold.

    Parameters
    ----------
    angles : (T, D) [rad] in the order of the prior's names.
    """
    return subspace.covered(prior.components, _known(angles, len(prior.names)))


def misfit(prior: PosturePrior, angles: Floats) -> Floats:
    """(K + 1,) [rad] RMS angle that 0, 1, ... K directions about the mean leave over.

    Parameters
    ----------
    angles : (T, D) [rad] in the order of the prior's names.
    """
    known = _known(angles, len(prior.names))
    return subspace.misfit(prior.mean, prior.components, known)


def _known(angles: Floats, hinges: int) -> Floats:
    """Frames in which every angle is known."""
    expect_shape("angles", angles, "T", hinges)
    return angles[np.isfinite(angles).all(axis=1)]


def _evened(takes: list[Floats]) -> Floats:
    """Frames of all takes, the same number of each: evenly spread ones.

    The shortest take sets the number, but not below `MIN_TAKE_FRAMES`, where short
    takes repeat.
    """
    count = max(min(len(take) for take in takes), MIN_TAKE_FRAMES)
    chosen = [
        np.linspace(0, len(take) - 1, count).round().astype(int) for take in takes
    ]
    return np.concatenate(
        [take[rows] for take, rows in zip(takes, chosen, strict=True)]
    )
