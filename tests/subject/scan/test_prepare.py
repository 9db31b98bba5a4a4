from dataclasses import replace

import numpy as np
import pytest
from scanned import coarse_start, scanned
from told import texts

from handclean.errors import HandcleanError
from handclean.subject.scan.prepare import oriented, prepared
from handclean.subject.scan.settings import ScanConfig

SETTINGS = ScanConfig()


@pytest.fixture(scope="module")
def truth():
    return scanned(3, count=6000)


def marks(truth):
    return np.array(list(truth.marks.values()))


def on_table(truth, points):
    """Points of the table are 3 cm under the hand's plane."""
    known = {tuple(row) for row in truth.scan.points[truth.scan.colors[:, 0] == 120]}
    return sum(tuple(row) in known for row in points)


def test_the_table_goes_by_its_color(truth):
    found = prepared(truth.scan, marks(truth), SETTINGS)
    assert on_table(truth, found.scan.points) == 0
    assert found.colored > 100
    assert len(found.scan.points) > 5500
    assert texts(found.remarks) == ()


def test_without_colors_most_of_a_sparse_table_goes_for_being_lonely(truth):
    found = prepared(replace(truth.scan, colors=None), marks(truth), SETTINGS)
    left = on_table(truth, found.scan.points)
    assert left < 0.2 * (left + found.apart + found.lonely)
    assert found.apart + found.lonely > 100
    assert "no colors" in texts(found.remarks)[0]


def test_dark_skin_is_found_by_the_landmarks(truth):
    dark = np.where(truth.scan.colors == 120, 150, truth.scan.colors // 3)
    dark = dark.astype(np.uint8)
    found = prepared(replace(truth.scan, colors=dark), marks(truth), SETTINGS)
    assert on_table(truth, found.scan.points) == 0
    assert len(found.scan.points) > 5500
    assert "colors like theirs" in texts(found.remarks)[0]


def test_points_that_are_no_places_are_left_out_and_told(truth):
    points = truth.scan.points.copy()
    points[5:12] = np.nan
    found = prepared(replace(truth.scan, points=points), marks(truth), SETTINGS)
    assert "7 points" in texts(found.remarks)[0]
    assert np.isfinite(found.scan.points).all()


def test_too_few_points_are_refused(truth):
    with pytest.raises(HandcleanError, match="300 points are left"):
        prepared(truth.scan.only(np.arange(300)), marks(truth), SETTINGS)
    elsewhere = replace(truth.scan, points=truth.scan.points + 9.0)
    with pytest.raises(HandcleanError, match="0 points are left; around its landmarks"):
        prepared(elsewhere, marks(truth), SETTINGS)


@pytest.fixture(scope="module")
def hand(truth):
    """The hand's points only, and the true skin."""
    return truth.scan.only(truth.scan.colors[:, 0] != 120)


def test_normals_that_look_out_are_kept(truth, hand):
    cloud, words = oriented(hand, truth.places, coarse_start().surface)
    assert words == ()
    np.testing.assert_allclose(cloud.normals, hand.normals, atol=1e-9)


def test_inverted_normals_are_turned_round_and_told(truth, hand):
    inverted = replace(hand, normals=-3.0 * hand.normals)
    cloud, words = oriented(inverted, truth.places, coarse_start().surface)
    np.testing.assert_allclose(cloud.normals, hand.normals, atol=1e-9)
    assert "look into the hand" in words[0].text


def test_normals_that_look_both_ways_are_sorted_out(truth, hand, rng):
    sign = rng.choice([-1.0, 1.0], (len(hand.points), 1))
    mixed = replace(hand, normals=sign * hand.normals)
    cloud, words = oriented(mixed, truth.places, coarse_start().surface)
    agree = np.einsum("pk,pk->p", cloud.normals, hand.normals) > 0.0
    assert agree.mean() > 0.99
    assert "look into the hand" in words[0].text


def test_missing_normals_are_found_from_planes(truth, hand):
    cloud, words = oriented(
        replace(hand, normals=None), truth.places, coarse_start().surface
    )
    agree = np.einsum("pk,pk->p", cloud.normals, hand.normals)
    assert np.median(agree) > 0.97
    assert (agree > 0.0).mean() > 0.99
    assert "no normals" in words[0].text


def test_single_missing_normals_are_found_from_planes(truth, hand):
    normals = hand.normals.copy()
    normals[:10] = 0.0
    normals[10:20] = np.nan
    cloud, words = oriented(
        replace(hand, normals=normals), truth.places, coarse_start().surface
    )
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1.0)
    assert "20 points have no normal" in words[0].text
