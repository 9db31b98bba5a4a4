"""From takes to a subject: known people come back, and bad takes are said plainly."""

import re
from dataclasses import fields, replace

import numpy as np
import pytest
from people import Person, as_take, lengths, person
from scipy.spatial.transform import Rotation
from told import texts

from handclean.errors import HandcleanError, UnknownNameError, UsageError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.subject.calibrate import calibrate, measure
from handclean.subject.settings import CalibrateConfig

FEW = CalibrateConfig(frames=120)


def learn(one, settings=FEW, take=None, **parts):
    return calibrate([take or one.take], one.set, settings, **parts)


def with_markers(one, positions, **parts):
    return as_take(positions, one.set.labels, **parts)


def numbers_of(subject):
    tree = subject.model.tree
    return np.concatenate(
        [tree.offsets.ravel(), tree.axes.ravel(), subject.model.at.ravel()]
    )


@pytest.fixture(scope="module")
def one():
    return person(3, "maycock26", size=0.9)


@pytest.fixture(scope="module")
def learnt(one):
    return learn(one, name="Ada")


def test_a_known_hand_comes_back_to_a_fraction_of_a_millimetre(one, learnt):
    subject, report = learnt
    away = lengths(subject.model.tree) - lengths(one.model.tree)
    assert np.sqrt(np.mean(away**2)) < 0.0004
    assert np.abs(away).max() < 0.001
    inner = [j for j in report.lengths_m if j.endswith(("_pip", "_dip", "_ip"))]
    sigma = np.array([report.lengths_sigma_m[joint] for joint in inner])
    assert sigma.max() < 0.001
    assert report.size == pytest.approx(0.9, abs=0.03)
    assert subject.model.tree.scale == report.size
    assert (subject.name, subject.model.tree.subject) == ("Ada", "Ada")
    assert subject.marker_set == "maycock26"
    assert subject.calibrated


def test_held_out_error_is_what_the_noise_leaves(learnt):
    subject, report = learnt
    expected = 0.0002 * np.sqrt(3.0) * np.sqrt(1.0 - 26.0 / (3 * 0.95 * 26))
    assert report.heldout_rms_m == pytest.approx(expected, rel=0.15)
    assert report.heldout_kept_rms_m == pytest.approx(report.heldout_rms_m, rel=0.01)
    assert report.doubtful == 0.0
    assert report.noise_m == pytest.approx(0.0002, rel=0.1)
    assert report.camera_noise_m == pytest.approx(0.0002, rel=0.25)
    assert report.frames_held_out == pytest.approx(100, abs=1)
    assert report.frames_used == 120
    assert texts(report.remarks) == ()
    np.testing.assert_allclose(subject.marker_sigma, expected, rtol=0.6)
    assert subject.errors["heldout_rms_m"] == report.heldout_rms_m
    assert subject.errors["index_pip_length_sigma_m"] > 0.0


@pytest.mark.parametrize(
    ("name", "side", "size"), [("xu19", "right", 1.2), ("han19", "right", 0.7)]
)
def test_hands_of_either_side_size_and_set_come_back(name, side, size):
    one = person(4, name, side=side, size=size)
    subject, report = learn(one, side=side)
    away = lengths(subject.model.tree) - lengths(one.model.tree)
    assert np.median(np.abs(away)) < 0.0004
    tree = subject.model.tree
    joints = [tree.joints[b] for b in np.flatnonzero(tree.parents > 0)]
    sigma = np.array([report.lengths_sigma_m[joint] for joint in joints])
    assert np.sqrt(np.mean((away / sigma) ** 2)) < 1.6
    assert subject.model.tree.side == side
    assert report.size == pytest.approx(size, rel=0.05)
    assert report.heldout_rms_m < 0.0005


def test_filled_and_rejected_samples_never_count(one, learnt):
    rng = np.random.default_rng(1)
    positions = one.take.markers.positions.copy()
    origin = one.take.markers.origin.copy()
    gone = origin == 0
    positions[gone] = rng.normal(scale=0.5, size=(int(gone.sum()), 3))
    origin[gone] = rng.choice([0, 2, 3], size=int(gone.sum())).astype(np.uint8)
    subject, _ = learn(one, take=with_markers(one, positions, origin=origin))
    np.testing.assert_array_equal(numbers_of(subject), numbers_of(learnt[0]))


