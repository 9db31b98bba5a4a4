"""Pictures of hands: what is in front is seen, where it is, in its colors."""

import numpy as np
import pytest

from handclean.factory.hand_pictures import weight_colors
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.report import drawing as p

PIXEL = 0.002


def silhouette(picture):
    return (picture < 250).any(axis=2)


def test_a_hand_covers_what_its_triangles_cover():
    skin = template_surface(template("right"), coarse=True)
    colors = np.full(skin.vertices.shape, 0.5)
    picture = p.drawn(skin.vertices, skin.faces, colors, p.looking(0.0, 0.0), PIXEL)
    tall, wide = np.ptp(np.argwhere(silhouette(picture)), axis=0) + 1
    assert wide * PIXEL == pytest.approx(np.ptp(skin.vertices[:, 0]), abs=2 * PIXEL)
    assert tall * PIXEL == pytest.approx(np.ptp(skin.vertices[:, 1]), abs=2 * PIXEL)
    closed = silhouette(picture)
    inner = closed[1:-1, 1:-1]
    around = closed[:-2, 1:-1] & closed[2:, 1:-1] & closed[1:-1, :-2] & closed[1:-1, 2:]
    assert inner[around].all()  # no pixel is left out


def test_what_is_nearer_hides_what_is_behind():
    square = np.array([[0.0, 0, 0], [0.02, 0, 0], [0.02, 0.02, 0], [0, 0.02, 0]])
    vertices = np.vstack([square, square + np.array([0, 0, 0.01])])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    faces = np.vstack([faces, faces + 4])
    colors = np.repeat([[1.0, 0, 0], [0, 0, 1.0]], 4, axis=0)
    for azimuth, channel in ((0.0, 2), (180.0, 0)):
        picture = p.drawn(vertices, faces, colors, p.looking(azimuth, 0.0), PIXEL)
        middle = picture[picture.shape[0] // 2, picture.shape[1] // 2]
        assert np.argmax(middle) == channel
        assert np.delete(middle, channel).max() == 0


def test_a_right_hand_seen_from_its_back_has_the_thumb_on_the_left():
    skin = template_surface(template("right"), coarse=True)
    colors = weight_colors(skin, template("right"))
    thumb = np.zeros(colors.shape)
    thumb[np.isin(skin.bones[:, 0], [1, 2, 3])] = [1.0, 0.0, 0.0]
    for azimuth, left in ((0.0, True), (180.0, False)):
        picture = p.drawn(
            skin.vertices, skin.faces, thumb, p.looking(azimuth, 0), PIXEL
        )
        columns = np.flatnonzero((picture[:, :, 0] > picture[:, :, 1]).any(axis=0))
        assert (columns.mean() < picture.shape[1] / 2) == left


def test_pictures_stand_on_one_line():
    small, large = np.zeros((2, 3, 3), np.uint8), np.zeros((4, 1, 3), np.uint8)
    row = p.side_by_side([small, large])
    assert row.shape == (4, 4, 3)
    assert (row[:2, :3] == 255).all()
    assert not row[2:].any()


def test_colors_are_the_bones_where_one_moves_the_skin():
    tree = template("left")
    skin = template_surface(tree)
    colors = weight_colors(skin, tree)
    for b in range(len(tree.bones)):
        alone = (skin.bones[:, 0] == b) & (skin.weights[:, 0] == 1.0)
        assert np.ptp(colors[alone], axis=0).max() < 1e-12
    assert len(np.unique(p.skin_colors(skin), axis=0)) == 2
