"""Takes with known truth: the laws they keep."""

import numpy as np
import pytest

from handclean.errors import HandcleanError, UsageError
from handclean.hand.model import marker_positions
from handclean.simulation.scenarios import find_scenario, settings_for
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate, simulate_one

SHORT = {"rate_hz": 100.0, "duration_s": 5.0}


def takes(kind="grasp", **settings):
    return list(simulate(kind, SimulateConfig(**{**SHORT, **settings})))


def arrays(trial):
    return [
        trial.unlabelled.unlabelled.positions,
        trial.unlabelled.unlabelled.source,
        trial.labelled.markers.positions,
        trial.truth.markers.positions,
        trial.subject.model.at,
    ]


@pytest.mark.parametrize("kind", ["grasp", "rom", "free"])
def test_the_same_seed_makes_the_same_take(kind):
    for one, two in zip(takes(kind), takes(kind), strict=True):
        for a, b in zip(arrays(one), arrays(two), strict=True):
            np.testing.assert_array_equal(a, b)


def test_a_take_does_not_depend_on_how_many_are_made():
    few, many = takes(trials=2, subjects=2), takes(trials=3, subjects=2)
    for one, two in zip(few, many, strict=False):
        assert one.name == two.name
        for a, b in zip(arrays(one), arrays(two), strict=True):
            np.testing.assert_array_equal(a, b)


def test_no_two_takes_are_alike():
    one, two = takes(trials=2)
    away = one.truth.motions["right"].angles - two.truth.motions["right"].angles
    assert np.degrees(np.abs(away).max()) > 5.0


def test_another_seed_makes_another_hand():
    (one,), (two,) = takes(seed=1), takes(seed=2)
    assert (
        np.abs(one.subject.model.tree.offsets - two.subject.model.tree.offsets).max()
        > 1e-4
    )


@pytest.mark.parametrize("kind", ["grasp", "rom", "free"])
def test_the_left_hand_is_the_mirror_image_of_the_right(kind):
    (right,), (left,) = takes(kind, side="right"), takes(kind, side="left")
    mirror = np.array([-1.0, 1.0, 1.0])
    for part in ("labelled", "truth"):
        a = getattr(right, part).markers.positions
        b = getattr(left, part).markers.positions
        np.testing.assert_array_equal(a, b * mirror)
    np.testing.assert_array_equal(
        right.truth.motions["right"].angles, left.truth.motions["left"].angles
    )
    for side, trial in (("right", right), ("left", left)):
        motion, skin = trial.truth.motions[side], trial.truth.markers.positions
        bare = marker_positions(trial.subject.model, motion.poses)
        assert np.linalg.norm(bare - skin, axis=2).max() < 0.006
    with_object = "object" in right.truth.motions
    if with_object:
        a, b = (t.truth.motions["object"].translation for t in (right, left))
        np.testing.assert_array_equal(a, b * mirror)


def test_without_sliding_noise_and_loss_the_labelled_take_is_the_model_s():
    (trial,) = takes(
        slide=0.0,
        noise_m=0.0,
        occlusion=False,
        dropouts_per_s=0.0,
        ghosts_per_s=0.0,
        impostors_per_s=0.0,
    )
    motion = trial.truth.motions["right"]
    want = marker_positions(trial.subject.model, motion.poses)
    np.testing.assert_allclose(trial.labelled.markers.positions, want, atol=1e-12)
    assert len(trial.labelled.unlabelled.frame) == 0


@pytest.mark.parametrize("kind", ["grasp", "rom", "free"])
def test_no_joint_leaves_its_limits(kind):
    for trial in takes(kind, trials=2, subjects=2):
        tree = trial.truth.skeletons["right"]
        angles = trial.truth.motions["right"].angles
        low, high = tree.limits.T
        assert (angles >= low).all()
        assert (angles <= high).all()


def test_every_raw_point_is_a_marker_or_a_ghost_and_columns_hold_one_point_a_frame():
    (trial,) = takes(ghosts_per_s=4.0, impostors_per_s=1.0, dropouts_per_s=0.5)
    raw, named = trial.unlabelled.unlabelled, trial.labelled.markers
    ghosts = trial.labelled.unlabelled
    assert len(raw.frame) == named.measured.sum() + len(ghosts.frame)
    assert len(ghosts.frame) > 20
    keys = set(zip(raw.frame.tolist(), raw.source.tolist(), strict=True))
    assert len(keys) == len(raw.frame)
    where = {
        (f, s): p for f, s, p in zip(raw.frame, raw.source, raw.positions, strict=True)
    }
    for t, m in zip(*np.nonzero(named.measured), strict=True):
        point = where[t, named.source[t, m]]
        np.testing.assert_array_equal(point, named.positions[t, m])
    assert (np.diff(raw.frame) >= 0).all()