def test_the_same_takes_give_the_same_subject_and_report(one, learnt):
    subject, report = learn(one, name="Ada")
    np.testing.assert_array_equal(numbers_of(subject), numbers_of(learnt[0]))
    assert str(report) == str(learnt[1])


def test_the_subject_does_not_depend_on_the_laboratorys_frame(one, learnt):
    turn = Rotation.from_rotvec([0.7, -1.9, 2.1])
    positions = one.take.markers.positions
    moved = turn.apply(positions.reshape(-1, 3)).reshape(positions.shape)
    subject, report = learn(
        one, take=with_markers(one, moved + np.array([3.0, -7.0, 1.0]))
    )
    np.testing.assert_allclose(
        numbers_of(subject), numbers_of(learnt[0]), rtol=0.0, atol=1e-4
    )
    assert report.heldout_rms_m == pytest.approx(learnt[1].heldout_rms_m, rel=1e-3)


def test_takes_of_one_hand_reduce_into_one_subject(one):
    positions = one.take.markers.positions
    takes = [with_markers(one, part) for part in np.array_split(positions, 3)]
    subject, report = calibrate(takes, one.set, FEW)
    away = lengths(subject.model.tree) - lengths(one.model.tree)
    assert np.sqrt(np.mean(away**2)) < 0.0005
    assert report.frames == 500


def still(one, hinges):
    """The same person and motion, with some hinges kept at 20 degrees."""
    rng = np.random.default_rng(12)
    poses = one.poses.copy()
    for d, name in enumerate(one.model.tree.hinges):
        if name in hinges:
            poses[:, 7 + d] = 0.35 + 0.01 * np.sin(np.arange(len(poses)) / 10)
    places = marker_positions(one.model, poses)
    places += rng.normal(scale=0.0002, size=places.shape)
    return Person(one.set, one.model, poses, as_take(places, one.set.labels))


def test_a_joint_that_hardly_moved_is_named_and_keeps_the_templates_axis(one):
    stiff = still(one, {"ring_dip_flexion"})
    subject, report = learn(stiff)
    assert report.poorly_moved == ("ring_dip_flexion",)
    (words,) = texts(report.remarks)
    assert words.startswith("ring_dip_flexion moved only ")
    assert words.endswith(" degrees: its axis and place are the template's")
    assert np.degrees(report.moved_rad["ring_dip_flexion"]) < 3.0
    assert np.degrees(report.moved_rad["index_dip_flexion"]) > 30.0
    d = subject.model.tree.hinges.index("ring_dip_flexion")
    axis = np.array([-1.0, 0.0, 0.0])  # of the template's right hand
    assert np.degrees(np.arccos(subject.model.tree.axes[d] @ axis)) < 1.0


def test_a_marker_never_seen_keeps_its_place_and_is_named(one):
    positions = one.take.markers.positions.copy()
    m = one.set.labels.index("R_LITTLE_TIP")
    positions[:, m] = np.nan
    subject, report = learn(one, take=with_markers(one, positions))
    assert "R_LITTLE_TIP was never measured: its place is the template's" in (
        texts(report.remarks)
    )
    assert any(
        w.startswith("little_dip_flexion: no marker") for w in texts(report.remarks)
    )
    assert report.moved_rad["little_dip_flexion"] == 0.0
    template = load_marker_set("maycock26")
    at = subject.model.at[m] / subject.model.tree.scale * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(at, template.at[m], atol=2e-4)
    assert np.isnan(subject.marker_sigma[m])
    assert np.isnan(report.heldout_by_marker_m["R_LITTLE_TIP"])


def test_wrong_labels_are_named_with_the_first_frame(one):
    positions = one.take.markers.positions.copy()
    a, b = (one.set.labels.index(name) for name in ("R_INDEX_TIP", "R_MIDDLE_TIP"))
    positions[200:260, [a, b]] = positions[200:260, [b, a]]
    take = replace(with_markers(one, positions), first_frame=995)
    subject, report = learn(one, take=take)
    named = [words for words in texts(report.remarks) if "labelled right" in words]
    assert {words.split()[0] for words in named} & {"R_INDEX_TIP", "R_MIDDLE_TIP"}
    firsts = [re.search(r"first in frame (\d+):", words)[1] for words in named]
    assert all(995 + 200 <= int(number) < 995 + 260 for number in firsts)
    away = lengths(subject.model.tree) - lengths(one.model.tree)
    assert np.sqrt(np.mean(away**2)) < 0.0006


