"""Simulated scans: what is seen of a hand, and what is true of it."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.errors import UsageError
from handclean.hand import surface as s
from handclean.hand.skinning import posed
from handclean.hand.template import template
from handclean.hand.template_surface import landmarks, template_surface
from handclean.numerics.triangles import closest
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.shaping import reshaped
from handclean.simulation.simulate import simulate_one, simulate_scan

FEW = SimulateConfig(scan_points=4000, seed=3)


@pytest.fixture(scope="module")
def scan():
    return simulate_scan("scan", FEW, 0)


def test_reshaping_moves_the_skin_by_millimetres_and_keeps_it_closed(rng):
    tree = template("right")
    before = template_surface(tree, coarse=True)
    after = reshaped(before, tree, rng)
    moved = np.linalg.norm(after.vertices - before.vertices, axis=1)
    assert 2e-4 < np.median(moved) < 3e-3
    assert moved.max() < 0.012
    assert s.volume(after.vertices, after.faces) > 0.0
    np.testing.assert_array_equal(after.faces, before.faces)


def test_most_points_of_the_hand_lie_on_the_true_skin_but_for_noise(scan):
    feet = closest(scan.skin, scan.subject.surface.faces, scan.points)
    near = feet.distance < 3.0 * FEW.scan_noise_m
    assert np.count_nonzero(near) > 0.9 * FEW.scan_points


def test_the_cloud_has_a_table_a_sleeve_and_floating_points(scan):
    feet = closest(scan.skin, scan.subject.surface.faces, scan.points)
    assert np.count_nonzero(np.abs(scan.points[:, 2]) < 0.002) > 1000
    assert np.count_nonzero((feet.distance > 0.003) & (feet.distance < 0.02)) > 20


def test_the_true_skin_is_the_true_hand_in_the_true_pose(scan):
    tree, surface = scan.subject.model.tree, scan.subject.surface
    np.testing.assert_allclose(scan.skin, posed(surface, tree, scan.pose[None])[0])


def test_landmarks_are_set_within_millimetres(scan):
    for name, vertex in landmarks(scan.subject.model.tree).items():
        off = np.linalg.norm(scan.landmarks[name] - scan.skin[vertex])
        assert off < 0.01, name


def test_normals_look_away_from_the_skin(scan):
    feet = closest(scan.skin, scan.subject.surface.faces, scan.points)
    near = feet.distance < 0.001
    flat = s.face_normals(scan.skin, scan.subject.surface.faces)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    cosine = np.einsum("pk,pk->p", flat[feet.face[near]], scan.normals[near])
    assert np.mean(cosine > 0.8) > 0.95


def test_a_subject_keeps_its_shape_from_scan_to_scan():
    settings = replace(FEW, scan_points=1000)
    one, two = (simulate_scan("scan", settings, number) for number in (0, 1))
    np.testing.assert_array_equal(
        one.subject.surface.vertices, two.subject.surface.vertices
    )
    assert np.abs(one.pose - two.pose).max() > 0.01


def test_the_same_seed_gives_the_same_points(scan):
    np.testing.assert_array_equal(scan.points, simulate_scan("scan", FEW, 0).points)


def test_a_scan_is_no_take():
    with pytest.raises(UsageError, match="no takes"):
        simulate_one("scan", SimulateConfig(), 0)