def test_a_marker_that_reappears_is_in_another_column():
    (trial,) = takes(dropouts_per_s=1.0)
    source = trial.labelled.markers.source
    changes = same = 0
    for m in range(source.shape[1]):
        kept = source[:, m][source[:, m] >= 0]
        gaps = np.flatnonzero((source[:-1, m] >= 0) & (source[1:, m] < 0))
        changes += (np.diff(kept) != 0).sum()
        same += len(gaps)
    assert changes > 0.6 * same > 10


def test_every_marker_is_there_at_the_start_and_nothing_else():
    for trial in takes(trials=2, ghosts_per_s=5.0):
        assert trial.labelled.markers.measured[:10].all()
        assert (trial.labelled.unlabelled.frame >= 10).all()


def test_unknown_scenarios_grasps_and_sets_are_one_line():
    for kind, settings in (
        ("grip", {}),
        ("grasp", {"grasps": ("tripos",)}),
        ("grasp", {"marker_set": "maycock27"}),
    ):
        with pytest.raises(HandcleanError) as caught:
            takes(kind, **settings)
        assert "\n" not in str(caught.value)


def test_a_scenario_file_sets_what_it_names(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('kind = "grasp"\ngrasps = ["tripod"]\ntrials = 2\nnoise_m = 0\n')
    scenario = find_scenario(path)
    made = list(simulate(scenario.kind, settings_for(scenario, **SHORT)))
    assert [trial.name.split("_")[-1] for trial in made] == ["tripod", "tripod"]
    for wrong in (
        *("kind = 'x'", "kind = ['x']", "trails = 2", "trials = 'two'", "trials = 0"),
        "]",
    ):
        path.write_text(wrong)
        with pytest.raises(UsageError, match=r"mine\.toml"):
            settings_for(find_scenario(path))


def test_what_is_given_beats_a_scenario_also_where_it_is_the_default(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("kind = 'free'\ntrials = 3\nocclusion = false\nrate_hz = 50\n")
    scenario = find_scenario(path)
    assert settings_for(scenario) == SimulateConfig(
        trials=3, occlusion=False, rate_hz=50.0
    )
    given = {"trials": 1, "occlusion": True, "rate_hz": 200.0}
    assert settings_for(scenario, **given) == SimulateConfig()


def test_a_demo_has_100_frames_a_second_unless_told_otherwise(tmp_path):
    assert settings_for(find_scenario("demo")).rate_hz == 100.0
    assert settings_for(find_scenario("demo"), rate_hz=200.0) == SimulateConfig()
    path = tmp_path / "mine.toml"
    path.write_text("kind = 'demo'\n")
    assert settings_for(find_scenario(path)).rate_hz == 100.0


def test_one_take_alone_is_the_same_as_among_others():
    settings = SimulateConfig(**SHORT, trials=3, subjects=2)
    among = list(simulate("grasp", settings))[2]
    alone = simulate_one("grasp", settings, 2)
    for a, b in zip(arrays(among), arrays(alone), strict=True):
        np.testing.assert_array_equal(a, b)


def test_sets_with_markers_on_the_forearm_come_with_a_moving_wrist():
    (trial,) = takes("rom", marker_set="xu19", duration_s=20.0)
    motion = trial.truth.motions[trial.subject.model.tree.side]
    assert motion.names[-2:] == ("wrist_flexion", "wrist_deviation")
    swing = np.degrees(np.ptp(motion.angles[:, -2:], axis=0))
    assert swing[0] > 50.0
    assert swing[1] > 20.0


def test_a_range_of_motion_take_moves_every_joint():
    for trial in takes("rom", duration_s=20.0, trials=2, subjects=2):
        tree = trial.subject.model.tree
        low, high = np.percentile(trial.truth.motions["right"].angles, [0, 100], axis=0)
        span = (high - low) / (tree.limits[:, 1] - tree.limits[:, 0])
        assert span.min() > 0.4
        assert len(trial.truth.events) > 20
