"""How often markers are hidden."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import Model, neutral_pose
from handclean.hand.surface import rest_joints
from handclean.layouts.optimize import optimize
from handclean.layouts.problem import make_problem
from handclean.layouts.visibility import directions, hidden_share


def test_directions_are_spread_evenly():
    all_round = directions(200)
    np.testing.assert_allclose(np.linalg.norm(all_round, axis=1), 1.0)
    np.testing.assert_allclose(all_round.mean(axis=0), 0.0, atol=0.02)
    np.testing.assert_allclose(all_round.T @ all_round / 200, np.eye(3) / 3, atol=0.02)


def test_a_marker_in_the_air_is_seen_and_one_inside_is_not(tree, surface):
    inside = rest_joints(tree)[tree.bone("middle_proximal")] + [0.0, -0.02, -0.005]
    at = np.array([[0.0, 0.08, 0.4], inside])
    model = Model(tree=tree, labels=("a", "b"), bone=np.zeros(2, dtype=np.int64), at=at)
    shares = hidden_share(model, surface, neutral_pose(tree)[None])
    assert shares[0] < 0.1
    assert shares[1] > 0.5


def test_flat_skin_is_hidden_from_below(tree, surface):
    model = load_marker_set("maycock26").on(tree)
    shares = hidden_share(model, surface, neutral_pose(tree)[None])
    assert ((shares > 0.2) & (shares < 0.6)).all()


def test_a_closing_hand_hides_more(tree, surface):
    fist = neutral_pose(tree)
    bent = [n for n, name in enumerate(tree.hinges) if "pip_flexion" in name]
    fist[7 + np.array(bent)] = 1.7
    below = np.array([[0.0, 0.08, -0.03]])
    model = Model(
        tree=tree, labels=("palm",), bone=np.zeros(1, dtype=np.int64), at=below
    )
    flat, closed = (
        hidden_share(model, surface, pose[None]) for pose in (neutral_pose(tree), fist)
    )
    assert closed[0] > flat[0]


def test_its_weight_brings_markers_into_sight(model, tree, surface, takes, few):
    seeing = replace(few, visibility=500.0, w1=0.01)
    problem = make_problem(model, takes, tree.hinges, seeing, surface=surface)
    assert np.ptp(problem.hidden) > 0.05
    with_it, without = (
        optimize(problem, replace(seeing, visibility=w), np.random.default_rng(0))
        for w in (500.0, 0.0)
    )
    assert with_it.hidden < without.hidden
    assert with_it.hidden == pytest.approx(problem.hidden[with_it.chosen].mean())
