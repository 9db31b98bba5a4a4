"""What makes a coarse mesh fine enough to be drawn keeps its shape."""

import numpy as np

from handclean.factory.rig_drawing import quartered
from handclean.hand.surface import is_closed, volume
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface


def test_a_mesh_cut_into_quarters_is_the_same_shape():
    skin = template_surface(template("left"), coarse=True)
    colors = np.tile([0.25, 0.5, 0.75], (len(skin.vertices), 1))
    faces, places, paint = quartered(skin.faces, skin.vertices, colors)
    assert len(faces) == 4 * len(skin.faces)
    assert is_closed(faces)
    assert np.isclose(volume(places, faces), volume(skin.vertices, skin.faces))
    np.testing.assert_allclose(paint, np.tile([0.25, 0.5, 0.75], (len(places), 1)))
