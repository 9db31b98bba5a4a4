"""BVH: our hierarchies out, any in, and through joint maps to hinge angles."""

import re
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from told import texts

from handclean.errors import (
    FileError,
    HandcleanError,
    UnknownNameError,
    UsageError,
)
from handclean.hand.model import bone_rotations, joint_positions
from handclean.hand.template import distal_length, template
from handclean.io import files
from handclean.io.bvh.angles import read_bvh_angles
from handclean.io.bvh.mapping import map_motion, stand_in
from handclean.io.bvh.motion import BvhMotion, read_bvh
from handclean.io.bvh.write import write_bvh
from handclean.io.shared import rotations
from handclean.io.shared.joint_map import SHIPPED, JointMap, load_joint_map, shipped
from handclean.recording import Motion, Recording, motion_from_poses
from handclean.tree import MOST_BONES, JointTree, rigid_tree

PLAIN = """HIERARCHY
ROOT hip
{
\tOFFSET 1 2 3
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
\tJOINT knee left
\t{
\t\tOFFSET 0 -40 0
\t\tCHANNELS 2 Yrotation Xrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 -30 0
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: 0.008333334
0 0 0 0 0 0 0 0
10 20 30 10 20 30 40 50
"""


def written(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize("order", rotations.ORDERS)
def test_euler_angles_are_about_carried_axes(order, rng):
    angles = rng.uniform(-np.pi, np.pi, (50, 3))
    expected = Rotation.from_euler(order.upper(), angles).as_matrix()
    matrix = rotations.matrix_from_euler(angles, order)
    np.testing.assert_allclose(matrix, expected, atol=1e-14)
    back = rotations.euler_from_matrix(matrix, order)
    np.testing.assert_allclose(
        rotations.matrix_from_euler(back, order), expected, atol=1e-12
    )


@pytest.mark.parametrize("order", rotations.ORDERS)
@pytest.mark.parametrize("middle", [np.pi / 2, -np.pi / 2])
def test_euler_angles_hold_where_two_axes_coincide(order, middle, rng):
    angles = rng.uniform(-np.pi, np.pi, (20, 3))
    angles[:, 1] = middle
    matrix = rotations.matrix_from_euler(angles, order)
    back = rotations.euler_from_matrix(matrix, order)
    np.testing.assert_allclose(
        rotations.matrix_from_euler(back, order), matrix, atol=1e-7
    )


def test_quaternions_and_angles_of_rotations_are_scipys(rng):
    turns = Rotation.random(100, rng=rng)
    matrix = turns.as_matrix()
    found = rotations.quaternion_from_matrix(matrix)
    expected = turns.as_quat(scalar_first=True)
    assert np.abs(np.sum(found * expected, axis=1)).min() > 1 - 1e-12
    assert (np.sum(found[1:] * found[:-1], axis=1) >= 0).all()
    np.testing.assert_allclose(
        rotations.matrix_from_quaternion(found), matrix, atol=1e-14
    )
    np.testing.assert_allclose(
        rotations.rotation_angle(matrix), turns.magnitude(), atol=1e-7
    )
    axis = np.array([0.6, 0.0, 0.8])
    angle = rng.uniform(-3, 3, 10)
    expected = Rotation.from_rotvec(angle[:, None] * axis).as_matrix()
    np.testing.assert_allclose(rotations.about_line(axis, angle), expected, atol=1e-14)


def test_channels_are_read_in_their_order(tmp_path):
    bvh = read_bvh(written(tmp_path / "a.bvh", PLAIN))
    assert bvh.names == ("hip", "knee left")
    assert bvh.parents.tolist() == [-1, 0]
    assert bvh.rate == 120.0
    assert bvh.ends[1].tolist() == [0, -30, 0]
    assert np.isnan(bvh.ends[0]).all()
    hip = Rotation.from_euler("ZXY", [10, 20, 30], degrees=True)
    knee = Rotation.from_euler("YX", [40, 50], degrees=True)
    np.testing.assert_allclose(bvh.turns[1, 1], knee.as_matrix(), atol=1e-14)
    places, turns = bvh.forward()
    np.testing.assert_allclose(places[1, 0], [10, 20, 30])
    np.testing.assert_allclose(places[1, 1] - [10, 20, 30], hip.apply([0, -40, 0]))
    np.testing.assert_allclose(turns[1, 1], (hip * knee).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(places[0, 1], [0, -40, 0])


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("HIERARCHY", "HIERARCHIE", "not a BVH file"),
        ("ROOT", "JOINT", "does not belong here"),
        ("\tJOINT", "\tROOT", "does not belong here"),
        ("MOTION", "MOVES", "does not belong here"),
        ("knee left", "hip", "2 joints are called 'hip'"),
        ("\tOFFSET 1 2 3\n", "", "'hip' has no OFFSET"),
        ("OFFSET 1 2 3", "OFFSET 1 2 nan", "'nan' is not a number"),
        ("OFFSET 1 2 3", "OFFSET 1 2 -1e300", "'-1e300' is too large a number"),
        ("OFFSET 1 2 3", "OFFSET 1 2", "does not belong here"),
        ("CHANNELS 2", "CHANNELS 3", "says 3 channels, names 2"),
        ("CHANNELS 2 Y", "CHANNELS 2 W", "'Wrotation'"),
        ("CHANNELS 2 Yrot", "CHANNELS 2 Xrot", "twice"),
        ("Frames: 2", "Frames: two", "Frames: N"),
        ("Frame Time: 0.008333334", "Frame Time: 0", "Frame Time is '0'"),
        ("Frame Time: 0.008333334", "Frame Time: nan", "Frame Time is 'nan'"),
        ("Frame Time: 0.008333334", "Frame Time: 1e-320", "Frame Time"),
        ("40 50\n", "40 x\n", "'x' is not a number"),
        ("40 50\n", "40 nan\n", "a channel is not a number"),
        ("40 50\n", "40 -1e200\n", "a channel is too large a number"),
        ("40 50\n", "40 50 60\n", "more than 8 cells"),
        ("Frames: 2", "Frames: 4", "--lenient saves 2 frames"),
        ("0 0 0 0 0 0 0 0\n10 20 30 10 20 30 40 50\n", "", "no frames"),
        ("}\n}\nMOTION", "}\nMOTION", "does not belong here"),
        ("\n{\n\tOFFSET 1", "\n\tOFFSET 1", "does not belong here"),
    ],
)
def test_a_broken_file_is_one_clear_line(old, new, complaint, tmp_path):
    assert old in PLAIN
    path = written(tmp_path / "a.bvh", PLAIN.replace(old, new, 1))
    with pytest.raises(FileError, match=complaint) as caught:
        read_bvh(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_joints_without_channels_cannot_blow_up_memory(tmp_path):
    joints = (
        "".join(f"JOINT j{i}\n{{\nOFFSET 0 0 1\n" for i in range(5000)) + "}\n" * 5000
    )
    text = f"HIERARCHY\nROOT r\n{{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n{joints}}}\n"
    text += "MOTION\nFrames: 20000\nFrame Time: 0.01\n" + "0\n" * 20000
    with pytest.raises(FileError, match="no channels"):
        read_bvh(written(tmp_path / "a.bvh", text))


@given(data=st.data())
def test_damaged_files_raise_nothing_but_our_errors(data, tmp_path_factory):
    path = tmp_path_factory.mktemp("fuzz") / "a.bvh"
    raw = bytearray(PLAIN.encode())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(raw) - 1))
        raw[at : at + data.draw(st.integers(0, 2))] = data.draw(st.binary(max_size=3))
    path.write_bytes(raw[: data.draw(st.integers(0, len(raw)))])
    try:
        bvh = read_bvh(path, lenient=data.draw(st.booleans()))
    except HandcleanError:
        return
    assert bvh.frames > 0


