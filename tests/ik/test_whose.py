"""Why markers do not fit a subject: its unit, its person, its side or its names."""

from dataclasses import replace

import numpy as np
import pytest
from people import exercise, person

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.ik.whose import MAX_ERROR_RATIO, MIN_DISTANCE_M, pairs, reason
from handclean.tree import MIRROR


@pytest.fixture(scope="module")
def subject():
    one = template_subject(load_marker_set("maycock26"))
    return replace(one, calibrated=True, marker_sigma=np.full(26, 5e-4))


@pytest.fixture
def seen(subject, rng):
    places = marker_positions(
        subject.model, exercise(rng, subject.model.tree, 40, 50.0)
    )
    return places + rng.normal(scale=2e-4, size=places.shape)


def test_pairs_sit_on_one_bone_apart_from_each_other(subject):
    model = subject.model
    both = pairs(subject)
    assert len(both) > 2
    one, two = both.T
    np.testing.assert_array_equal(model.bone[one], model.bone[two])
    assert (
        np.linalg.norm(model.at[one] - model.at[two], axis=1) >= MIN_DISTANCE_M
    ).all()
    assert (one < two).all()


@pytest.mark.parametrize("size", [1e-3, 10.0, 1e3])
def test_distances_of_no_hand_are_another_unit(subject, seen, size):
    assert f"{size:.3g} times as far apart" in reason(subject, size * seen)


def test_distances_that_are_wrong_by_millimetres_are_another_person(subject, rng):
    other = person(3).model
    there = marker_positions(other, exercise(rng, other.tree, 40, 50.0))
    assert "another person's subject" in reason(subject, there)


@pytest.mark.parametrize(("share", "other"), [(0.7, False), (1.4, True)])
def test_how_far_distances_may_be_off_goes_with_the_subjects_own_sigma(
    subject, share, other
):
    """All distances are off by one factor, and so by a known mean square."""
    model = subject.model
    places = marker_positions(model, neutral_pose(model.tree)[None])
    one, two = pairs(subject).T
    lengths = np.linalg.norm(places[0, one] - places[0, two], axis=1)
    most = MAX_ERROR_RATIO * np.sqrt(np.mean(subject.marker_sigma**2))
    size = 1.0 + share * most / np.sqrt(np.mean(lengths**2))
    assert ("another person's subject" in reason(subject, size * places)) == other


def test_the_subjects_own_distances_mean_the_other_side_or_exchanged_names(
    subject, seen
):
    assert "the other hand, or exchanged names" in reason(subject, seen * MIRROR)


def test_a_hand_nobody_measured_does_not_tell_people_apart(subject, seen):
    bare = replace(subject, marker_sigma=np.full(26, np.nan))
    assert reason(bare, seen) == "another marker set, or the other hand?"


def test_one_pair_in_sight_tells_nothing(subject, seen):
    both = pairs(subject)
    few = np.full_like(seen, np.nan)
    few[:, both[0]] = seen[:, both[0]]
    text = reason(subject, few)
    assert text == "another person's subject, the other hand, or exchanged names?"
