"""All fillers of the family, by name."""

from dataclasses import dataclass

from handclean.gaps.family import (
    affine,
    average,
    c1,
    cubic,
    kalman,
    last,
    linear,
    pattern,
    pca,
    ridge,
    rigid,
    spline,
)
from handclean.gaps.tracks import Prepare


@dataclass(frozen=True, kw_only=True)
class Baseline:
    """One way to fill.

    Attributes
    ----------
    name : for options and tables.
    prepare : makes its filler for a take.
    causal : whether it reads nothing after the frame it fills.
    about : what it does, in a line.
    """

    name: str
    prepare: Prepare
    causal: bool
    about: str


def _causal(name: str, prepare: Prepare, about: str) -> Baseline:
    return Baseline(name=name, prepare=prepare, causal=True, about=about)


def _both_ends(name: str, prepare: Prepare, about: str) -> Baseline:
    return Baseline(name=name, prepare=prepare, causal=False, about=about)


_ALL = (
    _causal("last", last.prepare, "stays where it was last seen"),
    _causal("average", average.prepare, "goes on as in the last third of a second"),
    _causal("affine", affine.prepare, "affine combination of the others (Pavllo 2019)"),
    _both_ends("linear", linear.prepare, "straight line at constant speed"),
    _both_ends("cubic", cubic.prepare, "least acceleration, velocities from a fit"),
    _both_ends("c1", c1.prepare, "least acceleration, as printed: two samples a side"),
    _both_ends("spline", spline.prepare, "cubic spline through the nearest samples"),
    _both_ends("pattern", pattern.prepare, "moves as its nearest neighbour does"),
    _both_ends("rigid", rigid.prepare, "moves with three others of its rigid body"),
    _both_ends("pca", pca.prepare, "weighted principal components (Gloersen 2016)"),
    _both_ends(
        "kalman", kalman.prepare, "low-dimensional Kalman smoother (Burke 2016)"
    ),
    _both_ends("ridge", ridge.prepare, "ridge regression on the others"),
)

BASELINES: dict[str, Baseline] = {baseline.name: baseline for baseline in _ALL}
"""Fillers by name."""
