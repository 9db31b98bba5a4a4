"""Assignment with gates and a price for "no match".

Given costs c_mp of giving point p to row m, and a price a_m for leaving row m without
any, minimise the sum of the costs of the pairs chosen and the prices of the rows left,
each point given at most once. A cost that is not finite is a gate: the pair is never
chosen. This is the Hungarian method on the rectangular matrix padded with one private
column per row, at its price, and infinity elsewhere; the padding is never written down.

The method is that of Jonker and Volgenant (A shortest augmenting path algorithm for
dense and sparse linear assignment problems, Computing 38 (1987) 325-340). Dual numbers
u_m, v_p with u_m + v_p <= c_mp and u_m <= a_m are kept, with equality for what is
assigned. Rows whose cheapest point nobody else wants take it; each other row starts
Dijkstra's search over reduced costs and ends at a free point, or at the private column
of a row that it has met, which then goes without. A row that went without never comes
back: later rows only make points scarcer.
"""

import math

import numpy as np

from handclean.arrays import Floats, Ints, expect_shape
from handclean.errors import ShapeError
from handclean.kernels import jit

NO_POINT = -1
"""Stands for "no point" in an assignment."""


@jit
def _take_the_free(
    cost: Floats, price: Floats, u: Floats, owner: Ints, chosen: Ints
) -> int:
    """Give every row its cheapest point or its price, first come first served.

    Returns
    -------
    How many rows are still to be assigned; they are marked -2 in ``chosen``.
    """
    left = 0
    for m in range(cost.shape[0]):
        best, at = price[m], NO_POINT
        for p in range(cost.shape[1]):
            if cost[m, p] < best:
                best, at = cost[m, p], p
        u[m] = best
        if at == NO_POINT:
            chosen[m] = NO_POINT
        elif owner[at] == NO_POINT:
            chosen[m] = at
            owner[at] = m
        else:
            chosen[m] = -2
            left += 1
    return left


@jit
def assign_rows(cost: Floats, price: Floats, chosen: Ints) -> None:
    """Write the cheapest assignment.

    Parameters
    ----------
    cost : (M, P) of giving point p to row m; inf or NaN where that is out of the gate.
    price : (M,) of leaving row m without; finite.
    chosen : (M,) the point of each row, -1 for none; overwritten in full.
    """
    rows, points = cost.shape
    u, v = np.zeros(rows), np.zeros(points)
    owner = np.full(points, NO_POINT)
    if _take_the_free(cost, price, u, owner, chosen) == 0:
        return
    reach, before = np.zeros(points), np.zeros(points, dtype=np.int64)
    done = np.zeros(points, dtype=np.bool_)
    for first in range(rows):
        if chosen[first] != -2:
            continue
        reach[:] = math.inf
        done[:] = False
        row, here = first, 0.0
        without, least, end = NO_POINT, math.inf, NO_POINT
        while True:
            if here + price[row] - u[row] < least:
                least, without = here + price[row] - u[row], row
            nearest, at = math.inf, NO_POINT
            for p in range(points):
                if done[p]:
                    continue
                through = here + cost[row, p] - u[row] - v[p]
                if through < reach[p]:
                    reach[p], before[p] = through, row
                if reach[p] < nearest:
                    nearest, at = reach[p], p
            if least <= nearest:
                here = least
                break
            here = nearest
            if owner[at] == NO_POINT:
                end = at
                break
            done[at] = True
            row = owner[at]
        u[first] += here
        for p in range(points):
            if done[p]:
                u[owner[p]] += here - reach[p]
                v[p] -= here - reach[p]
        if (
            end == NO_POINT
        ):  # the row ``without`` gives its point up, unless it is ``first``
            end = chosen[without]
            chosen[without] = NO_POINT
            if without == first:
                continue
        while True:
            row = before[end]
            owner[end] = row
            end, chosen[row] = chosen[row], end
            if row == first:
                break


def assign(cost: Floats, price: float | Floats = math.inf) -> Ints:
    """Return the cheapest assignment of points to rows.

    Parameters
    ----------
    cost : (M, P) of giving point p to row m; inf or NaN where that is out of the gate.
    price : of leaving a row without a point, one for all or (M,). With the default a
        row goes without only where the gates leave no other way.

    Returns
    -------
    (M,) the point of each row, -1 for none.

    Raises
    ------
    ShapeError
        If the shapes do not fit, a price is NaN, or a cost is -inf.
    """
    expect_shape("cost", cost, "M", "P")
    if np.ndim(price) > 0:
        expect_shape("price", np.asarray(price), len(cost))
    prices = np.ascontiguousarray(np.broadcast_to(price, len(cost)), dtype=np.float64)
    if np.isnan(prices).any() or np.isneginf(prices).any() or np.isneginf(cost).any():
        raise ShapeError("costs and prices should be numbers or +inf")
    open_pairs = np.abs(cost[np.isfinite(cost)])
    most = max([*open_pairs, *np.abs(prices[np.isfinite(prices)]), 1.0])
    prices = np.where(np.isfinite(prices), prices, 4.0 * most * (len(cost) + 1))
    chosen = np.full(len(cost), NO_POINT)
    assign_rows(np.ascontiguousarray(cost, dtype=np.float64), prices, chosen)
    return chosen
