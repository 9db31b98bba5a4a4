"""What may change about a hand, and what is expected of it."""

from dataclasses import replace

import numpy as np
import pytest
from shapes import random_model

from handclean.hand.marker_set import load_marker_set
from handclean.hand.template import HAND_BREADTH_M, HAND_LENGTH_M, template
from handclean.subject.shape import (
    SIZE_NUMBERS,
    Expectation,
    Shape,
    expected_offsets,
    prior,
    sections,
    tangents,
    tilt_sigmas,
    tilted,
)

EXPECT = Expectation()


def hand(name="xu19", side="right"):
    markers = load_marker_set(name)
    return markers.on(template(side, forearm=markers.forearm))


def expected(shape, template_model):
    return prior(shape, template_model, EXPECT, tilt_sigmas(template_model, EXPECT))


def test_tangents_are_across_the_axis_and_each_other(rng):
    axes = rng.normal(size=(20, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    basis = np.concatenate([axes[:, :, None], tangents(axes)], axis=2)
    gram = np.einsum("dik,dil->dkl", basis, basis)
    np.testing.assert_allclose(gram, np.tile(np.eye(3), (20, 1, 1)), atol=1e-12)


def test_a_tilt_turns_an_axis_by_its_length(rng):
    axes = np.eye(3)
    tilt = 0.3 * tangents(axes)[:, :, 0]
    turned = tilted(axes, tilt)
    np.testing.assert_allclose(np.sum(axes * turned, axis=1), np.cos(0.3))
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1.0)
    np.testing.assert_allclose(np.sum(np.cross(axes, turned) * tilt, axis=1) > 0, True)


def test_a_step_of_nothing_changes_nothing(rng):
    model = random_model(rng)
    here = Shape(model=model, sizes=np.ones(SIZE_NUMBERS))
    there = here.stepped(np.zeros(sum(sections(model))))
    np.testing.assert_array_equal(there.model.tree.offsets, model.tree.offsets)
    np.testing.assert_array_equal(there.model.at, model.at)
    np.testing.assert_allclose(there.model.tree.axes, model.tree.axes, atol=1e-15)


def test_the_template_is_exactly_what_is_expected():
    model = hand()
    errors, _ = expected(Shape(model=model, sizes=np.ones(SIZE_NUMBERS)), model)
    np.testing.assert_allclose(errors, 0.0, atol=1e-12)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_hand_larger_in_both_ways_is_the_template_of_that_size(side):
    model = template(side)
    large = template(side, 1.1 * HAND_LENGTH_M, 1.1 * HAND_BREADTH_M)
    wanted, _ = expected_offsets(
        replace(hand("maycock26", side), tree=model), np.array([1.1, 1.1])
    )
    np.testing.assert_allclose(wanted, large.offsets[1:], atol=1e-12)


def test_the_derivative_of_the_expectation_is_that_of_differences(rng):
    template_model = hand()
    numbers = sum(sections(template_model))
    here = Shape(model=template_model, sizes=np.ones(SIZE_NUMBERS))
    here = here.stepped(rng.normal(scale=0.003, size=numbers))
    _, rows = expected(here, template_model)
    h = 1e-6
    for n in range(numbers):
        step = np.zeros(numbers)
        step[n] = h
        ahead, _ = expected(here.stepped(step), template_model)
        behind, _ = expected(here.stepped(-step), template_model)
        np.testing.assert_allclose(rows[:, n], (ahead - behind) / (2 * h), atol=1e-4)


def test_the_expectation_leaves_no_number_open():
    model = hand()
    _, rows = expected(Shape(model=model, sizes=np.ones(SIZE_NUMBERS)), model)
    assert np.linalg.matrix_rank(rows) == rows.shape[1]


def test_one_bone_a_standard_deviation_longer_costs_about_one():
    model = hand()
    tree = model.tree
    b = tree.bone("index_middle")
    offsets = tree.offsets.copy()
    offsets[b] *= 1.0 + EXPECT.length
    longer = replace(model, tree=replace(tree, offsets=offsets))
    errors, _ = expected(Shape(model=longer, sizes=np.ones(SIZE_NUMBERS)), model)
    np.testing.assert_allclose(errors @ errors, 1.0, rtol=1e-9)
