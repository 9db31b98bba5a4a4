"""Joint angles of a take: which frames are trusted, and how sure angles are."""

import numpy as np
import pytest
from people import as_take, exercise, person

from handclean.gaps.fill import fill
from handclean.hand.model import marker_positions
from handclean.ik.doubt import (
    angle_uncertainty,
    even_noise,
    uncertainty_of_take,
    zero_sigma,
)
from handclean.ik.noise import marker_noise
from handclean.ik.prior import PosturePrior
from handclean.ik.residual_test import share_left
from handclean.ik.solve import markers_of, solve_markers
from handclean.ik.take import solve
from handclean.io.hdf5.prior import read_prior
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig

NOMINAL_M = 5e-4


@pytest.fixture(scope="module")
def subject():
    one = person(1)
    return calibrate([one.take], one.set, CalibrateConfig(frames=80))[0]


@pytest.fixture
def positions(subject, rng):
    """(60, M, 3) a take of the subject."""
    places = marker_positions(
        subject.model, exercise(rng, subject.model.tree, 60, 50.0)
    )
    return places + rng.normal(scale=2e-4, size=places.shape)


@pytest.mark.parametrize("prior", [None, read_prior()], ids=["standard", "prior"])
def test_frames_whose_markers_cannot_be_the_subjects_are_not_trusted(
    prior, subject, positions
):
    """In solving and in filling, though the markers decide the posture."""
    wrong = np.isin(np.arange(60), np.arange(20, 30))
    index = [n for n, label in enumerate(subject.model.labels) if "INDEX" in label]
    positions[wrong, index[-1]] += 0.06
    take = as_take(positions, subject.model.labels)
    assert solve_markers(subject.model, positions, prior=prior).decided[~wrong].all()
    solved = solve(take, subject, prior=prior).motions["right"]
    filled = fill(take, subject, prior=prior)[0].motions["right"]
    np.testing.assert_array_equal(solved.trusted, ~wrong)
    assert not filled.trusted[wrong].any()
    assert filled.trusted[~wrong].mean() > 0.9


def test_a_quiet_marker_is_as_noisy_as_the_take_in_the_sigma_of_angles(
    subject, positions
):
    """A marker that poses follow wherever it goes has hardly a residual."""
    model = subject.model
    solution = solve_markers(model, positions)
    noise = np.full(len(model.labels), 1e-5)
    seen = np.ones(positions.shape[:2], dtype=bool)
    left = share_left(model, seen)
    even = even_noise(noise, positions, solution.residual, left)
    assert even.min() > 5.0 * noise.max()
    found = uncertainty_of_take(
        subject, positions, solution.poses, solution, noise, None, NOMINAL_M
    ).hinges
    quiet, want = (
        angle_uncertainty(model, solution.poses, seen, one, None, NOMINAL_M).hinges
        for one in (noise, even)
    )
    np.testing.assert_array_equal(found, want)
    assert (found > 4.0 * quiet).all()


def test_sigma_is_what_markers_leave_open_and_the_zero_together(subject, positions):
    take = as_take(positions, subject.model.labels)
    prior = read_prior()
    motion = solve(take, subject, prior=prior).motions["right"]
    model = subject.model
    solution = solve_markers(model, markers_of(take, model), prior=prior)
    noise = marker_noise(model, positions, solution, subject.marker_sigma)
    sigma = uncertainty_of_take(
        subject, positions, solution.poses, solution, noise, prior, NOMINAL_M
    ).hinges
    want = np.sqrt(sigma**2 + zero_sigma(subject) ** 2)
    np.testing.assert_array_equal(motion.angles_sigma, want)


def test_the_motion_has_the_name_it_is_given_and_the_others_stay(subject, positions):
    take = as_take(positions, subject.model.labels)
    one = solve(take, subject)
    two = solve(one, subject, name="again")
    assert set(two.motions) == {"right", "again"}
    assert two.motions["right"] is one.motions["right"]
    assert two.skeletons["again"] is subject.model.tree
    np.testing.assert_array_equal(
        two.motions["again"].angles, one.motions["right"].angles
    )


def test_a_prior_of_other_hinges_is_no_prior(subject, positions):
    take = as_take(positions, subject.model.labels)
    stranger = PosturePrior(
        names=("tail_flexion",),
        mean=np.zeros(1),
        components=np.ones((1, 1)),
        deviations=np.ones(1),
        variance_share=np.ones(1),
    )
    one = solve(take, subject, prior=stranger).motions["right"]
    two = solve(take, subject).motions["right"]
    np.testing.assert_array_equal(one.angles, two.angles)
