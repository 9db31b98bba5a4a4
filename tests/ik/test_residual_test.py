"""Whether a take is the subject's: wrong sides, units and persons are noticed."""

from dataclasses import replace

import numpy as np
import pytest
from people import exercise, true_hand
from told import texts

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik.residual_test import (
    IMPLAUSIBLE_RATIO,
    doubts,
    plausible,
    usual_residual,
)
from handclean.ik.take import solve
from handclean.io.hdf5.prior import read_prior
from handclean.recording import Recording, trajectories

NOISE = 3e-4
MIRROR = np.array([-1.0, 1.0, 1.0])


def calibrated(rng, name="maycock26"):
    """A subject known to its noise, and (T, M, 3) of its markers."""
    markers = load_marker_set(name)
    model = true_hand(rng, markers, markers.side, 1.0)
    poses = exercise(rng, model.tree, 120, 50.0)
    seen = marker_positions(model, poses) + rng.normal(
        scale=NOISE, size=(120, len(model.labels), 3)
    )
    subject = replace(
        template_subject(markers),
        model=model,
        marker_sigma=np.full(len(model.labels), np.sqrt(2.0) * NOISE),
        calibrated=True,
    )
    return subject, seen


def take(positions, subject):
    markers = trajectories(positions, subject.model.labels)
    return Recording(rate=50.0, frames=len(positions), markers=markers)


def solved(positions, subject):
    """Share of trusted frames, and what the remark says."""
    found = solve(take(positions, subject), subject, prior=read_prior())
    trusted = found.motions[subject.model.tree.side].trusted
    return trusted.mean(), "".join(texts(doubts(found, subject)))


@pytest.mark.parametrize(
    ("name", "least"), [("maycock26", 0.99), ("schroeder17", 0.99), ("dfki13", 0.7)]
)
def test_a_subjects_own_take_is_trusted(rng, name, least):
    """Less with two markers on each finger, which may leave its last joint open."""
    subject, seen = calibrated(rng, name)
    share, words = solved(seen, subject)
    assert share > least
    assert words == ""
    gone = rng.random(seen.shape[:2]) < 0.1
    gone[:, ["HAND" not in label.upper() for label in subject.model.labels]] = False
    seen[gone] = np.nan
    assert solved(seen, subject)[0] > share - 0.05


@pytest.mark.parametrize("name", ["maycock26", "dfki13"])
@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (
            MIRROR,
            "are as far apart as this subject's: the other hand, or exchanged names?",
        ),
        (1000.0, "are 1e+03 times as far apart as this subject's"),
        (0.1, "are 0.1 times as far apart as this subject's"),
        (0.001, "are 0.001 times as far apart as this subject's"),
    ],
)
def test_the_wrong_side_or_unit_is_not_trusted_and_said(rng, factor, said, name):
    subject, seen = calibrated(rng, name)
    share, words = solved(seen * factor, subject)
    assert share < 0.02
    assert words.startswith("right: residual ")
    assert words.endswith(
        f"markers of one bone {said}" if factor is not MIRROR else said
    )


@pytest.mark.parametrize("name", ["maycock26", "han19", "dfki13"])
def test_another_persons_subject_is_not_trusted_and_said(rng, name):
    one, seen = calibrated(rng, name)
    other, _ = calibrated(rng, name)
    share, words = solved(seen, replace(other, marker_sigma=one.marker_sigma))
    assert share < 0.05
    assert "mm nearer or farther apart than this subject's: another person's" in words


def test_without_two_markers_on_a_bone_nobody_can_tell_person_from_side(rng):
    subject, seen = calibrated(rng, "schroeder8")
    words = solved(seen * MIRROR, subject)[1]
    assert words.endswith(
        "another person's subject, the other hand, or exchanged names?"
    )


def test_a_template_is_trusted_on_any_right_hand_and_on_no_left_one(rng):
    template = template_subject(load_marker_set("maycock26"))
    _, seen = calibrated(rng)
    for size in (0.9, 1.0, 1.1):
        share, words = solved(seen * size, template)
        assert share > 0.98
        assert words == ""
    share, words = solved(seen * MIRROR, template)
    assert share < 0.3
    assert "the template hand" in words


def test_few_markers_should_leave_less_than_many(rng):
    subject, _ = calibrated(rng)
    seen = np.ones((2, 26), dtype=bool)
    seen[1, ::2] = False
    whole, half = usual_residual(subject.model, subject.marker_sigma, seen)
    assert whole == pytest.approx(np.sqrt(2.0) * NOISE)
    assert half < 0.9 * whole


def test_the_bound_lies_at_far_times_the_usual_residual(rng):
    subject, _ = calibrated(rng)
    seen = np.ones((3, 26), dtype=bool)
    usual = usual_residual(subject.model, subject.marker_sigma, seen)[0]
    residual = np.array(
        [0.99 * IMPLAUSIBLE_RATIO * usual, 1.01 * IMPLAUSIBLE_RATIO * usual, np.nan]
    )
    np.testing.assert_array_equal(
        plausible(subject, seen, residual), [True, False, True]
    )


def test_a_take_that_is_mostly_implausible_has_no_plausible_frame(rng):
    subject, seen = calibrated(rng)
    there = np.isfinite(seen[:, :, 0])
    usual = usual_residual(subject.model, subject.marker_sigma, there)
    for share, left in ((0.3, 0.7), (0.6, 0.0)):
        odd = np.arange(len(usual)) < share * len(usual)
        residual = np.where(odd, 2.0 * IMPLAUSIBLE_RATIO, 1.0) * usual
        assert plausible(subject, there, residual).mean() == pytest.approx(left)
