"""Things that are no hands: labelled, solved and filled as hands are."""

from dataclasses import replace

import numpy as np
import pytest
from trees import KINDS, moving, named, nameless, seen_of, thing

from handclean.gaps.fill import fill
from handclean.ik.solve import solve_markers
from handclean.ik.take import solve
from handclean.io.hdf5.prior import read_prior
from handclean.labels.label import label

SURE = 1.5
"""[deg] three markers of 20 mm around a hinge tell it as well as that."""


@pytest.fixture(params=KINDS.values(), ids=KINDS.keys())
def take(request, rng):
    """Something that moves, and its markers with noise and a short gap."""
    subject = request.param(rng)
    poses = moving(rng, subject.model.tree)
    return subject, poses, seen_of(rng, subject, poses)


@pytest.fixture(params=[True, False], ids=["prior", "none"])
def prior(request):
    return read_prior() if request.param else None


def test_every_point_gets_its_name(take, prior, rng):
    subject, _, seen = take
    there = np.isfinite(seen[:, :, 0])
    there &= (there.sum(axis=1) >= 4)[:, None]  # fewer are no posture
    found, figures = label(nameless(rng, seen), subject, prior=prior)
    right = (found.markers.positions == seen).all(axis=2)
    assert right.sum() >= 0.995 * there.sum()
    assert figures.rms_m < 1e-3


def test_joints_and_place_come_out(take, prior):
    subject, poses, seen = take
    name = subject.model.tree.side or "rigid"
    found = solve(named(seen, subject), subject, prior=prior).motions[name]
    away = np.degrees(np.abs(found.angles - poses[:, 7:]))
    assert found.angles.shape == poses[:, 7:].shape
    assert np.isfinite(found.poses).all()
    assert np.nanmax(found.residual) < 1e-3
    assert np.median(np.linalg.norm(found.translation - poses[:, :3], axis=1)) < 1e-3
    if len(subject.model.tree.hinges) == 1:
        assert away.max() < 2.0 * SURE


def test_short_gaps_are_filled(take, prior):
    subject, poses, seen = take
    found, figures = fill(named(seen, subject), subject, prior=prior)
    assert figures.filled == figures.gaps > 0
    truth = seen_of(np.random.default_rng(0), subject, poses, gaps=False)
    hidden = np.isnan(seen[:, :, 0])
    away = np.linalg.norm(found.markers.positions - truth, axis=2)[hidden]
    assert np.median(away) < 2e-3


def test_a_prior_that_knows_no_hinge_is_none(rng):
    for branches, depth in ((0, 0), (1, 1), (5, 6)):
        subject = thing(rng, branches, depth)
        seen = seen_of(rng, subject, moving(rng, subject.model.tree))
        seen[30:40, 6:] = np.nan  # hinges are open for a while
        with_it = solve_markers(subject.model, seen, prior=read_prior())
        without = solve_markers(subject.model, seen)
        for part in ("poses", "residual", "opened", "decided"):
            one, two = getattr(with_it, part), getattr(without, part)
            np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("size", [(1, 1, 1), (1, 3, 1), (5, 6, 2)])
def test_a_prior_that_knows_a_few_hinges_leads_those(size, rng):
    prior = read_prior()
    subject = thing(rng, *size)
    tree = subject.model.tree
    names = (*prior.names, *tree.hinges)[: len(tree.hinges)]
    model = replace(subject.model, tree=replace(tree, hinges=names))
    subject = replace(subject, model=model)
    seen = seen_of(rng, subject, moving(rng, tree), gaps=False)
    seen[:, 6::2] = np.nan
    seen[20:35, 5:] = np.nan
    found = solve_markers(model, seen, prior=prior)
    assert np.isfinite(found.poses).all()
    assert found.residual.max() < 1e-3
    assert found.opened[25].all()
