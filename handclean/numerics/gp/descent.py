"""Minimum of a smooth function of few variables, in few evaluations.

Evaluations of the evidence with all samples are dear, those with a subset are cheap:
so this is BFGS on the Hessian itself, which may start from one that is known (from the
subset), inside bounds. Variables at a bound that push outward are left out of a step;
a step is at most ``reach`` in any variable and is shortened to the minimum of a
parabola until the function falls (Armijo). Powell's damping keeps the Hessian positive.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats

Function = Callable[[Floats], tuple[float, Floats]]


@dataclass(frozen=True, kw_only=True)
class Descent:
    """Where it ended.

    Attributes
    ----------
    point, value, gradient : the best there was.
    hessian : as BFGS knows it.
    evaluations : how many.
    converged : False if it was stopped.
    """

    point: Floats
    value: float
    gradient: Floats
    hessian: Floats
    evaluations: int
    converged: bool


@dataclass(frozen=True)
class _Place:
    """A point with the function's value and gradient there."""

    point: Floats
    value: float
    gradient: Floats


def descend(
    function: Function,
    start: Floats,
    lower: Floats,
    upper: Floats,
    *,
    hessian: Floats | None = None,
    tolerance: float = 1e-3,
    evaluations: int = 200,
    reach: float = 2.0,
) -> Descent:
    """Go down from ``start``.

    Parameters
    ----------
    function : gives value and gradient; infinite where it is not defined.
    hessian : positive definite; as good as the gradient tells otherwise.
    tolerance : stop when a step promises, or brought, less than that.
    evaluations : how many at most.
    reach : longest step in any variable.
    """
    start = np.clip(start, lower, upper)
    here = _Place(start, *function(start))
    count, fresh = 1, hessian is None
    matrix = _first(here.gradient) if hessian is None else hessian
    converged = False
    while count < evaluations and np.isfinite(here.value):
        step = _step(matrix, here, lower, upper, reach)
        promise = -float(here.gradient @ step)
        if promise < tolerance:
            converged = True
            break
        there, tried = _search(function, here, step, lower, upper, evaluations - count)
        count += tried
        if there is None and fresh:
            break
        if there is None:
            matrix, fresh = _first(here.gradient), True
            continue
        moved, turned = there.point - here.point, there.gradient - here.gradient
        if fresh and moved @ turned > 0.0:
            matrix = np.eye(len(moved)) * (turned @ turned) / (moved @ turned)
        matrix, fresh = _updated(matrix, moved, turned), False
        converged = max(here.value - there.value, 0.1 * promise) < tolerance
        here = there
        if converged:
            break
    return Descent(
        point=here.point,
        value=here.value,
        gradient=here.gradient,
        hessian=matrix,
        evaluations=count,
        converged=converged,
    )


def _first(gradient: Floats) -> Floats:
    """Hessian with which the first step is of length 1."""
    return np.eye(len(gradient)) * max(float(np.linalg.norm(gradient)), 1e-12)


def _step(
    matrix: Floats, here: _Place, lower: Floats, upper: Floats, reach: float
) -> Floats:
    """Newton's step in the variables that may move, no longer than ``reach``."""
    pressed_down = (here.point <= lower) & (here.gradient > 0.0)
    pressed_up = (here.point >= upper) & (here.gradient < 0.0)
    free = ~(pressed_down | pressed_up)
    step = np.zeros(len(here.point))
    if free.any():
        step[free] = -np.linalg.solve(matrix[np.ix_(free, free)], here.gradient[free])
        longest = float(np.abs(step).max())
        if longest > reach:
            step *= reach / longest
    inside: Floats = np.clip(here.point + step, lower, upper) - here.point
    if here.gradient @ inside > 0.0:  # cutting at a bound may turn the step uphill
        inside = np.where(inside * here.gradient < 0.0, inside, 0.0)
    return inside


def _search(
    function: Function,
    here: _Place,
    step: Floats,
    lower: Floats,
    upper: Floats,
    evaluations: int,
) -> tuple[_Place | None, int]:
    """Shorten a step until the function falls enough; None if it does not."""
    slope, share = float(here.gradient @ step), 1.0
    for tried in range(1, min(evaluations, 12) + 1):
        point = np.clip(here.point + share * step, lower, upper)
        there = _Place(point, *function(point))
        if there.value <= here.value + 1e-4 * share * slope:
            return there, tried
        bend = there.value - here.value - share * slope
        best = -0.5 * slope * share**2 / bend if np.isfinite(bend) else 0.0
        share = float(np.clip(best, 0.1 * share, 0.5 * share))
    return None, min(evaluations, 12)


def _updated(matrix: Floats, moved: Floats, turned: Floats) -> Floats:
    """BFGS with Powell's damping."""
    pushed = matrix @ moved
    size, curvature = float(moved @ pushed), float(moved @ turned)
    if not size > 0.0:
        return matrix
    if curvature < 0.2 * size:
        mix = 0.8 * size / (size - curvature)
        turned = mix * turned + (1.0 - mix) * pushed
        curvature = float(moved @ turned)
    updated: Floats = (
        matrix - np.outer(pushed, pushed) / size + np.outer(turned, turned) / curvature
    )
    return updated
