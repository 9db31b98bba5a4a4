"""What baselines do that the contract of all fillers does not say."""

import numpy as np
import pytest

from handclean.gaps.fill import fill
from handclean.gaps.settings import FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.recording import Origin


def filled_by(method, take, subject):
    found, figures = fill(take, subject, settings=FillConfig(method=method))
    return found.markers, figures


def test_linear_fill_is_a_straight_line_at_constant_speed(scenes, rng):
    take = scenes.without(scenes.take(scenes.waving(rng, 60)), ("R_THUMB_TIP", 20, 40))
    markers, _ = filled_by("linear", take, scenes.subject)
    path = markers.positions[19:41, scenes.column("R_THUMB_TIP")]
    np.testing.assert_allclose(np.diff(path, 2, axis=0), 0.0, atol=1e-12)


def test_a_rigid_bone_gives_its_hidden_marker_exactly():
    from dataclasses import replace

    from handclean.hand.model import marker_positions
    from handclean.recording import Recording, trajectories

    subject = template_subject(load_marker_set("maycock26"))  # ten on the hand
    rng = np.random.default_rng(0)
    frames = 60
    poses = np.zeros((frames, 7 + len(subject.model.tree.hinges)))
    angle = np.linspace(0.0, 1.5, frames) ** 2
    poses[:, 3], poses[:, 4] = np.cos(angle), np.sin(angle)
    poses[:, 0] = np.sin(np.arange(frames) / 7.0)
    places = marker_positions(subject.model, poses)
    places += rng.normal(scale=1e-9, size=places.shape)
    hidden = places.copy()
    column = subject.model.labels.index("R_HAND_MID")
    hidden[20:45, column] = np.nan
    take = Recording(
        rate=100.0, frames=frames, markers=trajectories(hidden, subject.model.labels)
    )
    markers, _ = filled_by("rigid", take, subject)
    np.testing.assert_allclose(
        markers.positions[20:45, column], places[20:45, column], atol=1e-7
    )
    only = [
        n for n, label in enumerate(subject.model.labels) if "HAND_MID" not in label
    ]
    blind = hidden.copy()
    blind[30, only] = np.nan
    gone = replace(take, markers=trajectories(blind, subject.model.labels))
    reasons = filled_by("rigid", gone, subject)[1].reasons
    assert any("fewer than three other markers" in reason for reason in reasons)


def test_pattern_fill_follows_a_marker_of_the_same_bone_exactly(scenes):
    poses = np.zeros((60, 7 + len(scenes.model.tree.hinges)))
    poses[:, 3] = 1.0
    poses[:, 0] = np.sin(np.arange(60) / 5.0)  # carried, not turned
    whole = scenes.take(poses)
    take = scenes.without(whole, ("R_HAND_IN", 20, 45))
    markers, _ = filled_by("pattern", take, scenes.subject)
    np.testing.assert_allclose(markers.positions, whole.markers.positions, atol=1e-9)


def test_pattern_fill_without_any_donor_is_refused(scenes, rng):
    whole = scenes.take(scenes.waving(rng, 60))
    take = scenes.without(whole, (scenes.labels, 30, 35))
    markers, figures = filled_by("pattern", take, scenes.subject)
    assert figures.filled == 0
    assert figures.reasons == {"no other marker is seen throughout": 17}
    assert not (markers.origin == Origin.FILLED).any()


@pytest.mark.parametrize("method", ["cubic", "spline"])
def test_cubic_paths_restore_a_parabola(scenes, method):
    poses = np.zeros((60, 7 + len(scenes.model.tree.hinges)))
    poses[:, 3] = 1.0
    poses[:, 2] = 1e-4 * np.arange(60) ** 2
    whole = scenes.take(poses)
    take = scenes.without(whole, ("R_INDEX_TIP", 20, 45))
    markers, _ = filled_by(method, take, scenes.subject)
    np.testing.assert_allclose(markers.positions, whole.markers.positions, atol=1e-9)


@pytest.mark.parametrize("method", ["linear", "cubic", "spline", "pattern", "rigid"])
def test_baselines_do_not_claim_to_know_their_sigma(scenes, rng, method):
    take = scenes.without(scenes.take(scenes.waving(rng, 60)), ("R_HAND_IN", 20, 40))
    markers, figures = filled_by(method, take, scenes.subject)
    assert np.isnan(markers.sigma).all()
    assert figures.sigma_m == 0.0
