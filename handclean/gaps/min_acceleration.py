"""The path of least acceleration through a gap, and how its ends are found.

Between two known ends x0, x1 with velocities v0, v1 the path that minimises the
integral of its squared acceleration (Maycock 2015 section III-C; Schroeder 2017 eq. 6)
has a vanishing fourth derivative: with T the time between the ends and s = t / T ::

    x(s) = (2 s^3 - 3 s^2 + 1) x0 + (s^3 - 2 s^2 + s) T v0
         + (3 s^2 - 2 s^3)     x1 + (s^3 - s^2)       T v1

Its acceleration is linear, from a0 = (6 (x1 - x0) / T - 4 v0 - 2 v1) / T to
a1 = (-6 (x1 - x0) / T + 2 v0 + 4 v1) / T; the mean square of it, the *bend*, is
(a0^2 + a0 a1 + a1^2) / 3 and says how much went on in the gap.

The papers discretise this into an n x n system whose end slopes are the differences of
single frames, so that marker noise grows with the gap (5.5 times over 20 frames, 25
times over 100). Here v0 and v1 come from a polynomial fitted to several known frames.

A single known frame has no velocity: the path of least acceleration then ends there
unbent, with v = 1.5 (x1 - x0) / T - 0.5 times the velocity at the other end.

Where a few known frames lie between gaps, too few to fit a velocity, they support one
path through all of those gaps: the cubic spline of least acceleration, clamped at its
outer ends (a tridiagonal system), through the mean of each such group of frames. In
between, the path is led linearly onto the frames that enclose each gap.

Time counts in frames throughout.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape
from handclean.gaps.runs import Cluster


@dataclass(frozen=True, kw_only=True)
class EndFit:
    """How an end velocity is found: a polynomial over the nearest known frames.

    Attributes
    ----------
    order : 1 straight, 2 bent.
    frames : how many frames it goes through, at least 5.
    """

    order: int
    frames: int


@dataclass(frozen=True, kw_only=True)
class Bridge:
    """A path through one gap.

    Attributes
    ----------
    start, stop : the gap's frames.
    path : (stop - start, C)
    bend : (C,) [unit/frame^2] root mean square acceleration of the path.
    supported : whether measured frames too few for a velocity had to support it.
    """

    start: int
    stop: int
    path: Floats
    bend: Floats
    supported: bool


def slope_weights(times: Ints, order: int) -> Floats:
    """(N,) weights that turn samples into the slope at time 0 of a fitted polynomial.

    Parameters
    ----------
    times : (N,) [frames]; the order is lowered where they are too few for it.
    """
    return _slope_weights(tuple(times.tolist()), min(order, max(len(times) - 2, 1)))


@lru_cache(maxsize=1024)
def _slope_weights(times: tuple[int, ...], order: int) -> Floats:
    powers = np.vander(np.array(times, dtype=float), order + 1, increasing=True)
    return np.asarray(np.linalg.pinv(powers)[1])


def hermite(share: Floats, span: float, ends: tuple[Floats, ...]) -> Floats:
    """(N, C) the path of the module's first formula.

    Parameters
    ----------
    share : (N,) s, 0 at the one end and 1 at the other.
    span : T [frames].
    ends : x0, v0, x1, v1, each (C,).
    """
    x0, v0, x1, v1 = ends
    s = share[:, None]
    rise = s * s * (3.0 - 2.0 * s)
    return np.asarray(
        (1.0 - rise) * x0 + rise * x1 + span * s * (1.0 - s) * ((1.0 - s) * v0 - s * v1)
    )


def bend_of(span: float, x0: Floats, v0: Floats, x1: Floats, v1: Floats) -> Floats:
    """Mean square acceleration [unit^2/frame^4] of the path of least acceleration."""
    slope = (x1 - x0) / span
    first = (6.0 * slope - 4.0 * v0 - 2.0 * v1) / span
    last = (-6.0 * slope + 2.0 * v0 + 4.0 * v1) / span
    return np.asarray((first * first + first * last + last * last) / 3.0)


def bridge(
    values: Floats,
    known: Bools,
    cluster: Cluster,
    fit: EndFit,
    reach: int,
    sure: Bools | None = None,
) -> list[Bridge]:
    """Lay paths of least acceleration through the gaps of one cluster.

    Parameters
    ----------
    values : (T, C), read where ``known``.
    known : (T,)
    cluster : gaps of ``known`` that are not refused.
    fit : how the velocities at the outer ends are found.
    reach : [frames] how far from an end to look for frames to fit.
    sure : (T,) frames to fit where they are known and the end is one; all if not given.
    """
    expect_shape("values", values, len(known), "C")
    slopes = []
    for end, step in ((cluster.start - 1, -1), (cluster.stop, 1)):
        tell = known & sure if sure is not None and sure[end] else known
        frames = nearest(tell, end, step, fit.frames, reach)
        weights = slope_weights(frames - end, fit.order)
        slopes.append(weights @ values[frames] if len(frames) > 1 else None)
    if len(cluster.gaps) == 1:
        ends = values[cluster.start - 1], values[cluster.stop]
        return [_through_one(cluster.start, cluster.stop, ends, *slopes)]
    return _through_many(values, known, cluster, *slopes)


def nearest(known: Bools, frame: int, step: int, count: int, reach: int) -> Ints:
    """(N,) up to ``count`` known frames from ``frame`` on, nearest first.

    Parameters
    ----------
    step : 1 to look onwards, -1 to look back.
    reach : [frames] how far to look, if that gives more than ``count`` frames to choose
        from; never less far than needed for one frame.
    """
    stop = frame + step * max(reach, count)
    frames = np.arange(frame, stop, step)
    frames = frames[(frames >= 0) & (frames < len(known))]
    return frames[known[frames]][:count]


def _through_one(
    start: int,
    stop: int,
    ends: tuple[Floats, Floats],
    v0: Floats | None,
    v1: Floats | None,
) -> Bridge:
    span, (x0, x1) = float(stop - start + 1), ends
    mean = (x1 - x0) / span
    if v0 is None:
        v0 = mean if v1 is None else 1.5 * mean - 0.5 * v1
    v1 = 1.5 * mean - 0.5 * v0 if v1 is None else v1
    share = np.arange(1, stop - start + 1) / span
    return Bridge(
        start=start,
        stop=stop,
        path=hermite(share, span, (x0, v0, x1, v1)),
        bend=np.sqrt(bend_of(span, x0, v0, x1, v1)),
        supported=False,
    )


def _through_many(
    values: Floats,
    known: Bools,
    cluster: Cluster,
    v0: Floats | None,
    v1: Floats | None,
) -> list[Bridge]:
    first, last = cluster.start - 1, cluster.stop
    times, knots = [float(first)], [values[first]]
    for left, right in zip(cluster.gaps[:-1], cluster.gaps[1:], strict=True):
        between = np.arange(left.stop, right.start)
        times.append(float(between.mean()))
        knots.append(values[between].mean(axis=0))
    times.append(float(last))
    knots.append(values[last])
    free = 2, np.zeros(values.shape[1])
    ends = free if v0 is None else (1, v0), free if v1 is None else (1, v1)
    from scipy.interpolate import CubicSpline  # 0.2 s, which few takes need

    spline = CubicSpline(times, np.array(knots), bc_type=ends)
    found = []
    for gap in cluster.gaps:
        frames = np.arange(gap.start - 1, gap.stop + 1)
        path = spline(frames)
        share = np.linspace(0.0, 1.0, len(frames))[:, None]
        path += (1.0 - share) * (values[gap.start - 1] - path[0])
        path += share * (values[gap.stop] - path[-1])
        bend = np.sqrt(np.mean(spline(frames, 2) ** 2, axis=0))
        found.append(
            Bridge(
                start=gap.start,
                stop=gap.stop,
                path=path[1:-1],
                bend=bend,
                supported=True,
            )
        )
    return found