# --- out ----------------------------------------------------------------------------


def moving(rng, tree, frames=60):
    """Smooth poses within the limits, the root turned anyhow."""
    time = np.linspace(0, 1, frames)[:, None]
    speed, phase = rng.uniform(2, 9, (2, len(tree.hinges)))
    share = 0.5 + 0.4 * np.sin(speed * time + phase)
    poses = np.zeros((frames, 7 + len(tree.hinges)))
    poses[:, :3] = rng.normal(size=3) + 0.1 * time
    turn = Rotation.random(rng=rng) * Rotation.from_rotvec(time * rng.normal(size=3))
    poses[:, 3:7] = turn.as_quat(scalar_first=True)
    poses[:, 7:] = tree.limits[:, 0] + share * np.ptp(tree.limits, axis=1)
    return poses


def a_take(tree, poses, name="right", rate=120.0, up_axis="+y"):
    motion = motion_from_poses(tree.hinges, poses)
    return Recording(
        rate=rate,
        frames=len(poses),
        up_axis=up_axis,
        skeletons={name: tree},
        motions={name: motion},
    )


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("forearm", [False, True])
def test_a_written_hierarchy_moves_as_our_own_kinematics(side, forearm, rng, tmp_path):
    tree = template(side, 0.2, forearm=forearm)
    poses = moving(rng, tree)
    assert write_bvh(tmp_path / "a.bvh", a_take(tree, poses)) == ()
    bvh = read_bvh(tmp_path / "a.bvh")
    order = [bvh.names.index(joint) for joint in tree.joints]
    places, turns = bvh.forward()
    np.testing.assert_allclose(
        places[:, order] / 100, joint_positions(tree, poses), atol=1e-9
    )
    np.testing.assert_allclose(turns[:, order], bone_rotations(tree, poses), atol=1e-9)
    tip = bvh.ends[bvh.names.index("index_dip")]
    assert np.linalg.norm(tip) / 100 == pytest.approx(distal_length(tree, "index"))
    assert bvh.rate == 120.0


def test_two_hands_hang_on_one_world(rng, tmp_path):
    trees = {"left": template("left"), "right": template("right")}
    poses = {name: moving(rng, tree, 5) for name, tree in trees.items()}
    take = Recording(
        rate=60.0,
        frames=5,
        up_axis="+y",
        skeletons=trees,
        motions={n: motion_from_poses(t.hinges, poses[n]) for n, t in trees.items()},
    )
    write_bvh(tmp_path / "a.bvh", take)
    bvh = read_bvh(tmp_path / "a.bvh")
    assert list(bvh.parents).count(-1) == 1
    places, _ = bvh.forward()
    for name, tree in trees.items():
        order = [bvh.names.index(f"{name}_{joint}") for joint in tree.joints]
        np.testing.assert_allclose(
            places[:, order] / 100, joint_positions(tree, poses[name]), atol=1e-9
        )


def test_missing_frames_hold_the_last_pose_and_are_noted(rng, tmp_path):
    tree = template("right")
    poses = moving(rng, tree, 6)
    poses[[0, 3, 4], 7] = np.nan
    notes = texts(write_bvh(tmp_path / "a.bvh", a_take(tree, poses)))
    assert len(notes) == 1
    assert "3 frames" in notes[0]
    held = poses[[1, 1, 2, 2, 2, 5]]
    places, _ = read_bvh(tmp_path / "a.bvh").forward()
    np.testing.assert_allclose(places[:, 0] / 100, held[:, :3], atol=1e-9)


