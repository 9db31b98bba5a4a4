"""A hand is found in one frame, wherever it is and whatever is beside it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.labels.search.align import SearchEffort, is_good_fit, search_frame
from handclean.labels.search.icp import rigid_icp
from handclean.labels.target import scale_target

EFFORT = SearchEffort(postures=4, rotations=0, kept=8)
FULL = SearchEffort(postures=4, rotations=30, kept=8)


def search(hand, points, effort=EFFORT, target=None):
    return search_frame(points, target or hand.target, 7, hand.setup, effort)


def posed(hand, rng, flexion=0.4):
    """Points of a hand that is turned at random."""
    points = hand.points(hand.pose(flexion))[0]
    return Rotation.random(rng=rng).apply(points - points.mean(axis=0))


def test_a_stiff_shape_is_laid_onto_its_points(hand, rng):
    shape = hand.points(hand.pose(0.2, (0.0, 0.0, 0.0)))[0]
    turn, shift = Rotation.random(rng=rng), np.array([0.3, 0.4, 0.5])
    points = turn.apply(shape) + shift
    near = Rotation.from_rotvec([0.1, -0.1, 0.15]) * turn
    far = Rotation.from_rotvec([0.0, 0.0, 2.5]) * turn
    turns = np.array([near.as_matrix(), far.as_matrix()])
    fits = rigid_icp(
        shape, points[rng.permutation(26)], turns, points.mean(axis=0), 0.06
    )
    assert fits.scores[0] < 1e-12 < fits.scores[1]
    found = Rotation.from_quat(np.roll(fits.poses[0, 3:7], -1))
    np.testing.assert_allclose(found.as_matrix(), turn.as_matrix(), atol=1e-6)
    np.testing.assert_allclose(fits.poses[0, :3], shift, atol=1e-6)


def test_every_marker_is_found_whatever_the_order_of_points(hand, rng):
    points = posed(hand, rng)
    order = rng.permutation(hand.markers)
    best = search(hand, points[order])[0]
    np.testing.assert_array_equal(order[best.chosen], np.arange(hand.markers))
    assert is_good_fit(best)
    assert best.frame == 7
    assert best.rms < 1e-3
    assert best.score == pytest.approx(best.rms / hand.target.spacing, abs=0.02)


@pytest.mark.parametrize("flexion", [0.1, 0.7])
def test_other_points_in_view_do_not_matter(hand, rng, flexion):
    points = posed(hand, rng, flexion)
    others = rng.uniform(-0.3, 0.3, size=(10, 3))
    others = others[np.linalg.norm(others[:, None] - points, axis=2).min(axis=1) > 0.03]
    best = search(hand, np.concatenate([others, points]), FULL)[0]
    expected = len(others) + np.arange(hand.markers)
    np.testing.assert_array_equal(best.chosen, expected)


def test_missing_markers_are_missing_and_count_in_the_score(hand, rng):
    points = np.delete(posed(hand, rng), [4, 12], axis=0)
    best = search(hand, points)[0]
    assert np.flatnonzero(best.chosen < 0).tolist() == [4, 12]
    alpha = hand.setup.labelling.alpha
    assert best.score == pytest.approx(alpha * 2 / hand.markers, abs=0.02)


def test_alpha_weighs_what_is_missing(hand, rng):
    points = np.delete(posed(hand, rng), [4, 12], axis=0)
    labelling = replace(hand.setup.labelling, alpha=10.0)
    setup = replace(hand.setup, labelling=labelling)
    best = search_frame(points, hand.target, 0, setup, EFFORT)[0]
    assert best.score == pytest.approx(20 / hand.markers, abs=0.02)


def test_a_template_takes_the_size_of_the_points(hand, rng):
    large = scale_target(hand.target, 1.15)
    template = replace(hand.target, fixed_size=False, sigma=np.full(26, 6e-3))
    pose = hand.pose(0.05, (0.0, 0.0, 0.0))
    shape = replace(hand, target=large).points(pose)[0]
    best = search(hand, Rotation.random(rng=rng).apply(shape), FULL, template)[0]
    assert best.target.spacing == pytest.approx(large.spacing, rel=0.05)
    assert best.rms < 4e-3


def test_what_is_no_hand_is_no_good_fit(hand, rng):
    found = search(hand, rng.uniform(-0.1, 0.1, size=(26, 3)))
    assert not any(is_good_fit(fit) for fit in found)


def test_too_few_points_are_nothing(hand):
    assert search(hand, hand.points(hand.pose())[0][:5]) == []
