"""The energy against its equations, and layouts that cannot be judged."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from handclean.kernels.exchange import Others, best_exchange
from handclean.kernels.layouts import layout_energy, make_room
from handclean.layouts.greedy import exchange, unpacked
from handclean.layouts.objective import candidates_of, energies
from handclean.layouts.problem import make_problem
from handclean.layouts.search import random_layouts

WEIGHTS = ((0.1, 100.0, 0.0), (0.1, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 3.0, 40.0))


def energy(problem, layout, w1, w2, w3=0.0):
    """Schroeder 2016, equations 5 to 9, with L squared, and what is not seen."""
    if len(set(layout)) < len(layout):
        return np.inf
    kappas, squares = [], [np.inf]
    for f in range(len(problem.places)):
        rows = np.concatenate([problem.jacobian[f, v] for v in layout])
        kappas.append(np.linalg.cond(rows.T @ rows))
        for a, b in itertools.combinations(layout, 2):
            away = problem.places[f, a] - problem.places[f, b]
            squares.append(away @ away / problem.length_m**2)
    unseen = np.mean([problem.hidden[v] for v in layout])
    distance = -min(squares) if len(layout) > 1 else 0.0
    terms = ((w1, np.mean(kappas)), (w2, distance), (w3, unseen))
    return sum(weight * term for weight, term in terms if weight)


@pytest.fixture(scope="module")
def judged(problem):
    """The problem, with candidates that are hidden to different degrees."""
    hidden = np.random.default_rng(3).random(len(problem.home))
    return replace(problem, hidden=hidden)


def settings_of(few, weights):
    return replace(few, w1=weights[0], w2=weights[1], visibility=weights[2])


def weigh(problem, layout, settings, bound=math.inf, order=None):
    """The compiled energy of one layout."""
    order = np.arange(len(problem.places)) if order is None else order
    candidates = candidates_of(problem, settings)
    room = make_room(len(problem.columns))
    return layout_energy(np.asarray(layout), candidates, order, bound, room)


@pytest.mark.parametrize("weights", WEIGHTS)
@pytest.mark.parametrize("markers", [3, 5, 9])
def test_it_is_what_the_equations_say(judged, few, rng, weights, markers):
    layouts = random_layouts(judged, markers, 20, rng)
    settings = settings_of(few, weights)
    found = energies(judged, layouts, settings)
    true = np.array([energy(judged, row, *weights) for row in layouts])
    sane = (found.kappa < 1e8).all(axis=1) | (weights[0] == 0.0)
    assert sane.any()
    np.testing.assert_allclose(found.total[sane], true[sane], rtol=1e-6)
    for n in np.flatnonzero(sane):
        assert weigh(judged, layouts[n], settings) == pytest.approx(found.total[n])


def test_terms_add_up_and_distances_are_metres(judged, few, rng):
    layouts = random_layouts(judged, 5, 30, rng)
    found = energies(judged, layouts, replace(few, visibility=2.0))
    np.testing.assert_allclose(
        found.total, 0.1 * found.condition + 100.0 * found.distance + 2.0 * found.hidden
    )
    np.testing.assert_allclose(found.condition, found.kappa.mean(axis=1))
    np.testing.assert_allclose(
        found.distance, -((found.smallest_m / judged.length_m) ** 2)
    )


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 1.1, 3.0])
def test_a_bound_only_cuts_what_reaches_it(judged, few, rng, share):
    settings = settings_of(few, WEIGHTS[3])
    for layout in random_layouts(judged, 5, 40, rng):
        full = weigh(judged, layout, settings)
        bound = share * min(full, 1e6)
        cut = weigh(judged, layout, settings, bound, rng.permutation(4))
        if full < bound:
            assert cut == pytest.approx(full, rel=1e-9)
        else:
            assert bound * (1.0 - 1e-9) <= cut <= full * (1.0 + 1e-9)


def test_a_marker_twice_is_infinite_and_nothing_is_nan(judged, few):
    twice = np.array([[3, 40, 3, 90, 120], [7, 7, 7, 7, 7]])
    for weights in WEIGHTS:
        settings = settings_of(few, weights)
        found = energies(judged, twice, settings)
        assert np.isinf(found.total).all()
        assert not np.isnan(found.kappa).any()
        assert [weigh(judged, row, settings) for row in twice] == [math.inf] * 2


def test_markers_on_one_line_leave_a_turn_about_it_open(model, tree, takes, few):
    bone, at = model.bone.copy(), model.at.copy()
    bone[:9], at[:9] = 0, np.outer(np.arange(9), [0.0, 0.001, 0.0])
    rigid = replace(few, keyframes=2)
    stretched = replace(model, bone=bone, at=at)
    problem = make_problem(stretched, takes, tree.hinges, rigid)
    found = energies(problem, np.array([[0, 2, 4, 6, 8]]), rigid)
    assert np.isinf(found.kappa).all()
    assert np.isinf(found.total).all()
    only = energies(problem, np.array([[0, 2, 4, 6, 8]]), replace(rigid, w1=0.0))
    assert only.total[0] == pytest.approx(-100.0 * (0.002 / problem.length_m) ** 2)


def test_one_marker_has_no_distance(judged, few):
    found = energies(judged, np.array([[4]]), replace(few, w1=0.0))
    assert found.total[0] == 0.0
    assert np.isinf(found.smallest_m[0])


@pytest.mark.parametrize("weights", WEIGHTS)
def test_the_best_exchange_is_that_of_all_candidates(judged, few, rng, weights):
    settings = settings_of(few, weights)
    for layout in random_layouts(judged, 5, 6, rng):
        others = layout[1:]
        every = np.arange(len(judged.home))
        tried = np.column_stack([every, np.tile(others, (len(every), 1))])
        totals = energies(judged, tried, settings).total
        found, least = exchange(judged, others, np.inf, settings)
        assert least == pytest.approx(totals.min(), rel=1e-9)
        assert totals[found] == pytest.approx(totals.min(), rel=1e-9)
        none, bound = exchange(judged, others, float(totals.min()) - 1e-6, settings)
        assert none == -1
        assert bound == totals.min() - 1e-6


def test_any_unit_vectors_bound_the_exchange_safely(judged, few, rng):
    """Eigenvectors only make the search fast: others find the same candidate."""
    size, frames = len(judged.columns), len(judged.places)
    others = random_layouts(judged, 4, 1, rng)[0]
    base = judged.grams[others].sum(axis=0)
    values, vectors = np.linalg.eigh(unpacked(base, size))
    pair = []
    for weak, strong in ((0, size - 1), (2, 3)):
        pair.append(
            best_exchange(
                Others(
                    layout=others,
                    matrices=base,
                    weak=np.ascontiguousarray(vectors[:, :, weak]),
                    strong=np.ascontiguousarray(vectors[:, :, strong]),
                    smallest=np.ascontiguousarray(values[:, weak]),
                    largest=np.ascontiguousarray(values[:, strong]),
                ),
                judged.jacobian,
                candidates_of(judged, few),
                np.arange(frames),
                np.inf,
            )
        )
    assert pair[0] == pair[1]