UP = {"+x": [1, 0, 0], "+y": [0, 1, 0], "+z": [0, 0, 1]}
UP |= {f"-{axis[1]}": [-x for x in up] for axis, up in UP.items()}


@pytest.mark.parametrize("wanted", ["+y", "+z"])
@pytest.mark.parametrize("up_axis", sorted(UP))
def test_what_is_up_in_the_take_is_up_in_the_file(up_axis, wanted, rng, tmp_path):
    trees = {"left": template("left"), "right": template("right")}
    poses = {name: moving(rng, tree, 5) for name, tree in trees.items()}
    take = Recording(
        rate=60.0,
        frames=5,
        up_axis=up_axis,
        skeletons=trees,
        motions={n: motion_from_poses(t.hinges, poses[n]) for n, t in trees.items()},
    )
    remarks = texts(write_bvh(tmp_path / "a.bvh", take, bvh_up=wanted))
    said = f"turned, so that {up_axis} of the take is {wanted} of the file"
    assert remarks == (() if up_axis == wanted else (f"{said} (convert --bvh-up)",))
    bvh = read_bvh(tmp_path / "a.bvh")
    places, turns = bvh.forward()
    for name, tree in trees.items():
        order = [bvh.names.index(f"{name}_{joint}") for joint in tree.joints]
        at, ours = places[:, order] / 100, joint_positions(tree, poses[name])
        np.testing.assert_allclose(at @ UP[wanted], ours @ UP[up_axis], atol=1e-9)
        turn = turns[:, order] @ bone_rotations(tree, poses[name]).swapaxes(-1, -2)
        np.testing.assert_allclose(turn - turn[0, 0], 0.0, atol=1e-9)
        np.testing.assert_allclose(at, ours @ turn[0, 0].T, atol=1e-9)
        assert np.linalg.det(turn[0, 0]) == pytest.approx(1.0)
    back = read_bvh_angles(tmp_path / "a.bvh").recording
    assert back.up_axis == wanted
    write_bvh(tmp_path / "b.bvh", back, bvh_up=wanted)
    again, _ = read_bvh(tmp_path / "b.bvh").forward()
    np.testing.assert_allclose(again, places, atol=1e-6)


def test_a_take_that_does_not_say_what_is_up_is_taken_for_z_and_said(rng, tmp_path):
    tree = template("right")
    poses = moving(rng, tree, 5)
    for up_axis in ("", "+z"):
        path = tmp_path / f"a{up_axis}.bvh"
        remarks = texts(write_bvh(path, a_take(tree, poses, up_axis=up_axis)))
        assert len(remarks) == 1
        assert ("does not say which way is up" in remarks[0]) == (not up_axis)
    assert (tmp_path / "a.bvh").read_text() == (tmp_path / "a+z.bvh").read_text()


def test_the_up_axis_of_another_program_is_y(rng, tmp_path):
    tree = template("right")
    take = a_take(tree, moving(rng, tree, 60))
    write_bvh(tmp_path / "a.bvh", take, bvh_up="+z")
    assert read_bvh_angles(tmp_path / "a.bvh").recording.up_axis == "+z"
    assert read_bvh_angles(tmp_path / "a.bvh", foreign()).recording.up_axis == "+y"


def test_what_cannot_be_written_is_an_error(rng, tmp_path):
    tree = template("right")
    take = a_take(tree, moving(rng, tree, 3))
    path = tmp_path / "a.bvh"
    with pytest.raises(FileError, match="no joint angles"):
        write_bvh(path, Recording(rate=1.0, frames=3))
    with pytest.raises(FileError, match=r"no joint tree.*solve"):
        write_bvh(path, replace(take, skeletons={}))
    with pytest.raises(FileError, match="all missing"):
        write_bvh(path, a_take(tree, np.full((3, 27), np.nan)))
    few = Motion(names=("x",), angles=np.zeros((3, 1)))
    with pytest.raises(UnknownNameError, match="joint angle"):
        write_bvh(path, replace(take, motions={"right": few}))
    assert not path.exists()


# --- through a joint map ------------------------------------------------------------


TEXT = np.radians(1e-7)
"""What nine digits of a degree leave, in Euler angles and what they are made into."""


def leaning(tree, rng, degrees=3.0):
    """The tree with hinge axes and offsets of its own, as a calibrated subject's."""
    axes = tree.axes + rng.normal(0.0, np.radians(degrees), tree.axes.shape)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    size = rng.lognormal(0.0, 0.1, (len(tree.bones), 1))
    return replace(tree, axes=axes, offsets=tree.offsets * size)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("forearm", [False, True])
