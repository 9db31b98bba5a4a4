"""The contract of the gated assignment, against scipy on the padded matrix."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linear_sum_assignment

from handclean.errors import ShapeError
from handclean.numerics.assignment import NO_POINT, assign

FAR = 1e5
"""Stands for infinity in the oracle; larger than any sum of costs here."""

sizes = st.tuples(st.integers(1, 7), st.integers(1, 7))
numbers = st.one_of(
    st.integers(0, 3).map(float),  # ties
    st.floats(-9, 9, allow_nan=False, width=32),
    st.just(np.inf),
    st.just(np.nan),
)
costs = sizes.flatmap(lambda size: arrays(float, size, elements=numbers))


def padded_optimum(cost, prices):
    """Oracle: the least total, by scipy on the padded square matrix."""
    own = np.full((len(cost), len(cost)), FAR)
    np.fill_diagonal(own, prices)
    full = np.hstack([np.where(np.isfinite(cost), cost, FAR), own])
    return full[linear_sum_assignment(full)].sum()


def total(cost, prices, chosen):
    pairs = [cost[m, p] for m, p in enumerate(chosen) if p != NO_POINT]
    return sum(pairs) + prices[chosen == NO_POINT].sum()


def contract(cost, chosen):
    given_away = chosen[chosen != NO_POINT]
    assert len(set(given_away)) == len(given_away), "a point was given twice"
    assert np.isfinite(cost[chosen != NO_POINT, given_away]).all(), "a gate was passed"


@given(cost=costs, data=st.data())
def test_no_other_assignment_costs_less(cost, data):
    price = st.floats(-5, 9, allow_nan=False, width=32)
    prices = data.draw(arrays(float, len(cost), elements=price))
    chosen = assign(cost, prices)
    contract(cost, chosen)
    best = padded_optimum(cost, prices)
    assert total(cost, prices, chosen) == pytest.approx(best, abs=1e-6)


@given(cost=costs)
def test_without_a_price_as_many_rows_as_the_gates_allow_get_a_point(cost):
    chosen = assign(cost)
    contract(cost, chosen)
    best = padded_optimum(cost, np.full(len(cost), FAR))
    left = np.full(len(cost), FAR)
    assert total(cost, left, chosen) == pytest.approx(best, abs=1e-4)


@pytest.mark.parametrize(("rows", "points"), [(26, 30), (30, 26), (19, 19), (60, 70)])
def test_markers_sized_problems_agree_with_scipy(rows, points, rng):
    for _ in range(20):
        cost = rng.random((rows, points))
        chosen = assign(cost)
        contract(cost, chosen)
        expected = cost[linear_sum_assignment(cost)].sum()
        assert cost[chosen >= 0, chosen[chosen >= 0]].sum() == pytest.approx(expected)
        assert (chosen >= 0).sum() == min(rows, points)


def test_a_row_stays_without_where_its_price_is_lower():
    cost = np.array([[1.0, 5.0], [1.5, 9.0]])
    assert assign(cost, 3.0).tolist() == [0, NO_POINT]
    assert assign(cost, np.array([0.5, 3.0])).tolist() == [NO_POINT, 0]
    assert assign(cost, 9.0).tolist() == [1, 0]


def test_rows_or_points_may_be_none_at_all():
    assert assign(np.zeros((0, 3))).tolist() == []
    assert assign(np.zeros((2, 0))).tolist() == [NO_POINT, NO_POINT]
    assert assign(np.full((2, 2), np.inf)).tolist() == [NO_POINT, NO_POINT]


def test_the_inputs_are_left_alone(rng):
    cost = rng.random((5, 6))
    before = cost.copy()
    assign(cost, 0.3)
    np.testing.assert_array_equal(cost, before)


@given(cost=costs, data=st.data())
def test_the_order_of_the_points_changes_no_total(cost, data):
    order = data.draw(st.permutations(range(cost.shape[1])))
    prices = np.full(len(cost), 2.0)
    one, other = assign(cost, 2.0), assign(cost[:, order], 2.0)
    totals = total(cost, prices, one), total(cost[:, order], prices, other)
    assert totals[0] == pytest.approx(totals[1], abs=1e-6)


@pytest.mark.parametrize("price", [np.nan, -np.inf])
def test_a_price_that_is_no_price_is_refused(price):
    with pytest.raises(ShapeError, match="should be numbers"):
        assign(np.zeros((2, 2)), price)


def test_prices_of_the_wrong_number_are_refused():
    with pytest.raises(ShapeError, match="price"):
        assign(np.zeros((2, 2)), np.zeros(3))
