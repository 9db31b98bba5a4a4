"""What layouts are judged by."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.errors import HandcleanError, UnknownNameError, UsageError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, moved, neutral_pose
from handclean.hand.skinning import posed, vertex_jacobian
from handclean.hand.template import HAND_LENGTH_M, template
from handclean.layouts.problem import (
    keyframe_poses,
    make_problem,
    on_bones,
    subspace_of,
)
from handclean.tree import ROOT_DOFS


def test_candidates_ride_on_the_skin(problem, surface, tree):
    rows = np.array([int(label) for label in problem.model.labels])
    skin = posed(surface, tree, keyframe_poses(problem))[:, rows]
    np.testing.assert_allclose(problem.places, skin, atol=1e-12)
    np.testing.assert_allclose(problem.home, surface.vertices[rows], atol=1e-12)


def test_columns_are_turns_and_subspace_directions(problem, surface, tree, takes, few):
    prior = subspace_of(takes, tree.hinges, few)
    rows = np.array([int(label) for label in problem.model.labels])
    for f, pose in enumerate(keyframe_poses(problem)):
        full = vertex_jacobian(surface, tree, pose, rows)
        np.testing.assert_allclose(
            problem.jacobian[f, ..., :3], full[..., 3:ROOT_DOFS], atol=1e-12
        )
        np.testing.assert_allclose(
            problem.jacobian[f, ..., 3:],
            full[..., ROOT_DOFS:] @ prior.components,
            atol=1e-12,
        )
    assert problem.columns[:3] == ("turn_x", "turn_y", "turn_z")
    assert problem.columns[3:] == tuple(f"direction {n}" for n in (1, 2, 3, 4))


def test_every_column_is_a_finite_difference(model, tree, takes, few):
    settings = replace(few, anchor=False)
    problem = make_problem(model, takes, tree.hinges, settings)
    prior = subspace_of(takes, tree.hinges, settings)
    steps = np.zeros((len(problem.columns), tree.dofs))
    steps[:3, :3] = problem.length_m * np.eye(3)
    steps[3:6, 3:6] = np.eye(3)
    steps[6:, 6:] = prior.components.T
    pose, small = keyframe_poses(problem)[0], 1e-6
    for c, step in enumerate(steps):
        ends = [moved(pose, sign * small * step)[None] for sign in (1.0, -1.0)]
        up, down = (marker_positions(model, end)[0] for end in ends)
        np.testing.assert_allclose(
            problem.jacobian[0, :, :, c], (up - down) / (2.0 * small), atol=1e-8
        )


def test_sums_and_gaps_are_what_they_say(problem, rng):
    low = np.tril_indices(len(problem.columns))
    for v, f in zip(rng.integers(0, 200, 9), rng.integers(0, 4, 9), strict=True):
        rows = problem.jacobian[f, v]
        np.testing.assert_allclose(problem.grams[v, f], (rows.T @ rows)[low])
    i, j = rng.integers(0, 200, (2, 50))
    away = np.linalg.norm(problem.places[:, i] - problem.places[:, j], axis=2)
    np.testing.assert_allclose(
        problem.gaps[i, j], (away.min(axis=0) / problem.length_m) ** 2, atol=1e-15
    )


def test_size_and_side_do_not_change_gaps_and_conditions(takes, few, problem):
    big = template("right", length_m=1.1 * HAND_LENGTH_M, breadth_m=1.1 * 0.0849)
    model = replace(
        problem.model,
        tree=big,
        at=1.1 * problem.model.at * np.array([-1.0, 1.0, 1.0]),
    )
    other = make_problem(model, takes, big.hinges, few)
    np.testing.assert_allclose(other.gaps, problem.gaps, atol=1e-12)
    for v in (3, 50, 120):
        ours, theirs = (np.linalg.norm(p.jacobian[:, v]) for p in (problem, other))
        assert theirs == pytest.approx(1.1 * ours)


def test_the_full_jacobian_has_the_hands_joints_and_no_wrist(takes, few):
    tree = template("left", forearm=True)
    names = tree.hinges[:20]
    markers = load_marker_set("maycock26").on(tree)
    problem = make_problem(markers, takes, names, replace(few, full=True))
    assert problem.columns[3:] == names
    assert problem.needed == 8
    pose = neutral_pose(tree)
    pose[7:27] = problem.angles[0, :20]
    np.testing.assert_allclose(
        problem.places[0], marker_positions(markers, pose[None])[0]
    )


def test_markers_of_a_set_can_be_the_candidates(tree, takes, few):
    glued = load_marker_set("schroeder17").on(tree)
    problem = make_problem(glued, takes, tree.hinges, few)
    assert problem.model.labels == glued.labels
    assert len(problem.home) == 17


def test_a_given_subspace_is_used_up_to_the_share_asked_for(model, tree, takes, few):
    prior = subspace_of(takes, tree.hinges, replace(few, dimensions=5))
    some = make_problem(model, takes, tree.hinges, few, prior=prior)
    assert len(some.columns) == 3 + 4
    held = np.cumsum(prior.variance_share)
    share = replace(few, dimensions=0, share=float(held[1]))
    assert len(make_problem(model, takes, tree.hinges, share, prior=prior).columns) == 5
    six = replace(few, dimensions=6)
    with pytest.raises(HandcleanError, match="has 5 directions, not 6"):
        make_problem(model, takes, tree.hinges, six, prior=prior)


def test_a_motion_that_stands_still_names_its_joints(model, tree, few):
    still = [np.zeros((50, 20))]
    with pytest.raises(HandcleanError, match=r"no joint moves .*thumb_cmc_abduction"):
        subspace_of(still, tree.hinges, few)


def test_too_many_dimensions_name_the_joints_that_never_move(tree, few, rng):
    angles = np.zeros((50, 20))
    angles[:, 5:8] = rng.normal(size=(50, 3))
    with pytest.raises(HandcleanError, match=r"3 directions, not 4.*never move"):
        subspace_of([angles], tree.hinges, few)
    assert (
        len(subspace_of([angles], tree.hinges, replace(few, dimensions=3)).mean) == 20
    )


def test_what_no_candidate_tells_is_named(surface, tree, takes, few):
    palm = np.flatnonzero(surface.weights[:, 0] * (surface.bones[:, 0] != 3) > 0.999)
    full, told = replace(few, full=True), "no candidate moves with thumb_ip_flexion"
    with pytest.raises(HandcleanError, match=told):
        make_problem(on_bones(surface, tree, palm), takes, tree.hinges, full)
    back = palm[surface.bones[palm, 0] == 0]
    with pytest.raises(HandcleanError, match="no candidate moves with direction 1"):
        make_problem(on_bones(surface, tree, back), takes, tree.hinges, few)


def test_unknown_angles_and_a_missing_skin_are_told(model, takes, tree, few):
    with pytest.raises(UnknownNameError, match="no angle is called 'knee'"):
        make_problem(model, takes, ("knee", *tree.hinges[1:]), few)
    with pytest.raises(UsageError, match="needs the hand's skin"):
        make_problem(model, takes, tree.hinges, replace(few, visibility=1.0))
