"""How far a rotation's variance can be believed, by holding recordings out.

A Gaussian process takes every sample's error for one of its own. But all samples of a
key pose or a widget share the error with which it was taken, so that the more of them
there are, the surer and the wronger the process gets; and it knows nothing of a curve
between two poses but how it is curved elsewhere. What was recorded is therefore held
out in turn from small models of the same kind, recordings at one angle together, as
each of them tells what the others would have to be guessed from. Errors count where
readings lie within those left, so that models are judged by what they bridge and not by
what they continue. Sought are the factor k and the addition e^2 under which k v + e^2
makes these errors most probable; everything held out counts the same.
"""

from dataclasses import replace

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.glove.models import fit
from handclean.glove.samples import spread
from handclean.numerics.gp.settings import FitSettings

_FOLDS = 6
"""Parts in which recordings are held out (chosen)."""

_LIGHT = FitSettings(starts=1, pseudo_inputs=40, subset=128, evaluations=30)
_LIGHT_SAMPLES = 320
"""Settings and samples of the small models, for speed (chosen)."""

_STILL_SD_RAD = np.radians(0.5)
"""[rad] a rotation with a smaller standard deviation is still (chosen)."""

_SAME_ANGLE_RAD = np.radians(2.0)
"""[rad] still angles that are closer count as one (chosen)."""

_LONG_RANGE_SHARE, _PIECES = 0.8, 4
"""[-] share of all angles' range; one with more is split in so many (chosen)."""

_UNKNOWN_CURVE_SHARE = 0.15
"""[-] share of the range by which a curve may be off where nothing tells (chosen)."""

_MARGIN_SHARE = 0.02
"""[-] share of the readings' range by which a reading may lie beside it (chosen)."""

_FACTORS = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
"""[-] factors k that are tried (chosen)."""

_FLOORS_RAD = np.radians([0.0, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0])
"""[rad] floors e that are tried (chosen)."""

_LEAST_TURN_RAD = 1e-6
"""[rad] a rotation that turns less in all samples is constant (chosen)."""


def fit_variance(
    kind: str,
    inputs: Floats,
    targets: Floats,
    group: Ints,
    least_noise: float,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Find the factor k of a model's variance and the floor e [rad].

    Parameters
    ----------
    kind : of the model, see `handclean.glove.models`.
    inputs : (N, C) readings, the measuring sensor's first; targets : (N,) [rad].
    group : (N,) the recording each sample is of.
    least_noise : [rad] of a target, see `FitSettings`.

    Returns
    -------
    k and e. Where nothing can be held out that lies between others, nothing is known
    of the curve: e is then a share of the targets' range.
    """
    rows = spread(len(targets), _LIGHT_SAMPLES)
    together = hold_out_groups(targets, group)[rows]
    inputs, targets = inputs[rows], targets[rows]
    numbers, part = np.unique(together, return_inverse=True)
    fold = rng.permutation(len(numbers))[part] % min(_FOLDS, max(len(numbers), 1))
    near = inputs[:, 0]
    beside = _MARGIN_SHARE * np.ptp(near)
    errors, variances, weights = [], [], []
    for k in range(int(fold.max()) + 1):
        train = fold != k
        enough = (
            train.sum() > inputs.shape[1] + 3
            and np.ptp(targets[train]) > _LEAST_TURN_RAD
        )
        if not enough or np.ptp(near[train]) == 0.0:
            continue
        low, high = near[train].min() - beside, near[train].max() + beside
        test = ~train & (low <= near) & (near <= high)
        if not test.any():
            continue
        few = min(_LIGHT.pseudo_inputs, int(train.sum()) - 1)
        light = replace(_LIGHT, pseudo_inputs=few, least_noise=least_noise)
        made = fit(kind, inputs[train], targets[train], light, rng)
        mean, variance = made.predict(inputs[test])
        errors.append(mean - targets[test])
        variances.append(variance)
        weights.append(1.0 / np.bincount(part)[part[test]])
    if not errors:
        return 1.0, float(_UNKNOWN_CURVE_SHARE * np.ptp(targets))
    error, variance = np.concatenate(errors), np.concatenate(variances)
    return _most_probable(error, variance, np.concatenate(weights))


def hold_out_groups(targets: Floats, group: Ints) -> Ints:
    """(N,) a number for what is held out at once.

    Recordings in which the rotation is still at one angle, whatever the others do, go
    together; each in which it moves stands for itself, or for several if it is most of
    what there is.
    """
    numbers, place = np.unique(group, return_inverse=True)
    count = np.bincount(place)
    mean = np.bincount(place, targets) / count
    spread_of = np.sqrt(np.bincount(place, (targets - mean[place]) ** 2) / count)
    still = spread_of < _STILL_SD_RAD
    out = np.arange(len(numbers))
    before = -1
    for k in np.argsort(mean, kind="stable"):
        if not still[k]:
            continue
        if before >= 0 and mean[k] - mean[before] < _SAME_ANGLE_RAD:
            out[k] = out[before]
        before = int(k)
    held: Ints = out[place]
    for k in np.flatnonzero(~still):
        own = np.flatnonzero(place == k)
        if np.ptp(targets[own]) > _LONG_RANGE_SHARE * np.ptp(targets):
            piece = np.arange(len(own)) * _PIECES // len(own)
            held[own] = len(numbers) + _PIECES * k + piece
    return held


def count_angles(targets: Floats, group: Ints) -> int:
    """At how many angles a rotation is known; many if it moves in a recording."""
    for number in np.unique(group):
        if targets[group == number].std() >= _STILL_SD_RAD:
            return len(targets)
    return len(np.unique(hold_out_groups(targets, group)))


def _most_probable(
    error: Floats, variance: Floats, weight: Floats
) -> tuple[float, float]:
    """Return k and e under which errors are most probable."""
    scale, floor = (grid.ravel() for grid in np.meshgrid(_FACTORS, _FLOORS_RAD))
    total = scale[:, None] * variance + np.maximum(floor, 1e-4)[:, None] ** 2
    surprise = (np.log(total) + error**2 / total) @ weight
    best = int(np.argmin(surprise))
    return float(scale[best]), float(floor[best])
