"""Markers that a set places on vertices of the template's skin."""

import numpy as np
import pytest

from handclean.errors import FileError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.surface import vertex_normals
from handclean.hand.template import template
from handclean.hand.template_surface import landmarks, template_surface

HEAD = 'side = "right"\n[[marker]]\nlabel = "A"\n'


def written(tmp_path, text):
    path = tmp_path / "set.toml"
    path.write_text(HEAD + text)
    return path


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("mark", ["index_tip", "thumb_ip", "middle_knuckle"])
@pytest.mark.parametrize("lift", [0.0, 3.0])
def test_a_marker_sits_on_its_vertex_of_either_hand(tmp_path, side, mark, lift):
    tree = template(side)
    vertex = landmarks(tree)[mark]
    found = load_marker_set(
        written(tmp_path, f"vertex = {vertex}\n" + f"lift = {lift}\n" * (lift > 0))
    )
    skin = template_surface(tree)
    expected = skin.vertices[vertex]
    expected = (
        expected + 1e-3 * lift * vertex_normals(skin.vertices, skin.faces)[vertex]
    )
    (place,) = marker_positions(found.on(tree), neutral_pose(tree)[None])[0]
    np.testing.assert_allclose(place, expected, atol=1e-9)
    assert found.bones[0].startswith(mark.split("_")[0].replace("middle", ""))


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("vertex = 5\nbone = 'hand'", "vertex beside bone or at"),
        ("vertex = -1", "vertex should be a number from 0 to"),
        ("vertex = 1.5", "vertex should be a number from 0 to"),
        ("vertex = 1000000", "vertex should be a number from 0 to"),
        ("vertex = 5\nlift = 'high'", "lift should be"),
        ("bone = 'hand'\nat = [0, 0, 0]\nlift = 3", "lift without vertex"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, text, wrong):
    with pytest.raises(FileError, match=wrong):
        load_marker_set(written(tmp_path, text))
