"""The joint adjustment: what it weighs, and that nothing shakes it."""

from dataclasses import replace

import numpy as np
import pytest
from people import lengths, person

from handclean.subject import judge
from handclean.subject.adjust import Problem, adjust, marker_noise
from handclean.subject.frames import gather
from handclean.subject.shape import SIZE_NUMBERS, Expectation, Shape, tilt_sigmas
from handclean.subject.start import first_poses, loose


def problem_of(one, targets=None, seen=None, **parts):
    frames = gather([one.take], one.set.labels)
    given = {
        "template": one.model,
        "expect": Expectation(),
        "tilt_rad": tilt_sigmas(one.model, Expectation()),
        "pose_prior": loose(one.model),
        "targets": frames.targets if targets is None else targets,
        "seen": frames.seen if seen is None else seen,
        "camera_m": 0.0002,
        "independent": 30,
        "robust": 10.0,
    }
    return Problem(**{**given, **parts})


def learn(problem, model, poses):
    return adjust(
        problem, Shape(model=model, sizes=np.ones(SIZE_NUMBERS)), poses, 0.001
    )


def sigmas(adjusted):
    """[m] standard deviations of the lengths of the fingers' segments."""
    tree = adjusted.shape.model.tree
    joints = [tree.joints[b] for b in np.flatnonzero(tree.parents > 0)]
    return np.array([judge.lengths(adjusted)[1][joint] for joint in joints])


@pytest.fixture(scope="module")
def one():
    return person(21, "maycock26", frames=200)


@pytest.fixture(scope="module")
def template(one):
    """A hand off by some millimetres from the true one."""
    tree = one.model.tree
    offsets = tree.offsets * np.linspace(0.95, 1.05, len(tree.offsets))[:, None]
    return replace(one.model, tree=replace(tree, offsets=offsets))


def test_camera_noise_alone_lets_every_frame_count(one):
    problem = problem_of(one, camera_m=0.0002)
    assert problem.strength(0.0002) == 1.0
    assert problem.strength(0.0001) == 1.0


def test_so_far_as_residuals_are_not_camera_noise_frames_count_as_few(one):
    problem = problem_of(one, camera_m=0.0)
    assert problem.strength(0.001) == pytest.approx(200 / 30)
    assert problem_of(one, independent=300).strength(0.01) == 1.0
    half = problem_of(one, camera_m=0.001).strength(0.001 * np.sqrt(2.0))
    assert half == pytest.approx(0.5 + 0.5 * 200 / 30)


def test_noise_is_found_whatever_the_unknowns_took_up(rng):
    made = rng.normal(scale=0.002, size=(400, 30, 3))
    flat = made.reshape(400, -1)
    basis, _ = np.linalg.qr(rng.normal(size=(90, 26)))
    left = (flat - flat @ basis @ basis.T).reshape(made.shape)
    distance = np.linalg.norm(left, axis=2)
    distance[rng.random(distance.shape) < 0.05] = 0.5
    distance[:, 0] = np.nan
    found = marker_noise(distance, 26 * 400)
    assert found == pytest.approx(0.002, rel=0.1)


def test_the_true_lengths_come_out_of_another_template(one, template):
    problem = problem_of(one, template=template)
    got = learn(problem, template, one.poses)
    away = lengths(got.shape.model.tree) - lengths(one.model.tree)
    before = lengths(template.tree) - lengths(one.model.tree)
    assert np.sqrt(np.mean(before**2)) > 0.0009
    assert np.sqrt(np.mean(away**2)) < 0.0004
    sigma = sigmas(got)
    assert np.sqrt(np.mean((away / sigma) ** 2)) < 2.0
    assert 0.00005 < sigma.mean() < 0.0006
    assert got.known.sigma_m == pytest.approx(0.0002, rel=0.25)


def test_swapped_labels_in_every_tenth_frame_hardly_matter(one, template):
    problem = problem_of(one, template=template)
    clean = learn(problem, template, one.poses)
    targets, seen = problem.targets.copy(), problem.seen.copy()
    a, b = (one.set.labels.index(name) for name in ("R_INDEX_MID", "R_RING_MID"))
    rows = np.arange(0, 200, 10)
    targets[np.ix_(rows, [a, b])] = targets[np.ix_(rows, [b, a])]
    seen[np.ix_(rows, [a, b])] = seen[np.ix_(rows, [b, a])]
    swapped = problem_of(one, targets, seen, template=template)
    got = learn(swapped, template, one.poses)
    away = lengths(got.shape.model.tree) - lengths(clean.shape.model.tree)
    assert np.abs(away / sigmas(clean)).max() < 1.0
    assert np.abs(away).max() < 0.0005
    assert got.known.sigma_m < 0.0003


def test_poses_from_scratch_lead_to_the_same_hand_as_the_true_ones(one, template):
    problem = problem_of(one, template=template)
    near = learn(problem, template, one.poses)
    scratch, _ = first_poses(template, problem.targets, problem.seen)
    far = learn(problem, template, scratch)
    away = lengths(far.shape.model.tree) - lengths(near.shape.model.tree)
    assert np.abs(away / sigmas(near)).max() < 0.5


def test_without_markers_nothing_is_learnt_and_the_template_stays(one, template):
    seen = np.zeros_like(problem_of(one).seen)
    seen[:, :3] = problem_of(one).seen[:, :3]  # the thumb alone
    problem = problem_of(one, seen=seen, template=template)
    got = learn(problem, template, one.poses)
    tree = got.shape.model.tree
    for joint in ("index_pip", "ring_dip", "little_pip"):
        b = tree.joints.index(joint)
        size = got.shape.sizes[0]
        np.testing.assert_allclose(
            tree.offsets[b], size * template.tree.offsets[b], atol=1e-5
        )
