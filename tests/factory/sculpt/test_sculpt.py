"""The template's skin as the code makes it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from handclean.factory.sculpt.anatomy import anatomy
from handclean.factory.sculpt.sculpt import make_template
from handclean.factory.sculpt.weights import (
    WHOLE_SHARE,
    closed_up,
    finger_shares,
    skin_weights,
)
from handclean.hand import template_surface as t

ROUGH = {"edge": 0.006, "coarse": 0.009, "cell": 0.004}


@pytest.fixture(scope="module")
def flesh():
    return anatomy()


def skin_places(flesh, rng, count):
    """(N, 3) [m] on the spread hand's skin, at random."""
    low, high = np.array([-0.06, -0.02, -0.03]), np.array([0.08, 0.18, 0.02])
    points = rng.uniform(low, high, size=(20 * count, 3))
    points = points[np.abs(flesh.distance(points)) < 0.003][:count]
    return flesh.onto_skin(points, steps=6)


def test_the_same_bytes_come_out_twice(tmp_path):
    written = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        written.append(make_template(tmp_path / name, **ROUGH))
    for one, two in zip(*written, strict=True):
        assert one.read_bytes() == two.read_bytes()


def test_places_go_onto_the_skin(flesh, rng):
    places = skin_places(flesh, rng, 300)
    assert np.quantile(np.abs(flesh.distance(places)), 0.97) < 1e-5


def test_spreading_the_zero_posture_gives_back_the_spread_one(flesh, rng):
    places = skin_places(flesh, rng, 300)
    shares = finger_shares(flesh, places)
    zero, turn = closed_up(flesh, places, shares)
    h = 1e-7
    ahead, _ = closed_up(flesh, places + h * turn[:, :, 0], shares)
    np.testing.assert_allclose(
        (ahead - zero) / h, np.eye(3)[:1].repeat(300, 0), atol=1e-6
    )


def test_shares_are_whole_numbers_that_sum_up(flesh, rng):
    shares = finger_shares(flesh, skin_places(flesh, rng, 300))
    bones, weights = skin_weights(np.hstack(shares))
    assert (weights.sum(axis=1) == WHOLE_SHARE).all()
    assert (np.diff(weights, axis=1) <= 0).all()
    assert all(len(set(row)) == 4 for row in bones.tolist())


@pytest.mark.slow
def test_what_ships_is_what_the_code_makes(tmp_path, monkeypatch):
    shipped = t.shipped_skin()
    made, _ = make_template(tmp_path)
    monkeypatch.setattr(t, "SHIPPED", made)
    again = t.shipped_skin.__wrapped__()
    for one, two in ((shipped.fine, again.fine), (shipped.coarse, again.coarse)):
        assert len(two.vertices) == pytest.approx(len(one.vertices), rel=0.01)
        gap, _ = cKDTree(one.vertices).query(two.vertices)
        assert gap.max() < 0.003
    assert shipped.landmarks.keys() == again.landmarks.keys()
