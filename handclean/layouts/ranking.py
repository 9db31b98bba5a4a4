"""Layouts that are ranked or made by hand: what the search is compared with.

Wheatland, Joerg and Zordan, Automatic hand-over animation using principal component
analysis, MIG 2013, choose of a base set the markers that matter most to the principal
components of the markers' paths. Here, with the components that hold 95 % of the
variance, a marker's influence is the sum over the components of the size of its three
entries times the component's variance. The base set is a share of the candidates, drawn
at random (Schroeder 2016, figure 10: all, 5 %, 1 %).

Hoyet et al., Sleight of hand, I3D 2012, chose their markers by hand; the sets that ship
are reconstructions.
"""

import math
from functools import partial

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.layouts.objective import energies
from handclean.layouts.problem import Problem
from handclean.layouts.search import Found, Log, Watch
from handclean.layouts.settings import LayoutConfig
from handclean.numerics.subspace import principal_components

_VARIANCE_SHARE = 0.95
"""Share of the variance that the components hold (chosen)."""


def influence(motion: Floats) -> Floats:
    """(N,) how much each of N points matters to the components of their paths.

    Parameters
    ----------
    motion : (S, N, 3) [m]
    """
    frames, count = motion.shape[:2]
    found = principal_components(motion.reshape(frames, 3 * count))
    kept = int(np.searchsorted(np.cumsum(found.share), _VARIANCE_SHARE)) + 1
    entries = np.abs(found.components[:, :kept]) @ found.deviations[:kept] ** 2
    out: Floats = entries.reshape(count, 3).sum(axis=1)
    return out


def wheatland(
    problem: Problem,
    settings: LayoutConfig,
    rng: np.random.Generator,
    start: Ints | None = None,
    watch: Watch | None = None,
) -> Found:
    """Choose the most influential candidates of a base set.

    Parameters
    ----------
    settings : markers, base_share.
    start : not needed.
    """
    count = len(problem.home)
    few = max(math.ceil(settings.base_share * count), settings.markers)
    base = np.sort(rng.choice(count, few, replace=False))
    ranked = np.argsort(-influence(problem.motion[:, base]), kind="stable")
    return _made(problem, base[ranked[: settings.markers]], settings, watch)


def by_hand(
    name: str,
    problem: Problem,
    settings: LayoutConfig,
    rng: np.random.Generator,
    start: Ints | None = None,
    watch: Watch | None = None,
) -> Found:
    """Take the candidates nearest to the markers of a set that ships, bone by bone.

    Parameters
    ----------
    name : of the set; it says how many markers there are.
    settings, rng, start : not needed.

    Raises
    ------
    HandcleanError
        If a marker's bone has no candidate left.
    """
    markers = load_marker_set(name).on(problem.model.tree)
    home = marker_positions(markers, neutral_pose(markers.tree)[None])[0]
    chosen: list[int] = []
    for label, bone, place in zip(markers.labels, markers.bone, home, strict=True):
        near = np.linalg.norm(problem.home - place, axis=1)
        near[problem.model.bone != bone] = np.inf
        near[chosen] = np.inf
        if not near.min() < np.inf:
            raise HandcleanError(
                f"{label} is on {markers.tree.bones[bone]}, where no candidate "
                "is left; allow markers there",
                where=name,
            )
        chosen.append(int(near.argmin()))
    return _made(problem, np.array(chosen, dtype=np.int64), settings, watch)


def _made(
    problem: Problem, layout: Ints, settings: LayoutConfig, watch: Watch | None
) -> Found:
    log = Log(watch)
    log.note(1, float(energies(problem, layout[None], settings).total[0]))
    return Found(layout=layout, history=log.history(), stopped="nothing to search")


BY_HAND = {name: partial(by_hand, name) for name in ("hoyet6", "hoyet8", "hoyet20")}
"""The sets that were chosen by hand."""