@pytest.mark.parametrize("own", [False, True])
def test_our_own_files_give_everything_back(side, forearm, own, rng, tmp_path):
    tree = template(side, 0.17, forearm=forearm)
    tree = leaning(tree, rng) if own else tree
    poses = moving(rng, tree, 200)
    write_bvh(tmp_path / "a.bvh", a_take(tree, poses, side))
    reading = read_bvh_angles(tmp_path / "a.bvh")
    take = reading.recording
    motion, back = take.motions[side], take.skeletons[side]
    assert motion.names == tree.hinges
    np.testing.assert_allclose(motion.angles, poses[:, 7:], rtol=0, atol=TEXT)
    np.testing.assert_allclose(motion.translation, poses[:, :3], atol=1e-11)
    turn = rotations.matrix_from_quaternion(motion.rotation)
    expected = rotations.matrix_from_quaternion(poses[:, 3:7])
    np.testing.assert_allclose(turn, expected, rtol=0, atol=TEXT)
    assert motion.trusted is None  # the file does not say
    assert (back.side, back.bones, back.hinges) == (side, tree.bones, tree.hinges)
    np.testing.assert_allclose(back.offsets, tree.offsets, atol=1e-11)
    np.testing.assert_allclose(back.axes, tree.axes, atol=1e-6)
    np.testing.assert_allclose(
        joint_positions(back, motion.poses), joint_positions(tree, poses), atol=1e-9
    )
    assert take.parameters["BVH"]["joint_map"] == "handclean"
    assert texts(reading.remarks) == ()
    assert take.events == ()


def test_no_frame_of_our_own_files_is_taken_for_a_jump(rng, tmp_path):
    tree = leaning(template("right"), rng)
    poses = moving(rng, tree, 60)
    poses[:, 7:] = rng.permuted(poses[:, 7:], axis=0)  # faster than any finger
    write_bvh(tmp_path / "a.bvh", a_take(tree, poses))
    reading = read_bvh_angles(tmp_path / "a.bvh")
    motion = reading.recording.motions["right"]
    np.testing.assert_allclose(motion.angles, poses[:, 7:], rtol=0, atol=TEXT)
    assert motion.trusted is None  # the file does not say
    assert texts(reading.remarks) == ()


def test_hinges_that_stand_still_at_zero_have_no_part_in_the_others(rng, tmp_path):
    tree = leaning(template("left"), rng)
    poses = moving(rng, tree, 60)
    still = [n for n, name in enumerate(tree.hinges) if "abduction" in name]
    still += [tree.hinges.index("ring_dip_flexion")]
    poses[:, 7:][:, still] = 0.0
    write_bvh(tmp_path / "a.bvh", a_take(tree, poses, "left"))
    reading = read_bvh_angles(tmp_path / "a.bvh")
    motion = reading.recording.motions["left"]
    np.testing.assert_allclose(motion.angles, poses[:, 7:], rtol=0, atol=TEXT)
    assert texts(reading.remarks) == ()


def test_bones_that_move_too_little_to_tell_their_axes_are_named(rng, tmp_path):
    tree = template("right")
    poses = moving(rng, tree, 60)
    stiff = [tree.hinges.index(f"ring_mcp_{kind}") for kind in ("abduction", "flexion")]
    poses[:, 7:][:, stiff] = [0.1, 0.6]
    write_bvh(tmp_path / "a.bvh", a_take(tree, poses))
    reading = read_bvh_angles(tmp_path / "a.bvh")
    motion = reading.recording.motions["right"]
    np.testing.assert_allclose(motion.angles, poses[:, 7:], rtol=0, atol=TEXT)
    [trap] = texts(reading.remarks)
    assert trap.startswith("move too little to tell their hinge axes")
    assert trap.endswith(": right ring_proximal")


def test_a_written_file_is_written_again_as_it_was(rng, tmp_path):
    tree = leaning(template("right", forearm=True), rng)
    write_bvh(tmp_path / "a.bvh", a_take(tree, moving(rng, tree, 50), rate=59.9401))
    again = read_bvh_angles(tmp_path / "a.bvh").recording
    assert again.rate == pytest.approx(59.9401, rel=1e-11)
    write_bvh(tmp_path / "b.bvh", again)
    a, b = read_bvh(tmp_path / "a.bvh"), read_bvh(tmp_path / "b.bvh")
    assert a.names == b.names
    np.testing.assert_allclose(b.turns, a.turns, rtol=0, atol=TEXT)
    np.testing.assert_allclose(b.places, a.places, atol=2e-9)


def test_two_hands_and_an_object_come_back_by_their_names(rng, tmp_path):
    trees = {"left": template("left"), "right_2": leaning(template("right"), rng)}
    cup = rigid_tree()
    poses = {name: moving(rng, tree, 40) for name, tree in trees.items()}
    motions = {n: motion_from_poses(t.hinges, poses[n]) for n, t in trees.items()}
    take = Recording(
        rate=60.0,
        frames=40,
        up_axis="+y",
        skeletons={**trees, "cup": cup},
        motions={**motions, "cup": motion_from_poses((), poses["left"][:, :7])},
    )
    write_bvh(tmp_path / "a.bvh", take)
    reading = read_bvh_angles(tmp_path / "a.bvh")
    found = reading.recording.motions
    assert set(found) == {*trees, "cup"}
    poses["cup"] = poses["left"][:, :7]
    assert reading.recording.skeletons["cup"].kind == "rigid"
    for name, motion in found.items():
        wanted = poses[name]
        np.testing.assert_allclose(motion.angles, wanted[:, 7:], rtol=0, atol=TEXT)
        np.testing.assert_allclose(motion.translation, wanted[:, :3], atol=1e-10)
    for name, tree in trees.items():
        assert reading.recording.skeletons[name].side == tree.side
    assert texts(reading.remarks) == ()