def test_limits_widen_where_the_hand_went_beyond_them(one, learnt):
    poses = one.poses.copy()
    tree = one.model.tree
    d = tree.hinges.index("index_mcp_flexion")
    poses[:, 7 + d] = np.radians(-5.0 + 60.0 * np.sin(np.arange(len(poses)) / 15))
    places = marker_positions(one.model, poses)
    subject, _ = learn(one, take=with_markers(one, places))
    low = np.degrees(subject.model.tree.limits[d, 0])
    assert low == pytest.approx(-66.0, abs=8.0)
    others = np.delete(np.arange(len(tree.hinges)), d)
    inside = subject.model.tree.limits[others]
    assert (inside[:, 0] <= tree.limits[others, 0]).all()
    assert (inside[:, 1] >= tree.limits[others, 1]).all()
    np.testing.assert_allclose(learnt[0].model.tree.limits[d], tree.limits[d])


def test_nothing_held_out_gives_no_held_out_error(one):
    _, report = learn(one, replace(FEW, holdout=0.0))
    assert report.frames_held_out == 0
    assert np.isnan(report.heldout_rms_m)


def test_frames_that_teach_nothing_new_are_left_out(one):
    positions = np.repeat(one.take.markers.positions[:40:2], 25, axis=0)
    rng = np.random.default_rng(2)
    positions += rng.normal(scale=2e-5, size=positions.shape)
    _, report = learn(one, take=with_markers(one, positions))
    assert 10 <= report.frames_used <= 20


def test_a_subject_is_measured_on_another_take_of_the_same_hand(one, learnt):
    rng = np.random.default_rng(30)
    places = marker_positions(one.model, one.poses[::-1][:200] * 1.0)
    places += rng.normal(scale=0.0002, size=places.shape)
    found = measure(learnt[0], [with_markers(one, places)])
    assert found.frames == 200
    assert found.rms_m < 0.0004


def test_too_few_frames_are_one_clear_line(one):
    take = with_markers(one, one.take.markers.positions[:6])
    with pytest.raises(HandcleanError) as caught:
        learn(one, take=take)
    assert str(caught.value).startswith("calibrate-hand: 6 of 6 frames hold 16 or more")
    assert "\n" not in str(caught.value)


def test_a_set_whose_names_are_not_in_the_take_is_refused(one):
    with pytest.raises(UnknownNameError, match="no marker is called 'ThumbCMC'"):
        calibrate([one.take], load_marker_set("han19"), FEW)


def test_a_hand_of_the_other_side_is_refused(one):
    with pytest.raises(UsageError, match="shows a right hand, not a left one"):
        learn(one, side="left")


def test_sides_that_do_not_exist_and_rigid_sets_are_refused(one):
    with pytest.raises(UsageError, match="side 'both'"):
        learn(one, side="both")
    with pytest.raises(UsageError, match="rigid"):
        calibrate([one.take], replace(one.set, kind="rigid"), FEW)


def test_few_markers_are_said_to_decide_little():
    one = person(11, "schroeder6", frames=200)
    _, report = learn(one)
    assert any(
        "cannot decide the 26 numbers of a pose" in w for w in texts(report.remarks)
    )


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"frames": 5}, "frames should be 10 or more, not 5"),
        ({"holdout": 0.7}, "holdout should lie between 0 and 0.5"),
        ({"place_m": 0.0}, "place_m should be > 0"),
        ({"novel_m": -1.0}, "novel_m should be >= 0"),
        ({"independent": 0}, "independent should be 1 or more"),
        ({"robust": float("nan")}, "robust should be > 0"),
    ],
)
def test_settings_say_what_they_should_be(given, words):
    with pytest.raises(ValueError, match=words):
        CalibrateConfig(**given)


def test_every_number_of_a_report_is_plain(learnt):
    for field in fields(learnt[1]):
        value = getattr(learnt[1], field.name)
        plain = (str, int, float, dict, tuple)
        assert type(value) in plain, field.name
