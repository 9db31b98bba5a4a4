"""Weighted principal components against the recipe, written out."""

import numpy as np

from handclean.gaps.family import linear, pca


def written_out(donors, places, weights, row):
    """Oracle: SVD of both matrices, one row of the gap, one step a line."""
    frames, count = len(places), donors.shape[1]
    whole = np.hstack([donors.reshape(frames, -1), places])
    mean = whole.mean(axis=0)
    centred = (whole - mean).reshape(frames, count + 1, 3)
    sizes = np.sqrt((centred**2).mean(axis=(0, 2)))
    scaled = (centred * (weights / sizes)[:, None]).reshape(frames, -1)
    zeroed = scaled.copy()
    zeroed[:, -3:] = 0.0
    bases, enough = [], []
    for matrix in (scaled, zeroed):
        _, sigma, rows = np.linalg.svd(matrix, full_matrices=False)
        share = np.cumsum(sigma) / sigma.sum()
        enough.append(int(np.flatnonzero(share >= 0.99)[0]) + 1)
        bases.append(rows)
    full, blind = (rows[: max(enough)].T for rows in bases)
    x = (row.ravel() - mean[:-3]).reshape(count, 3) * (weights / sizes)[:-1, None]
    x = np.append(x.ravel(), np.zeros(3))
    found = full @ (full.T @ (blind @ (blind.T @ x)))
    return found[-3:] * sizes[-1] / weights[-1] + mean[-3:]


def test_slopes_are_the_recipe(rng):
    walk = np.cumsum(rng.normal(scale=1e-3, size=(200, 6, 3)), axis=0)
    donors = walk[:, :5] + rng.normal(scale=0.05, size=(5, 3))
    places = walk[:, :3].mean(axis=1) + 0.1 * walk[:, 5]
    apart = np.zeros(5)
    for m in range(5):
        apart[m] = np.mean(
            [np.linalg.norm(donors[t, m] - places[t]) for t in range(200)]
        )
    near = np.exp(-(apart**2) / (2.0 * (pca.WEIGHT_SCALE * apart.mean()) ** 2))
    weights = np.append(near, 0.02)
    slopes = pca.pca_slopes(donors, places)
    for row in donors[[0, 77, 150]]:
        found = (row - donors.mean(axis=0)).ravel() @ slopes + places.mean(axis=0)
        expected = written_out(donors, places, weights, row)
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_marker_bent_along_with_others_is_found_again(bodies, rng):
    whole = bodies.whole(rng, 400, noise=1e-4, bend=0.003)
    gap, tracks = bodies.gap(3, 200, 260), bodies.without(whole, ([3, 6], 200, 260))
    off = {}
    for filler in (pca, linear):
        path = filler.prepare(tracks)(gap).places
        off[filler] = np.linalg.norm(path - whole[200:260, 3], axis=1).mean()
    assert off[pca] < 0.05 * off[linear]