def test_turns_that_an_editor_gave_a_finger_are_reported(rng, tmp_path):
    tree = template("right")
    write_bvh(tmp_path / "a.bvh", a_take(tree, moving(rng, tree, 50)))
    lines = (tmp_path / "a.bvh").read_text().splitlines()
    start = 1 + next(i for i, line in enumerate(lines) if line.startswith("Frame T"))
    bvh = read_bvh(tmp_path / "a.bvh")
    column = 6 + 3 * (bvh.names.index("ring_pip") - 1) + 2  # about y, along the bone
    for i in range(start, len(lines)):
        cells = lines[i].split()
        cells[column] = str(float(cells[column]) + 10.0 * np.sin(i))
        lines[i] = " ".join(cells)
    (tmp_path / "a.bvh").write_text("\n".join(lines))
    reading = read_bvh_angles(tmp_path / "a.bvh")
    held = reading.recording.parameters["BVH"]["not_held"]
    assert held["ring_middle"]["rms_deg"] == pytest.approx(10 / np.sqrt(2), rel=0.1)
    assert held["ring_proximal"]["rms_deg"] < 1e-6
    assert "ring_middle" in texts(reading.remarks)[0]


def disguised(tree, poses, rng, *, mirrored, split):
    """The same motion in somebody else's hierarchy.

    Every joint has a rest rotation of its own and another name; the axes may be
    left-handed; the unit is a decimetre; the thumb's base may be split in two.
    """
    frames = len(poses)
    flip = np.array([1.0, 1.0, -1.0 if mirrored else 1.0])
    own = Rotation.random(len(tree.bones), rng=rng).as_matrix()
    world = flip[:, None] * bone_rotations(tree, poses) @ np.diag(flip) @ own
    places = 10 * flip * joint_positions(tree, poses)
    names = [f"J_{joint}" for joint in tree.joints]
    parents = tree.parents.copy()
    if split:
        thumb = tree.joints.index("thumb_cmc")
        names.append("J_extra")
        half = np.tile(Rotation.random(rng=rng).as_matrix(), (frames, 1, 1))
        world = np.concatenate([world, (world[:, 0] @ half)[:, None]], axis=1)
        mid = 0.5 * (places[:, 0] + places[:, thumb])
        places = np.concatenate([places, mid[:, None]], axis=1)
        parents = np.append(parents, 0)
        parents[thumb] = len(names) - 1
    local, turns = places.copy(), world.copy()
    for j, up in enumerate(parents):
        if up >= 0:
            back = np.swapaxes(world[:, up], 1, 2)
            turns[:, j] = back @ world[:, j]
            local[:, j] = np.einsum("tij,tj->ti", back, places[:, j] - places[:, up])
    ends = np.full((len(names), 3), np.nan)
    for finger in ("thumb", "index", "middle", "ring", "little"):
        b = tree.bone(f"{finger}_distal")
        along = tree.offsets[b] / np.linalg.norm(tree.offsets[b])
        ends[b] = own[b].T @ (flip * along)
    joints = dict(zip(tree.bones, names, strict=False))
    joint_map = JointMap(
        name="disguise",
        left_handed=mirrored,
        unit_m=0.1,
        back=own[0].T @ (flip * [0.0, 0.0, 1.0]),
        bones=joints,
    )
    bvh = BvhMotion(
        names=tuple(names),
        parents=parents,
        offsets=local[0],
        places=local,
        turns=turns,
        ends=ends,
        rate=120.0,
    )
    return bvh, joint_map


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("split", [False, True])
def test_rest_rotations_and_mirrored_axes_do_not_reach_the_angles(
    side, mirrored, split, rng
):
    tree = template(side)
    poses = moving(rng, tree, 300)
    bvh, joint_map = disguised(tree, poses, rng, mirrored=mirrored, split=split)
    mapped = map_motion(bvh, joint_map, template("left"))
    assert mapped.side == side
    assert mapped.hinges == tree.hinges
    np.testing.assert_allclose(mapped.angles, poses[:, 7:], atol=2e-6)
    np.testing.assert_allclose(mapped.translation, poses[:, :3], atol=1e-9)
    expected = rotations.matrix_from_quaternion(poses[:, 3:7])
    np.testing.assert_allclose(mapped.rotation, expected, atol=1e-9)
    for fit in mapped.fits.values():
        assert fit.rms_deg < 1e-3
        assert fit.tilt_deg < 1e-3


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_foreign_hand_gets_a_tree_whose_joints_are_where_the_file_has_them(
    side, mirrored, rng
):
    tree = template(side)
    stretch = rng.uniform(0.8, 1.2, (len(tree.bones), 1))
    stretch[tree.parents == 0] = 1.1
    tree = replace(tree, offsets=stretch * tree.offsets)
    poses = moving(rng, tree, 300)
    bvh, joint_map = disguised(tree, poses, rng, mirrored=mirrored, split=False)
    mapped = map_motion(bvh, joint_map, template("left"))
    found = stand_in(mapped)
    assert (found.side, found.hinges) == (side, tree.hinges)
    np.testing.assert_allclose(found.offsets, tree.offsets, atol=1e-9)
    again = np.column_stack([poses[:, :7], mapped.angles])
    np.testing.assert_allclose(
        joint_positions(found, again), joint_positions(tree, poses), atol=1e-6
    )
    assert stand_in(replace(mapped, size=10.0)) is None
    assert stand_in(replace(mapped, hinges=mapped.hinges[1:])) is None


@pytest.mark.parametrize("suffix", [".bvh", ".glb"])
def test_a_foreign_files_motion_can_be_written_with_a_hierarchy(suffix, rng, tmp_path):
    tree = template("right")
    write_bvh(tmp_path / "a.bvh", a_take(tree, moving(rng, tree, 300)))
    reading = read_bvh_angles(tmp_path / "a.bvh", foreign())
    files.write(tmp_path / f"b{suffix}", reading.recording)
    assert (tmp_path / f"b{suffix}").stat().st_size > 1000
    assert any("the template's axes" in trap for trap in texts(reading.remarks))


