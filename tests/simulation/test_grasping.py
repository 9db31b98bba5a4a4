"""Hands close on objects without going through them, at human speeds."""

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.simulation.closing import close
from handclean.simulation.grasping import grasp_scene
from handclean.simulation.grasps import GRASPS
from handclean.simulation.people import make_person
from handclean.simulation.scene import deepest
from handclean.simulation.seating import PAD_DEPTH_M, Solid

TIMES = np.arange(500) / 100.0


@pytest.fixture(scope="module")
def people():
    sets = load_marker_set("maycock26")
    return [make_person("P", sets, np.random.default_rng(k)) for k in range(4)]


def test_there_are_cutkosky_s_sixteen_classes_and_the_hook():
    assert len(GRASPS) == 17


@pytest.mark.parametrize("name", GRASPS)
def test_a_closed_hand_touches_its_object_and_is_not_in_it(name, people):
    rng, held = np.random.default_rng(3), []
    for attempt in range(12):
        closing = close(people[attempt % 4], GRASPS[name], rng)
        if closing is not None:
            held.append(closing)
    assert len(held) >= 3
    for closing in held:
        assert -2.0 * PAD_DEPTH_M <= closing.depth <= 0.0005
        assert len(closing.touching) >= 2
        if GRASPS[name].seat == "palm":
            assert len(closing.touching) >= 3
        else:
            assert any(bone.startswith("thumb") for bone in closing.touching)


def test_an_object_s_frame_is_as_kernels_are_compiled_for():
    turned = np.eye(3)[:, [2, 0, 1]]  # numpy hands it back column by column
    frame = np.column_stack([turned, np.zeros(3)])
    assert not frame.flags.c_contiguous
    solid = Solid(kind=0, size=np.ones(4), frame=frame)
    assert solid.frame.flags.c_contiguous
    np.testing.assert_array_equal(solid.frame, frame)


@pytest.mark.parametrize("name", ["medium_wrap", "sphere_power", "tripod"])
def test_fingers_never_move_back_while_closing(name, people):
    closing = None
    rng = np.random.default_rng(0)
    while closing is None:
        closing = close(people[0], GRASPS[name], rng)
    moves = np.diff(closing.path, axis=0)
    for column in moves.T:
        assert (column >= -1e-12).all() or (column <= 1e-12).all()


@pytest.mark.parametrize("name", GRASPS)
def test_a_hand_that_carries_is_at_most_two_millimetres_in_its_object(name, people):
    scene = grasp_scene(people[1], TIMES, (name,), np.random.default_rng(5))
    carry = next(e for e in scene.events if e.text == "carry")
    gaps = deepest(people[1], scene.poses[carry.start : carry.stop], _at(scene, carry))
    assert -0.0035 < gaps.min() < 0.0005
    assert np.median(gaps) > -0.002
    away = deepest(people[1], scene.poses[:5], _at(scene, slice(0, 5)))
    assert away.min() > 0.0


def _at(scene, span):
    body = scene.bodies[0]
    start, stop = (span.start, span.stop)
    return type(body)(
        name=body.name, kind=body.kind, size=body.size, frames=body.frames[start:stop]
    )


def test_hands_move_as_fast_as_people_do(people):
    wrist, fingers = [], []
    for k in range(10):
        scene = grasp_scene(people[k % 4], TIMES, (), np.random.default_rng([9, k]))
        places, angles = scene.poses[:, :3], scene.poses[:, 7:27]
        wrist.append(100.0 * np.linalg.norm(np.diff(places, axis=0), axis=1).max())
        fingers.append(np.degrees(100.0 * np.abs(np.diff(angles, axis=0)).max()))
    # reaching of 0.3 to 0.5 m in about a second: 0.6 to 2 m/s at the most
    assert 0.7 < np.median(wrist) < 1.6
    assert max(wrist) < 2.5
    # closing on an object: some hundred degrees a second, never a thousand
    assert 150.0 < np.median(fingers) < 600.0
    assert max(fingers) < 1000.0


def test_the_hand_comes_to_rest_where_it_began(people):
    scene = grasp_scene(people[2], TIMES, (), np.random.default_rng(1))
    away = np.linalg.norm(scene.poses[-1, :3] - scene.poses[0, :3])
    assert away < 0.06
    highest = scene.poses[:, 2].max() - scene.poses[0, 2]
    assert highest > 0.05
