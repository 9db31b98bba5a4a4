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
"""Parts in which recordings are held out."""

_LIGHT = FitSettings(starts=1, pseudo_inputs=40, subset=128, evaluations=30)
_LIGHT_SAMPLES = 320

_STILL, _SAME = np.radians(0.5), np.radians(2.0)
"""[rad] a rotation that is still in a recording; angles that are one."""

_WHOLE, _PIECES = 0.8, 4
"""Share of the range in one recording that makes it several, and how many."""

_UNTOLD = 0.15
"""Share of the range by which a curve may be off that nothing tells."""

_BESIDE = 0.02
"""Share of the readings' range by which one may lie beside it."""

_SCALES = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
_FLOORS = np.radians(np.array([0.0, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0]))


def held_out(
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
    together = held_together(targets, group)[rows]
    inputs, targets = inputs[rows], targets[rows]
    numbers, part = np.unique(together, return_inverse=True)
    fold = rng.permutation(len(numbers))[part] % min(_FOLDS, max(len(numbers), 1))
    near = inputs[:, 0]
    beside = _BESIDE * np.ptp(near)
    errors, variances, weights = [], [], []
    for k in range(int(fold.max()) + 1):
        train = fold != k
        enough = train.sum() > inputs.shape[1] + 3 and np.ptp(targets[train]) > 1e-6
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
        return 1.0, float(_UNTOLD * np.ptp(targets))
    error, variance = np.concatenate(errors), np.concatenate(variances)
    return _most_probable(error, variance, np.concatenate(weights))


def held_together(targets: Floats, group: Ints) -> Ints:
    """(N,) a number for what is held out at once.

    Recordings in which the rotation is still at one angle, whatever the others do, go
    together; each in which it moves stands for itself, or for several if it is most of
    what there is.
    """
    numbers, place = np.unique(group, return_inverse=True)
    count = np.bincount(place)
    mean = np.bincount(place, targets) / count
    spread_of = np.sqrt(np.bincount(place, (targets - mean[place]) ** 2) / count)
    still = spread_of < _STILL
    out = np.arange(len(numbers))
    before = -1
    for k in np.argsort(mean, kind="stable"):
        if not still[k]:
            continue
        if before >= 0 and mean[k] - mean[before] < _SAME:
            out[k] = out[before]
        before = int(k)
    held: Ints = out[place]
    for k in np.flatnonzero(~still):
        own = np.flatnonzero(place == k)
        if np.ptp(targets[own]) > _WHOLE * np.ptp(targets):
            piece = np.arange(len(own)) * _PIECES // len(own)
            held[own] = len(numbers) + _PIECES * k + piece
    return held


def angles_told(targets: Floats, group: Ints) -> int:
    """At how many angles a rotation is known; many if it moves in a recording."""
    for number in np.unique(group):
        if targets[group == number].std() >= _STILL:
            return len(targets)
    return len(np.unique(held_together(targets, group)))


def _most_probable(
    error: Floats, variance: Floats, weight: Floats
) -> tuple[float, float]:
    """Return k and e under which errors are most probable."""
    scale, floor = (grid.ravel() for grid in np.meshgrid(_SCALES, _FLOORS))
    total = scale[:, None] * variance + np.maximum(floor, 1e-4)[:, None] ** 2
    surprise = (np.log(total) + error**2 / total) @ weight
    best = int(np.argmin(surprise))
    return float(scale[best]), float(floor[best])
