"""A hand's skin as data: what is refused, normals, edges, mirror images."""

import numpy as np
import pytest

from handclean.errors import HandcleanError
from handclean.hand import surface as s
from handclean.hand.template import template

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def tetrahedron(**changes):
    bones = np.zeros((4, 4), dtype=np.int64)
    weights = np.tile([1.0, 0, 0, 0], (4, 1))
    parts = {
        "vertices": CORNERS,
        "faces": FACES,
        "bones": bones,
        "weights": weights,
    }
    return s.Surface(**{**parts, **changes})


@pytest.mark.parametrize(
    ("part", "value", "word"),
    [
        ("vertices", np.full((4, 3), np.nan), "finite"),
        ("faces", np.zeros((0, 3), dtype=np.int64), "at least one face"),
        ("faces", FACES + 1, "vertices 0 to 3"),
        ("weights", np.full((4, 4), 0.5), "sum to 1"),
        ("weights", np.tile([2.0, -1, 0, 0], (4, 1)), "negative"),
        ("weights", np.tile([0.4, 0.6, 0, 0], (4, 1)), "largest first"),
        ("bones", np.full((4, 4), -1), "negative"),
    ],
)
def test_a_surface_that_cannot_be_used_is_refused(part, value, word):
    with pytest.raises(HandcleanError, match=word):
        tetrahedron(**{part: value})


def test_a_tetrahedron_is_closed_and_of_known_volume():
    assert s.is_closed(FACES)
    assert not s.is_closed(FACES[1:])
    assert not s.is_closed(np.vstack([FACES[:1, ::-1], FACES[1:]]))
    assert s.volume(CORNERS, FACES) == pytest.approx(1.0 / 6.0)


def test_normals_look_outwards():
    normals = s.vertex_normals(CORNERS, FACES)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    outwards = np.einsum("vk,vk->v", normals, CORNERS - CORNERS.mean(axis=0))
    assert (outwards > 0.0).all()


def test_a_mirror_image_encloses_the_same_volume_and_looks_outwards():
    mirrored = tetrahedron().mirrored()
    assert s.volume(mirrored.vertices, mirrored.faces) == pytest.approx(1.0 / 6.0)


def test_each_edge_is_listed_once():
    expected = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    np.testing.assert_array_equal(s.edges_of(FACES), expected)


def test_joints_of_the_zero_posture_add_up_along_the_finger():
    tree = template("right")
    joints = s.rest_joints(tree)
    tip = tree.bone("index_distal")
    chain = [tree.bone(f"index_{n}") for n in ("proximal", "middle", "distal")]
    np.testing.assert_allclose(joints[tip], tree.offsets[chain].sum(axis=0))
