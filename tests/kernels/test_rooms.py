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
    return gn.Workspace(*rooms), fences


@pytest.fixture(params=KINDS.values(), ids=KINDS.keys())
def subject(request, rng):
    return request.param(rng)


@pytest.mark.parametrize("directions", [0, 2, 40])
def test_solving_in_a_subspace_stays_in_its_rooms(subject, directions, rng):
    model = subject.model
    hinges, markers = len(model.tree.hinges), len(model.labels)
    work, fences = fenced(gn.make_workspace(hinges, markers, directions))
    pose = moving(rng, model.tree, 2)[1]
    target, weight = seen_of(rng, subject, pose[None], gaps=False)[0], np.ones(markers)
    basis = np.ascontiguousarray(rng.normal(scale=0.2, size=(hinges, directions)))
    chain, start = chain_of(model), pose.copy()
    start[:3] += 0.01
    mean = start_postures(model, np.zeros(hinges))[0]
    seen, subspace = gn.Observations(target, weight), gn.Subspace(mean, basis, 5e-4)
    before = gn.misfit(start, seen, chain, work).cost
    alpha, control = np.zeros(directions), gn.StepControl(1e-8, 1e-5, 20)
    after = gn.solve_subspace(start, alpha, seen, subspace, chain, control, work)
    for name, fence in zip(gn.Workspace._fields, fences, strict=True):
        assert (fence == BEYOND).all(), name
    assert np.isfinite(start).all()
    assert hinges > 0 or after < 0.1 * before


def test_solving_for_everything_stays_in_its_rooms(subject, rng):
    model = subject.model
    hinges, markers = len(model.tree.hinges), len(model.labels)
    work, fences = fenced(gn.make_workspace(hinges, markers))
    pose = moving(rng, model.tree, 2)[1]
    target, weight = marker_positions(model, pose[None])[0], np.ones(markers)
    chain, found, still = chain_of(model), pose.copy(), np.zeros(hinges)
    found[:3] += 0.01
    is_open, seen = np.ones(hinges, dtype=bool), gn.Observations(target, weight)
    level = gn.find_open_hinges(found, seen, chain, 1e-8, 2e-3, work, is_open).level
    anchor, control = gn.Anchor(pose[7:].copy(), still), gn.StepControl(1e-9, 1e-7, 50)
    gn.solve_full(found, seen, anchor, chain, control, work)
    fit = gn.misfit(found, seen, chain, work)
    prior = gn.AnglePrior(still, np.eye(hinges), 5e-4)
    made = gn.factored_information(fit, weight, prior, chain, work)
    gn.is_spread_within(made.lower, gn.SpreadLimits(0.25, 0.4), work)
    for name, fence in zip(gn.Workspace._fields, fences, strict=True):
        assert (fence == BEYOND).all(), name
    assert level == gn.ALL_DECIDED
    np.testing.assert_allclose(
        marker_positions(model, found[None])[0], target, atol=1e-5
    )
