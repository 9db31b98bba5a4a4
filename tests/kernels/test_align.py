"""Alignment recovers a known motion and beats every perturbed one."""

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.kernels.align import align


def aligned(source, target, weight):
    pose = np.full(7, np.nan)
    align(source, target, weight, pose)
    w, x, y, z = pose[3:]
    return Rotation.from_quat([x, y, z, w]), pose[:3]


def test_a_known_motion_is_recovered_whatever_the_turn(rng):
    for _ in range(50):
        source, turn = rng.normal(size=(6, 3)), Rotation.random(rng=rng)
        shift = rng.normal(size=3)
        got, at = aligned(source, turn.apply(source) + shift, rng.random(6) + 0.1)
        np.testing.assert_allclose(got.as_matrix(), turn.as_matrix(), atol=1e-9)
        np.testing.assert_allclose(at, shift, atol=1e-9)


def test_points_without_weight_do_not_count(rng):
    source, turn = rng.normal(size=(6, 3)), Rotation.random(rng=rng)
    target = turn.apply(source)
    target[5] = np.nan
    got, _ = aligned(source, target, np.array([1.0, 1, 1, 1, 1, 0]))
    np.testing.assert_allclose(got.as_matrix(), turn.as_matrix(), atol=1e-9)


def test_no_nearby_motion_has_a_lower_weighted_cost(rng):
    for _ in range(20):
        source, target = rng.normal(size=(2, 7, 3))
        weight = rng.random(7)

        def cost(turn, shift, s=source, t=target, w=weight):
            return (w * ((turn.apply(s) + shift - t) ** 2).sum(1)).sum()

        turn, shift = aligned(source, target, weight)
        best = cost(turn, shift)
        for _ in range(20):
            nudge = Rotation.from_rotvec(rng.normal(scale=0.05, size=3))
            moved = cost(nudge * turn, shift + rng.normal(scale=0.01, size=3))
            assert moved >= best
