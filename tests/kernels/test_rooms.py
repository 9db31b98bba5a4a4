"""No kernel of inverse kinematics writes beyond its room, however small the tree."""

import numpy as np
import pytest
from trees import KINDS, moving, seen_of

from handclean.hand.model import marker_positions
from handclean.ik.solve import chain_of, start_postures
from handclean.kernels import gauss_newton as gn

BEYOND = 1234.5
"""What stands behind each room, and stays."""


def fenced(work):
    """The same rooms, each with something behind it; and what is behind."""
    rooms, fences = [], []
    for room in work:
        whole = np.full(room.size + 64, BEYOND)
        whole[: room.size] = 0.0
        rooms.append(whole[: room.size].reshape(room.shape))
        fences.append(whole[room.size :])
    return gn.Work(*rooms), fences


@pytest.fixture(params=KINDS.values(), ids=KINDS.keys())
def subject(request, rng):
    return request.param(rng)


@pytest.mark.parametrize("directions", [0, 2, 40])
def test_solving_in_a_subspace_stays_in_its_rooms(subject, directions, rng):
    model = subject.model
    hinges, markers = len(model.tree.hinges), len(model.labels)
    work, fences = fenced(gn.make_work(hinges, markers, directions))
    pose = moving(rng, model.tree, 2)[1]
    target, weight = seen_of(rng, subject, pose[None], gaps=False)[0], np.ones(markers)
    basis = np.ascontiguousarray(rng.normal(scale=0.2, size=(hinges, directions)))
    chain, start = chain_of(model), pose.copy()
    start[:3] += 0.01
    mean = start_postures(model, np.zeros(hinges))[0]
    before = gn.misfit(start, target, weight, chain, work)
    after = gn.solve_subspace(
        start, target, weight, chain, work, mean, basis, 5e-4, 1e-8, 20, 1e-5
    )
    for name, fence in zip(gn.Work._fields, fences, strict=True):
        assert (fence == BEYOND).all(), name
    assert np.isfinite(start).all()
    assert hinges > 0 or after < 0.1 * before


def test_solving_for_everything_stays_in_its_rooms(subject, rng):
    model = subject.model
    hinges, markers = len(model.tree.hinges), len(model.labels)
    work, fences = fenced(gn.make_work(hinges, markers))
    pose = moving(rng, model.tree, 2)[1]
    target, weight = marker_positions(model, pose[None])[0], np.ones(markers)
    chain, found, still = chain_of(model), pose.copy(), np.zeros(hinges)
    found[:3] += 0.01
    is_open, size = np.ones(hinges, dtype=bool), hinges + 6
    level = gn.undecided(found, target, weight, chain, work, 1e-8, 2e-3, is_open)
    gn.solve_full(
        found, target, weight, chain, work, pose[7:].copy(), still, 1e-9, 50, 1e-7
    )
    square = np.full((size + 1, size), np.nan)
    gn.known_with(weight, chain, work, np.eye(hinges), 5e-4, (0.25, 0.4), square)
    for name, fence in zip(gn.Work._fields, fences, strict=True):
        assert (fence == BEYOND).all(), name
    assert level == 0
    np.testing.assert_allclose(
        marker_positions(model, found[None])[0], target, atol=1e-5
    )
