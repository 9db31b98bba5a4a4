"""Judging a layout: a good one finds the hand, the skin is compared as it is."""

import numpy as np
import pytest

from handclean.errors import HandcleanError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.ik.prior import learn
from handclean.layouts.evaluate import anchored, evaluate, on_fingers, skin_apart
from handclean.layouts.evaluate_settings import EvaluateConfig
from handclean.tree import POSE_HEAD

QUIET = EvaluateConfig(noise_m=0.0, frames=60)


@pytest.fixture(scope="module")
def poses(tree, takes):
    out = np.tile(neutral_pose(tree), (len(takes[0]), 1))
    out[:, POSE_HEAD:] = takes[0]
    out[:, :3] = [0.3, -0.2, 1.0]
    return out


def judged(name, tree, surface, poses, **given):
    model = load_marker_set(name).on(tree)
    settings = given.pop("settings", QUIET)
    return evaluate(
        model, surface, [poses], settings, np.random.default_rng(3), **given
    )


def test_markers_everywhere_without_noise_find_the_hand(tree, surface, poses):
    found = judged("maycock26", tree, surface, poses, anchor=False)
    assert found.mean_m < 1e-4
    assert found.frames == len(poses)
    assert found.frame_m.shape == (60,)
    assert found.frame_s > 0.0


def test_noise_is_felt(tree, surface, poses):
    errors = [
        judged(
            "maycock26",
            tree,
            surface,
            poses,
            settings=EvaluateConfig(noise_m=noise, frames=40),
        ).mean_m
        for noise in (0.0, 2e-4, 2e-3)
    ]
    assert errors[0] < errors[1] < errors[2]
    assert 1e-4 < errors[2] < 1e-2


def test_errors_of_the_skin_hang_together(tree, surface, poses):
    found = judged("schroeder6", tree, surface, poses)
    assert 0.0 < found.mean_m < found.max_m
    assert found.fingers_mean_m < found.fingers_max_m <= found.max_m
    assert found.frame_m.mean() == pytest.approx(found.mean_m)


def test_a_subspace_that_holds_the_motion_helps_few_markers(
    tree, surface, poses, takes
):
    prior = learn(takes, tree.hinges, directions=5)
    mean = {
        kind: judged("schroeder6", tree, surface, poses, prior=known).fingers_mean_m
        for kind, known in (("standard", None), ("subspace", prior))
    }
    assert mean["subspace"] < 0.7 * mean["standard"]


def test_the_anchor_is_where_the_wrist_is(tree, poses):
    model = anchored(load_marker_set("hoyet6").on(tree))
    places = marker_positions(model, poses)
    np.testing.assert_allclose(places[:, -1], poses[:, :3], atol=1e-12)
    assert places.shape[1] == 7


def test_the_anchor_helps_a_layout_without_markers_on_the_palm(tree, surface, poses):
    mean = [
        judged("hoyet6", tree, surface, poses, anchor=anchor).mean_m
        for anchor in (True, False)
    ]
    assert mean[0] < mean[1]


def test_a_hand_elsewhere_is_apart_by_how_far_it_went(tree, surface, poses):
    model = load_marker_set("hoyet6").on(tree)
    moved = poses.copy()
    moved[:, :3] += [0.003, 0.0, 0.004]
    apart = skin_apart(model, surface, poses, moved)
    np.testing.assert_allclose(apart, 0.005, atol=1e-12)
    assert apart.shape == (len(poses), len(surface.vertices))


def test_a_bent_finger_moves_its_own_skin_only(tree, surface):
    model = load_marker_set("hoyet6").on(tree)
    poses = np.tile(neutral_pose(tree), (2, 1))
    poses[1, POSE_HEAD + tree.hinges.index("ring_dip_flexion")] = 1.0
    (apart,) = skin_apart(model, surface, poses[:1], poses[1:])
    moved = np.flatnonzero(apart > 1e-9)
    assert 0 < len(moved) < 0.1 * len(surface.vertices)
    assert np.isin(moved, on_fingers(model, surface)).all()


def test_motion_without_frames_is_refused(tree, surface, poses):
    with pytest.raises(HandcleanError, match="no frame"):
        judged("hoyet6", tree, surface, poses[:0])


@pytest.mark.parametrize("wrong", [{"noise_m": -1.0}, {"frames": 0}])
def test_settings_are_checked(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        EvaluateConfig(**wrong)
