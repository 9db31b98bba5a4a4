"""The parts of the simulation: people, timing, cameras, losses, ghosts, columns."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handclean.arrays import runs
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.skinning import posed, project
from handclean.simulation import cameras, ghosts, losses, timing
from handclean.simulation.columns import assign_columns
from handclean.simulation.figures import (
    motion_figures,
    motion_table,
    occlusion_figures,
    occlusion_table,
)
from handclean.simulation.grasping import grasp_scene
from handclean.simulation.people import make_person, true_markers, without_forearm
from handclean.simulation.scene import Body, Scene
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

SETS = load_marker_set("maycock26")


def person(seed=0, **settings):
    return make_person("P", SETS, np.random.default_rng(seed), **settings)


def test_no_scaling_of_the_template_reaches_a_subject():
    for seed in range(5):
        tree = person(seed).tree
        plain = without_forearm(tree)
        base = SETS.on(tree).tree
        size = np.linalg.norm(base.offsets[1:], axis=1)
        assert size.std() > 0.0
        from handclean.hand.template import template

        scaled = template("left", forearm=True)
        ratio = np.linalg.norm(tree.offsets[1:-1], axis=1)
        ratio /= np.linalg.norm(scaled.offsets[1:-1], axis=1)
        assert ratio.std() > 0.02
        tilt = np.degrees(
            np.arccos(np.clip((tree.axes * scaled.axes).sum(axis=1), -1, 1))
        )
        assert 1.0 < tilt[:-2].mean() < 8.0
        assert len(plain.hinges) == 20


def test_markers_sit_on_the_skin_of_their_own_segment():
    for seed in range(5):
        who = person(seed)
        skin, names = who.surface, who.tree.bones
        places = marker_positions(who.markers, neutral_pose(who.tree)[None])[0]
        on = project(skin, skin.vertices, places)
        assert 0.0028 < on.lift.min() < 0.0037
        assert 0.0043 < on.lift.max() < 0.0058
        for m, face in enumerate(on.face):
            rows = skin.faces[face]
            there = skin.bones[rows][skin.weights[rows] > 0.0]
            assert names[who.markers.bone[m]] in {names[b] for b in there}


def test_markers_stay_outside_the_skin_when_the_hand_grasps():
    who = person()
    times = np.arange(500) / 100.0
    scene = grasp_scene(who, times, (), np.random.default_rng(1))
    poses = scene.poses[::50]
    skins = posed(who.surface, who.tree, poses)
    for skin, places in zip(skins, true_markers(who, poses), strict=True):
        assert project(who.surface, skin, places).lift.min() > 0.001


def test_skin_slides_by_millimetres_next_to_a_joint_and_not_at_all_when_straight():
    who = person()
    straight = neutral_pose(who.tree)[None]
    bent = straight.copy()
    bent[0, 7:27] = np.pi / 2
    rigid = marker_positions(who.markers, bent)
    away = np.linalg.norm(true_markers(who, bent) - rigid, axis=2)
    assert 0.001 < away.max() < 0.006
    same = true_markers(who, straight) - marker_positions(who.markers, straight)
    np.testing.assert_allclose(same, 0.0, atol=1e-15)
    firm = person(slide=0.0)
    np.testing.assert_array_equal(
        true_markers(firm, bent), marker_positions(firm.markers, bent)
    )


@given(seed=st.integers(0, 99), start=st.floats(0.0, 1.0), lasts=st.floats(0.2, 2.0))
def test_a_movement_goes_from_nothing_to_all_without_turning_back(seed, start, lasts):
    times = np.arange(700) / 200.0
    share = timing.movement(times, start, lasts, np.random.default_rng(seed))
    assert (share[times <= start] == 0.0).all()
    np.testing.assert_allclose(share[times >= start + lasts], 1.0)
    speed = np.diff(share)
    assert speed.min() > -1e-12
    early = times[1:][np.argmax(speed)] - start
    assert early < 0.56 * lasts + 0.01


def test_shaking_has_the_size_and_the_band_it_is_asked_for(rng):
    times = np.arange(4000) / 200.0
    noise = timing.shaking(times, 8.0, 12.0, 0.3, 50, rng)
    assert noise.std() == pytest.approx(0.3, rel=0.05)
    power = (np.abs(np.fft.rfft(noise, axis=0)) ** 2).sum(axis=1)
    hertz = np.fft.rfftfreq(len(times), 1 / 200.0)
    assert power[(hertz > 4.0) & (hertz < 16.0)].sum() > 0.98 * power.sum()


def test_a_marker_is_lost_when_fewer_than_two_cameras_see_it(rng):
    rig = cameras.make_rig(14, rng)
    markers = np.zeros((1, 3, 3))
    seen = np.zeros((1, 3, 14), dtype=bool)
    seen[0, 0, :1], seen[0, 1, :2], seen[0, 2] = True, True, True
    points = cameras.measured(markers, seen, rig, 1e-4, rng)
    assert np.isnan(points[0, 0]).all()
    assert np.isfinite(points[0, 1:]).all()


def test_noise_is_as_large_as_asked_and_smaller_when_more_cameras_see(rng):
    rig = cameras.make_rig(14, rng)
    markers = np.zeros((4000, 20, 3))
    few = np.zeros((4000, 20, 14), dtype=bool)
    few[:, :, :2] = True
    some, all_of_them = few.copy(), np.ones_like(few)
    some[:, :, :6] = True
    sizes = [
        np.diff(cameras.measured(markers, seen, rig, 2e-4, rng), axis=0).std() / 2**0.5
        for seen in (few, some, all_of_them)
    ]
    assert sizes[1] == pytest.approx(1.8e-4, rel=0.15)
    assert sizes[0] > 1.5 * sizes[1] > 1.5 * 1.3 * sizes[2]


def test_an_object_around_a_marker_hides_it_and_one_elsewhere_does_not(rng):
    who = person()
    pose = neutral_pose(who.tree)[None].repeat(2, axis=0)
    pose[:, 2] = 0.3
    markers = true_markers(who, pose)
    rig = cameras.make_rig(14, rng)
    frames = np.zeros((2, 3, 4))
    frames[:, :, :3] = np.eye(3)
    frames[0, :, 3] = markers[0, 5]
    frames[1, :, 3] = [0.0, 0.0, -2.0]
    ball = Body(name="object", kind=0, size=np.array([0, 0, 0, 0.01]), frames=frames)
    scene = Scene(title="", times=np.zeros(2), poses=pose, bodies=(ball,))
    seen = cameras.seen_by(who, scene, markers, rig)
    assert not seen[0, 5].any()
    assert seen[1, 5].sum() >= 2
    bare = cameras.seen_by(
        who, Scene(title="", times=np.zeros(2), poses=pose), markers, rig
    )
    assert (bare >= seen).all()


def test_a_marker_on_the_back_is_seen_from_above_and_not_from_below(rng):
    who = person()
    pose = neutral_pose(who.tree)[None]
    markers = true_markers(who, pose)
    for height, some in ((1.5, True), (-1.5, False)):
        places = np.array([[0.1, 0.1, height], [-0.1, 0.1, height]])
        rig = cameras.Rig(places=places, errors=np.zeros((2, 3)))
        seen = cameras.seen_by(
            who, Scene(title="", times=np.zeros(1), poses=pose), markers, rig
        )
        back = [who.markers.labels.index(f"R_HAND_{k}") for k in ("IN", "MID", "OUT")]
        assert seen[0, back].all() == some
        assert seen[0, back].any() == some


def test_hand_and_forearm_hide_what_is_under_them_and_nothing_beside_them():
    who = person()
    poses = neutral_pose(who.tree)[None].repeat(150, axis=0)
    middle = who.surface.vertices.mean(axis=0)
    under = [[*middle[:2], -0.08], [0.0, -0.12, -0.08]]
    beside = [[0.2, *middle[1:]], [0.2, -0.12, 0.0]]
    places = np.tile([*under, *beside], (150, 1, 1))
    rig = cameras.Rig(places=np.array([[0.0, 0.0, 1.5]]), errors=np.zeros((1, 3)))
    scene = Scene(title="", times=np.zeros(150), poses=poses)
    seen = cameras.seen_by(who, scene, places, rig)[:, :, 0]
    np.testing.assert_array_equal(seen, [[False, False, True, True]] * 150)


seen_arrays = arrays(np.bool_, st.tuples(st.integers(1, 60), st.integers(1, 5)))


@given(seen=seen_arrays, seed=st.integers(0, 9))
def test_tracks_hold_every_sighting_once(seen, seed):
    rng = np.random.default_rng(seed)
    held = np.zeros(seen.shape, dtype=int)
    tracks = losses.tracks(seen, 10.0, rng)
    for m, a, b in tracks:
        assert a < b
        held[a:b, m] += 1
    np.testing.assert_array_equal(held, seen)
    columns = assign_columns(tracks, [], len(seen), seen.shape[1], rng)
    np.testing.assert_array_equal(columns.marker >= 0, seen)
    for row in columns.marker:
        used = row[row >= 0]
        assert len(set(used.tolist())) == len(used)


def test_dropouts_are_as_frequent_as_asked_and_mostly_short(rng):
    seen = np.ones((20000, 30), dtype=bool)
    left = losses.dropouts(seen, 200.0, 0.2, rng)
    found = [np.array(runs(~left[:, m])).reshape(-1, 2) for m in range(30)]
    lasts = np.concatenate([(r[:, 1] - r[:, 0]) / 200.0 for r in found])
    assert len(lasts) == pytest.approx(0.2 * 100.0 * 30, rel=0.15)
    assert 0.88 < (lasts < 0.36).mean() < 0.96
    assert lasts.max() > 0.8


def test_impostors_live_beside_hidden_markers_and_are_none(rng):
    frames, count = 1000, 6
    markers = rng.normal(scale=0.05, size=(1, count, 3)) + np.cumsum(
        rng.normal(scale=2e-4, size=(frames, 1, 3)), axis=0
    )
    turns = np.broadcast_to(np.eye(3), (frames, count, 3, 3))
    seen = np.ones((frames, count), dtype=bool)
    made, left = ghosts.impostors(markers, turns, seen, 200.0, 3.0, 1e-4, rng)
    assert len(made) > 5
    for ghost in made:
        span = slice(ghost.start, ghost.start + len(ghost.points))
        assert len(ghost.points) >= 30
        assert not left[span, ghost.beside].any()
        away = np.linalg.norm(ghost.points - markers[span, ghost.beside], axis=1)
        assert away.min() > 0.003
        assert away.max() < 0.024


def test_a_ghost_that_continues_takes_over_its_marker_s_column(rng):
    tracks = np.array([[0, 0, 50], [1, 0, 100], [0, 90, 100]])
    ghost = ghosts.Ghost(start=50, points=np.zeros((35, 3)), beside=0, continues=True)
    columns = assign_columns(tracks, [ghost], 100, 2, rng)
    assert columns.ghost[0] == columns.marker[49, 0]
    assert columns.marker[95, 0] != columns.marker[95, 1]


def test_simulated_occlusions_are_as_short_as_measured_ones():
    settings = SimulateConfig(trials=16, subjects=8, seed=6, rate_hz=100.0)
    takes = [t.labelled.markers.measured for t in simulate("grasp", settings)]
    found = occlusion_figures(takes, 100.0, seen_at_hz=50.0)
    assert 0.84 < found.short < 0.96  # 0.90 of them, says Pavllo
    assert found.at_once[0] > found.at_once[1] > found.at_once[3]
    assert 0.005 < found.hidden.mean() < 0.08
    table = occlusion_table({"grasp": found})
    assert "shorter than 0.36 s" in table


def test_figures_of_a_known_motion_are_what_they_should_be(rng):
    times = np.arange(400) / 100.0
    angles = np.zeros((400, 12))
    angles[:, 0] = np.sin(2 * np.pi * times)
    angles[:, 1] = 2.0 * np.cos(2 * np.pi * times)
    angles[7] = np.nan
    found = motion_figures([angles], 100.0)
    np.testing.assert_allclose(found.shares[:2], [0.8, 1.0], atol=0.01)
    assert found.speeds[-1] == pytest.approx(4 * np.pi, rel=0.02)
    assert motion_table({"known": found}).count("\n") > 5


def test_occlusions_of_a_known_take_are_counted():
    seen = np.ones((100, 3), dtype=bool)
    seen[10:20, 0] = seen[15:65, 1] = seen[90:, 2] = False
    found = occlusion_figures([seen], 100.0)
    np.testing.assert_allclose(found.durations, [0.1, 0.5])
    assert found.short == 0.5
    np.testing.assert_allclose(found.at_once, [0.35, 0.6, 0.05, 0.0])
    np.testing.assert_allclose(found.hidden, [0.1, 0.5, 0.1])
