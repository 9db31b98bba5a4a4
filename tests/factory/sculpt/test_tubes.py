"""Tubes and how they are blended."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from handclean.factory.sculpt.tubes import Tube, blend

FRAME = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


def ball(radius):
    """A tube without a middle: two round caps."""
    ones = np.full(2, radius)
    return Tube(
        origin=np.array([0.1, 0.2, 0.3]),
        frame=FRAME,
        at=np.array([-radius, radius]),
        half=ones,
        back=ones,
        palm=ones,
        caps=(radius, radius),
    )


def test_the_distance_to_a_ball_is_exact(rng):
    points = rng.normal(size=(50, 3))
    tube = ball(0.4)
    expected = np.linalg.norm(points - tube.origin, axis=1) - 0.4
    np.testing.assert_allclose(tube.distance(points), expected, atol=1e-8)


def test_the_skin_is_where_the_distance_is_zero_and_its_slope_is_one():
    tube = Tube(
        origin=np.zeros(3),
        frame=FRAME,
        at=np.array([0.0, 1.0, 2.0]),
        half=np.array([0.3, 0.2, 0.2]),
        back=np.array([0.2, 0.1, 0.1]),
        palm=np.array([0.3, 0.25, 0.2]),
        caps=(0.1, 0.1),
    )
    local = np.array([[0.2, 1, 0], [-0.2, 1, 0], [0, 1, 0.1], [0, 1, -0.25], [0, 2, 0]])
    np.testing.assert_allclose(tube.distance(local @ FRAME.T), 0.0, atol=1e-8)
    out = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, -1], [0, 1, 0]])
    further = tube.distance((local + 1e-4 * out) @ FRAME.T)
    np.testing.assert_allclose(further, 1e-4, rtol=1e-2)


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.01, 1))
def test_blending_is_fair_never_above_the_least_and_exact_where_they_differ(
    a, b, width
):
    one, two = np.array([a]), np.array([b])
    mixed = blend(one, two, width)
    assert mixed == blend(two, one, width)
    assert min(a, b) - 0.25 * width - 1e-12 <= mixed[0] <= min(a, b)
    if abs(a - b) > width:
        assert mixed[0] == min(a, b)
