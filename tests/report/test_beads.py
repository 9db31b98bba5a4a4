"""Markers drawn as spheres are where the markers are, in any posture."""

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.skinning import posed
from handclean.hand.surface import is_closed, volume
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.report.beads import RED, sphere, with_beads


def test_a_sphere_is_closed_and_looks_out():
    vertices, faces = sphere(0.003)
    assert is_closed(faces)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.003)
    ball = 4.0 / 3.0 * np.pi * 0.003**3
    assert 0.8 * ball < volume(vertices, faces) < ball


@pytest.mark.parametrize("side", ["left", "right"])
def test_spheres_go_with_their_markers(side, rng):
    tree = template(side)
    skin, markers = template_surface(tree, coarse=True), load_marker_set("hoyet8")
    model = markers.on(tree)
    dressed = with_beads(skin, model, 0.004)
    pose = neutral_pose(tree)[None]
    pose[0, 7:] = rng.uniform(0.0, 0.8, len(tree.hinges))
    (found,) = posed(dressed, tree, pose)
    (places,) = marker_positions(model, pose)
    count = len(skin.vertices)
    np.testing.assert_array_equal(found[:count], posed(skin, tree, pose)[0])
    balls = found[count:].reshape(8, -1, 3)
    np.testing.assert_allclose(balls.mean(axis=1), places, atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.norm(balls - places[:, None], axis=2), 0.004, atol=1e-9
    )
    assert (dressed.colors[count:] == RED).all()
    assert is_closed(dressed.faces)