def test_rotation_that_hinges_cannot_hold_is_reported_where_it_is(rng):
    tree = template("left")
    bvh, joint_map = disguised(
        tree, moving(rng, tree, 300), rng, mirrored=False, split=False
    )
    j = bvh.names.index("J_ring_pip")
    d = bvh.places[0, bvh.names.index("J_ring_dip")]
    twist = np.radians(12) * np.sin(np.linspace(0, 40, 300))
    bvh.turns[:, j] = bvh.turns[:, j] @ rotations.about_line(
        d / np.linalg.norm(d), twist
    )
    mapped = map_motion(bvh, joint_map, tree)
    assert mapped.fits["ring_middle"].rms_deg == pytest.approx(12 / np.sqrt(2), rel=0.1)
    assert mapped.fits["ring_middle"].max_deg == pytest.approx(12, rel=0.2)
    assert mapped.fits["index_middle"].rms_deg < 1e-3


def foreign():
    """The map of our own files, taken for somebody else's."""
    return replace(load_joint_map(SHIPPED / "handclean.toml"), exact=False)


def test_tracking_jumps_are_left_out_and_only_they(rng, tmp_path):
    tree = template("right")
    poses = moving(rng, tree, 300)
    dip = 7 + tree.hinges.index("little_dip_flexion")
    poses[100:140, dip] += 1.2  # there and back within a third of a second
    poses[220:, dip] -= 0.9  # once
    write_bvh(tmp_path / "a.bvh", a_take(tree, poses))
    reading = read_bvh_angles(tmp_path / "a.bvh", foreign())
    motion = reading.recording.motions["right"]
    left_out = np.flatnonzero(~motion.trusted)
    assert left_out.tolist() == [*range(99, 141), 219, 220]
    assert np.isnan(motion.angles[left_out]).all()
    keep = motion.trusted
    np.testing.assert_allclose(motion.angles[keep], poses[keep, 7:], atol=2e-6)
    assert [(e.start, e.stop) for e in reading.recording.events] == [
        (99, 141),
        (219, 221),
    ]
    assert any("44 frames" in trap for trap in texts(reading.remarks))


def test_options_must_agree_with_the_map(rng, tmp_path):
    tree = template("right")
    write_bvh(tmp_path / "a.bvh", a_take(tree, moving(rng, tree, 5)))
    read_bvh_angles(tmp_path / "a.bvh", unit="cm", rate_hz=120.0)
    plain = read_bvh_angles(tmp_path / "a.bvh").recording.motions["right"]
    other = read_bvh_angles(tmp_path / "a.bvh", unit="mm")
    assert texts(other.remarks)[0].startswith(
        "--unit mm is taken, though the unit is the 0.01 m"
    )
    place = other.recording.motions["right"].translation
    np.testing.assert_allclose(place, 0.1 * plain.translation)
    with pytest.raises(UsageError, match="--rate 60 contradicts"):
        read_bvh_angles(tmp_path / "a.bvh", rate_hz=60.0)


def test_a_hierarchy_that_no_map_fits_is_an_error(tmp_path):
    with pytest.raises(FileError, match="no joint map fits its joints"):
        read_bvh_angles(written(tmp_path / "a.bvh", PLAIN))


def test_joints_on_one_spot_are_an_error(rng, tmp_path):
    tree = template("right")
    flat = replace(tree, offsets=np.zeros_like(tree.offsets))
    write_bvh(tmp_path / "a.bvh", a_take(flat, moving(rng, flat, 5)))
    with pytest.raises(FileError, match="no length"):
        read_bvh_angles(tmp_path / "a.bvh", foreign())


def test_shipped_maps_name_the_bones_of_the_template():
    maps = {joint_map.name: joint_map for joint_map in shipped()}
    assert {"manipnet", "handclean"} <= set(maps)
    for joint_map in maps.values():
        assert set(joint_map.bones) == set(template("left").bones)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("x = 1", "no key is called 'x'"),
        ("", "no unit_m"),
        ("unit_m = 0", "unit_m is 0; give the file's unit"),
        ("unit_m = 1", "no back"),
        ("unit_m = 1\nback = [0, 0]", r"back is \[0, 0\]"),
        ("unit_m = 1\nback = [0, 0, 0]", r"back is \[0, 0, 0\]"),
        ("unit_m = 1\nback = [0, 1e200, 0]", r"back is \[0, 1e\+200, 0\]"),
        ("unit_m = 1\nback = [0, 0, 1]", r"no \[bones\]"),
        (
            "unit_m = 1\nback = [0, 0, 1]\n[bones]\nhand = 3",
            r"\[bones\]: hand is 3; give a joint's name",
        ),
        ("back = [", "not a joint map"),
    ],
)
def test_a_broken_map_is_one_clear_line(text, complaint, tmp_path):
    with pytest.raises(HandcleanError, match=complaint) as caught:
        load_joint_map(written(tmp_path / "map.toml", text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda bones: bones | {"hand": "J_none"}, "no joint 'J_none'"),
        (lambda bones: bones | {"palm": "J_wrist"}, "no bone is called 'palm'"),
        (lambda bones: bones | {"index_middle": "J_ring_pip"}, "does not hang on"),
        (lambda bones: bones | {"index_middle": "J_index_mcp"}, "does not hang on"),
        (
            lambda bones: {b: j for b, j in bones.items() if b != "index_middle"},
            "index_distal is mapped, index_middle is not",
        ),
    ],
)
def test_a_map_that_does_not_fit_is_an_error(change, complaint, rng):
    tree = template("left")
    bvh, joint_map = disguised(
        tree, moving(rng, tree, 9), rng, mirrored=False, split=False
    )
    with pytest.raises(HandcleanError, match=complaint):
        map_motion(bvh, replace(joint_map, bones=change(dict(joint_map.bones))), tree)


