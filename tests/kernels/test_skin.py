"""Linear blend skinning against its formula."""

import numpy as np

from handclean.kernels import skin


def some_skin(rng, vertices=60, bones=5, frames=3):
    """Vertices with one to four bones each, and rotations and shifts of the bones."""
    which = np.argsort(rng.random((vertices, bones)), axis=1)[:, :4].astype(np.int64)
    weights = rng.dirichlet(np.ones(4), vertices)
    weights[np.arange(4) >= rng.integers(1, 5, vertices)[:, None]] = 0.0
    weights = -np.sort(-weights, axis=1)
    weights /= weights.sum(axis=1, keepdims=True)
    return (
        rng.normal(size=(vertices, 3)),
        which,
        weights,
        np.linalg.qr(rng.normal(size=(frames, bones, 3, 3)))[0],
        rng.normal(size=(frames, bones, 3)),
    )


def blended(vertices, bones, weights, turn, shift):
    """Oracle: the formula as it stands."""
    carried = np.einsum("vkij,vj->vki", turn[bones], vertices) + shift[bones]
    return np.einsum("vk,vki->vi", weights, carried)


def test_vertices_go_to_the_mean_of_what_their_bones_say(rng):
    vertices, bones, weights, turn, shift = some_skin(rng)
    out = np.full((3, 60, 3), np.nan)
    skin.place_vertices_of_frames(skin.Skin(vertices, bones, weights), turn, shift, out)
    for t in range(3):
        want = blended(vertices, bones, weights, turn[t], shift[t])
        np.testing.assert_allclose(out[t], want, atol=1e-14)


def test_a_bone_without_weight_is_not_even_looked_up(rng):
    vertices, bones, weights, turn, shift = some_skin(rng)
    want, got = np.full((2, 60, 3), np.nan)
    mesh = skin.Skin(vertices, bones, weights)
    skin.place_vertices(mesh, turn[0], shift[0], want)
    wild = np.where(weights > 0.0, bones, 10**6)
    skin.place_vertices(mesh._replace(bones=wild), turn[0], shift[0], got)
    np.testing.assert_array_equal(got, want)


def test_the_mean_transform_carries_vertices_where_skinning_does(rng):
    vertices, bones, weights, turn, shift = some_skin(rng)
    mean = np.full((60, 3, 4), np.nan)
    skin.blend(skin.Skin(vertices, bones, weights), turn[0], shift[0], mean)
    got = np.einsum("vij,vj->vi", mean[:, :, :3], vertices) + mean[:, :, 3]
    want = blended(vertices, bones, weights, turn[0], shift[0])
    np.testing.assert_allclose(got, want, atol=1e-14)
