"""The energy of layouts and its terms (Schroeder 2016, equations 5 to 9).

    E      = w1 E_cond + w2 E_dist + w3 E_hidden
    E_cond = mean over the keyframes of kappa(J'J)
    E_dist = - min over keyframes and pairs of markers of |a - b|^2 / L^2

The papers divide by L once, which leaves the term with a unit; L^2 makes it scale-free
as their text says. The papers' weights w1 = 0.1, w2 = 100 then do what their figure 7
shows (tests/bench/RESULTS.md, layouts, figure 7). Ten markers on all simulated grasps:
for the first term alone two sit 2 mm apart, for both 20 mm, and the mean condition
number goes from 212 to 215; for the second alone it is 1411. On precision grasps: 2 and
30 mm, 560 and 567, and 1377. w2 = 1000 would give 36 and 33 mm, but condition numbers
of 304 and 580. E_hidden, which is ours, is the share of keyframes and directions in
which the markers are not seen.

A layout with a marker twice, or one that leaves something undetermined, has an infinite
energy; so does any layout for which a term with a weight is infinite.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints, expect_shape
from handclean.kernels import layouts as kernels
from handclean.kernels.layouts import Candidates, Weights
from handclean.layouts.problem import Problem
from handclean.layouts.settings import LayoutConfig


@dataclass(frozen=True, kw_only=True)
class Energies:
    """S layouts' energies.

    Attributes
    ----------
    total : (S,) E.
    condition, distance, hidden : (S,) the three terms, without weights.
    kappa : (S, F) condition number in each keyframe.
    smallest_m : (S,) [m] smallest distance of two markers in any keyframe; infinite of
        a single marker.
    """

    total: Floats
    condition: Floats
    distance: Floats
    hidden: Floats
    kappa: Floats
    smallest_m: Floats


def weights_of(settings: LayoutConfig) -> Weights:
    """Return how much each term counts."""
    return Weights(
        condition=settings.w1, distance=settings.w2, hidden=settings.visibility
    )


def candidates_of(
    problem: Problem, settings: LayoutConfig, order: Ints | None = None
) -> Candidates:
    """Return the candidates as the kernels want them.

    Parameters
    ----------
    settings : w1, w2, visibility.
    order : (N,) in which order; their own if None.
    """
    grams, gaps, hidden = problem.grams, problem.gaps, problem.hidden
    if order is not None:
        grams = np.ascontiguousarray(grams[order])
        gaps = np.ascontiguousarray(gaps[np.ix_(order, order)])
        hidden = hidden[order]
    return Candidates(
        grams=grams,
        gaps=gaps,
        hidden=hidden,
        weights=weights_of(settings),
        columns=len(problem.columns),
    )


def energies(problem: Problem, layouts: Ints, settings: LayoutConfig) -> Energies:
    """Weigh layouts.

    Parameters
    ----------
    layouts : (S, k) candidates.
    settings : w1, w2, visibility.
    """
    expect_shape("layouts", layouts, "S", "k")
    kappa = np.zeros((len(layouts), len(problem.places)))
    rows = np.ascontiguousarray(layouts, dtype=np.int64)
    kernels.conditions(rows, problem.grams, len(problem.columns), kappa)
    pairs = np.triu_indices(layouts.shape[1], 1)
    apart = problem.gaps[layouts[:, pairs[0]], layouts[:, pairs[1]]]
    least = apart.min(axis=1, initial=np.inf)
    terms = {
        "condition": kappa.mean(axis=1),
        "distance": -least if len(pairs[0]) else np.zeros(len(layouts)),
        "hidden": problem.hidden[layouts].mean(axis=1),
    }
    total = np.zeros(len(layouts))
    for weight, term in zip(weights_of(settings), terms.values(), strict=True):
        if weight:
            total += weight * term
    equal = (layouts[:, pairs[0]] == layouts[:, pairs[1]]).any(axis=1)
    total[equal] = np.inf
    smallest = np.sqrt(least) * problem.length_m
    return Energies(total=total, kappa=kappa, smallest_m=smallest, **terms)
