"""Principal components: directions in which samples vary, most first.

With samples X (N, D) and their mean m, the thin SVD X - m = U S V^T gives the
directions V[:, k] and the standard deviations S[k] / sqrt(N - 1) along them. A
direction's sign is free; here its entry of largest size is positive.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, expect_shape
from handclean.errors import HandcleanError


@dataclass(frozen=True, kw_only=True)
class Subspace:
    """An affine subspace of K directions in D dimensions.

    Attributes
    ----------
    mean : (D,)
    components : (D, K) orthonormal columns, most varying first.
    deviations : (K,) standard deviation of the samples along each.
    share : (K,) of the samples' whole variance that lies along each.
    """

    mean: Floats
    components: Floats
    deviations: Floats
    share: Floats


def principal_components(samples: Floats, count: int | None = None) -> Subspace:
    """Find the ``count`` directions of most variance, or all.

    Parameters
    ----------
    samples : (N, D), finite, N >= 2.

    Raises
    ------
    HandcleanError
        If there are fewer than two samples, or they do not vary.
    """
    expect_shape("samples", samples, "N", "D")
    if len(samples) < 2:
        raise HandcleanError(f"{len(samples)} samples; at least 2 are needed to vary")
    mean = samples.mean(axis=0)
    _, sizes, rows = np.linalg.svd(samples - mean, full_matrices=False)
    variances = sizes**2
    if not variances.sum() > 0.0:
        raise HandcleanError("all samples are the same; they should vary")
    largest = np.abs(rows).argmax(axis=1)
    signs = np.where(rows[np.arange(len(rows)), largest] < 0.0, -1.0, 1.0)
    rows = rows * signs[:, None]
    kept = slice(0, count)
    return Subspace(
        mean=mean,
        components=np.ascontiguousarray(rows[kept].T),
        deviations=sizes[kept] / np.sqrt(len(samples) - 1.0),
        share=variances[kept] / variances.sum(),
    )


def covered(components: Floats, samples: Floats) -> Floats:
    """(K,) share of samples' variance that the first 1, 2, ... K directions hold.

    Variance is about the samples' own mean, so that for the samples a subspace was
    learnt from this is the running sum of its shares.

    Parameters
    ----------
    components : (D, K) orthonormal.
    samples : (N, D)

    Raises
    ------
    HandcleanError
        If the samples do not vary.
    """
    expect_shape("components", components, "D", "K")
    expect_shape("samples", samples, "N", len(components))
    away = samples - samples.mean(axis=0) if len(samples) else samples
    whole = float((away**2).sum())
    if not whole > 0.0:
        raise HandcleanError("all samples are the same; they should vary")
    shares: Floats = np.cumsum(((away @ components) ** 2).sum(axis=0)) / whole
    return shares


def misfit(mean: Floats, components: Floats, samples: Floats) -> Floats:
    """(K + 1,) RMS per entry of what 0, 1, ... K directions leave of samples.

    Unlike `covered` this counts how far the samples' mean is from the subspace's.

    Parameters
    ----------
    mean : (D,); components : (D, K) orthonormal; samples : (N, D)
    """
    expect_shape("components", components, len(mean), "K")
    expect_shape("samples", samples, "N", len(mean))
    away = samples - mean
    along = ((away @ components) ** 2).sum(axis=0)
    left = (away**2).sum() - np.concatenate([[0.0], np.cumsum(along)])
    rms: Floats = np.sqrt(np.maximum(left, 0.0) / max(away.size, 1))
    return rms