def test_bones_that_are_not_mapped_have_no_angles(rng):
    tree = template("left")
    bvh, joint_map = disguised(
        tree, moving(rng, tree, 50), rng, mirrored=False, split=False
    )
    bones = {b: j for b, j in joint_map.bones.items() if not b.startswith("thumb")}
    mapped = map_motion(bvh, replace(joint_map, bones=bones), tree)
    assert mapped.hinges == tree.hinges[4:]


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("thing", ["cup1", "mug1", "teapot2", "wineglass3"])
def test_real_hands_move_within_human_limits(side, thing, shared_data):
    reading = read_bvh_angles(shared_data / "manipnet" / thing / f"{side}Hand.bvh")
    take = reading.recording
    assert list(take.motions) == [side]
    motion = take.motions[side]
    tree = template(side)
    assert motion.names == tree.hinges
    assert (take.frames, take.rate) == (4000, 120.0)
    assert np.count_nonzero(~motion.trusted) < 80
    angles = motion.angles[motion.trusted]
    outside = (angles < tree.limits[:, 0]) | (angles > tree.limits[:, 1])
    assert outside.mean(axis=0).max() < 0.03
    assert outside.mean() < 0.002
    flexions = [d for d, name in enumerate(motion.names) if "_pip_" in name]
    assert np.degrees(angles[:, flexions]).min() > -10
    assert np.degrees(np.percentile(angles[:, flexions], 99)) > 50
    held = take.parameters["BVH"]["not_held"]
    for bone, fit in held.items():
        two = bone.endswith("proximal") or bone == "thumb_metacarpal"
        most = 10.0 if two and bone != "thumb_proximal" else 0.5
        assert fit["rms_deg"] < most, bone
    np.testing.assert_allclose(np.linalg.norm(motion.rotation, axis=1), 1.0)


def test_the_real_jump_of_92_degrees_is_found(shared_data):
    path = shared_data / "manipnet" / "teapot2" / "rightHand.bvh"
    motion = read_bvh_angles(path).recording.motions["right"]
    assert not motion.trusted[2853:2917].any()
    assert motion.trusted[2800:2850].all()


def test_a_tree_as_deep_as_there_may_be_is_written(tmp_path):
    """A chain of bones, with one that hangs beside its end."""
    bones = tuple(f"b{n}" for n in range(MOST_BONES))
    parents = np.arange(-1, MOST_BONES - 1)
    parents[-1] = MOST_BONES - 3
    tree = JointTree(
        kind="rigid",
        side="",
        bones=bones,
        joints=bones,
        parents=parents,
        offsets=np.ones((MOST_BONES, 3)),
        hinges=(),
        hinge_bone=np.zeros(0, dtype=np.int64),
        axes=np.zeros((0, 3)),
        limits=np.zeros((0, 2)),
    )
    poses = np.zeros((2, 7))
    poses[:, 3] = 1.0
    write_bvh(
        tmp_path / "a.bvh",
        Recording(
            rate=100.0,
            frames=2,
            motions={"chain": motion_from_poses((), poses)},
            skeletons={"chain": tree},
        ),
    )
    back = read_bvh(tmp_path / "a.bvh")
    assert back.names == bones
    np.testing.assert_array_equal(back.parents, parents)


def test_many_objects_beside_a_hand_cost_little(tmp_path):
    hand = template("right")
    poses = np.zeros((2, 7 + len(hand.hinges)))
    poses[:, 3] = 1.0
    cups = {f"cup{n}": rigid_tree() for n in range(2000)}
    motions = {"right": motion_from_poses(hand.hinges, poses)}
    motions |= {name: motion_from_poses((), poses[:, :7]) for name in cups}
    trees = {"right": hand, **cups}
    take = Recording(rate=100.0, frames=2, motions=motions, skeletons=trees)
    write_bvh(tmp_path / "a.bvh", take)
    began = time.process_time()
    back = read_bvh_angles(tmp_path / "a.bvh").recording
    assert time.process_time() - began < 5.0
    assert set(back.motions) == set(motions)


# --- names of HumanIK and Mixamo ----------------------------------------------------

FINGER = {"thumb": "Thumb", "index": "Index", "middle": "Middle", "ring": "Ring"}
FINGER |= {"little": "Pinky"}


def humanik_name(joint):
    """``left_index_mcp`` as HumanIK has it: ``LeftHandIndex1``."""
    side, _, rest = joint.partition("_")
    if rest == "wrist":
        return f"{side.capitalize()}Hand"
    finger, _, part = rest.partition("_")
    order = ("cmc", "mcp", "ip") if finger == "thumb" else ("mcp", "pip", "dip")
    return f"{side.capitalize()}Hand{FINGER[finger]}{1 + order.index(part)}"


def humanik(path, take, head="", scale=1.0, sides=("left", "right")):
    """Write hands under the names of HumanIK, fingers with a fourth joint each."""
    write_bvh(path, take)
    lines, hierarchy = [], True
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["MOTION"]:
            hierarchy = False
        if words[:1] in (["JOINT"], ["ROOT"]) and "_" not in words[1]:
            line = line.replace(words[1], f"{head}Hips")
        elif words[:1] == ["JOINT"]:
            line = line.replace(words[1], head + humanik_name(words[1]))
        elif words[:1] == ["OFFSET"]:
            numbers = " ".join(f"{scale * float(x):.9f}" for x in words[1:])
            line = f"OFFSET {numbers}"
        elif not hierarchy and len(words) > 12 and scale != 1.0:
            numbers = np.array(words, dtype=float)
            for side in sides:
                at = 6 + sides.index(side) * (6 + 45)
                numbers[at : at + 3] *= scale
            line = " ".join(f"{x:.9f}" for x in numbers)
        lines.append(line)
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def hands(rng):
    """Two hands that move, of the template's axes and bones of their own length."""
    trees = {"left": template("left"), "right": template("right", 0.2)}
    poses = {name: moving(rng, tree, 200) for name, tree in trees.items()}
    return Recording(
        rate=100.0,
        frames=200,
        up_axis="+y",
        skeletons=trees,
        motions={n: motion_from_poses(t.hinges, poses[n]) for n, t in trees.items()},
    )


@pytest.mark.parametrize("head", ["", "mixamorig:", "mixamorig", "Character1_"])
def test_both_hands_of_humanik_and_mixamo_are_read(head, hands, tmp_path):
    reading = read_bvh_angles(humanik(tmp_path / "a.bvh", hands, head))
    take = reading.recording
    assert take.parameters["BVH"]["joint_map"] == "humanik"
    assert set(take.motions) == set(take.skeletons) == {"left", "right"}
    for side, motion in take.motions.items():
        ours, tree = hands.motions[side], hands.skeletons[side]
        assert motion.names == tree.hinges
        np.testing.assert_allclose(motion.translation, ours.translation, atol=1e-9)
        known = motion.trusted
        assert known.mean() > 0.9
        # where a finger points at zero is the template's: so the angles are, nearly
        off = np.degrees(motion.angles[known] - ours.angles[known])
        assert np.abs(off).max() < 0.2
        at = joint_positions(take.skeletons[side], motion.poses)[known]
        np.testing.assert_allclose(
            at, joint_positions(tree, ours.poses)[known], atol=5e-4
        )


@pytest.mark.parametrize(
    ("scale", "unit"), [(1.0, "0.01 m"), (0.01, "1 m"), (10.0, "0.001 m")]
)
def test_the_unit_of_such_files_is_one_with_which_hands_are_hands(
    scale, unit, hands, tmp_path
):
    path = humanik(tmp_path / "a.bvh", hands, "mixamorig:", scale)
    reading = read_bvh_angles(path)
    assert reading.unit == unit
    assert set(reading.recording.skeletons) == {"left", "right"}
    place = reading.recording.motions["right"].translation
    want = hands.motions["right"].translation
    np.testing.assert_allclose(place, want, atol=1e-6)
    said = [one for one in reading.remarks if one.kind == "unit"]
    assert len(said) == (scale != 1.0)
    known = read_bvh_angles(path, unit={"0.01 m": "cm", "1 m": "m"}.get(unit, "mm"))
    assert known.unit == unit
    assert not [one for one in known.remarks if one.kind == "unit"]


def test_a_file_with_the_fingers_of_one_hand_has_that(hands, tmp_path):
    path = humanik(tmp_path / "a.bvh", hands, "P1:")
    text = path.read_text().replace("P1:LeftHandIndex2", "P1:LeftIndexTwo")
    path.write_text(text)
    assert list(read_bvh_angles(path).recording.motions) == ["right"]


def test_two_people_are_told_apart_by_what_their_joints_begin_with(hands, tmp_path):
    text = humanik(tmp_path / "a.bvh", hands, "P1:").read_text()
    half = text.index("JOINT P1:RightHand\n")
    text = text[:half] + text[half:].replace("P1:Right", "P2:Left")
    (tmp_path / "a.bvh").write_text(text)
    take = read_bvh_angles(tmp_path / "a.bvh").recording
    assert set(take.motions) == {"P1_left", "P2_left"}


def test_a_tip_joint_or_an_end_site_says_where_a_finger_points(hands, tmp_path):
    path = humanik(tmp_path / "a.bvh", hands)
    before = read_bvh_angles(path).recording.motions["left"].angles
    text = path.read_text()
    count = text.count("End Site")
    for number in range(count):
        text = text.replace("End Site", f"JOINT tip{number}", 1)
    text = re.sub(r"(JOINT tip\d+\s*\{\s*OFFSET[^\n]*\n)", r"\1CHANNELS 0\n", text)
    path.write_text(text)
    after = read_bvh_angles(path).recording.motions["left"].angles
    np.testing.assert_allclose(after, before, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('[sides]\nleft = "L"', r"\[sides\] lacks one; write left = WORD"),
        ('[sides]\nleft = "L"\nup = "U"', "no side is called 'up'"),
        ('[sides]\nleft = "L"\nright = 3', r"right is 3; give the word"),
        ('[sides]\nleft = "L"\nright = "R"', "joint 'wrist' has no {side}"),
        ("other_units_m = 3", "other_units_m is 3; give a list of lengths"),
        ("other_units_m = [0]", r"other_units_m is \[0\]; give a list of lengths"),
        ("other_units_m = []", r"other_units_m is \[\]; give a list of lengths"),
    ],
)
def test_broken_sides_of_a_map_are_one_clear_line(text, complaint, tmp_path):
    units, sides = (text, "") if text.startswith("other") else ("", text)
    text = f'unit_m = 1\nback = [0, 0, 1]\n{units}\n[bones]\nhand = "wrist"\n{sides}'
    with pytest.raises(HandcleanError, match=complaint):
        load_joint_map(written(tmp_path / "map.toml", text))
