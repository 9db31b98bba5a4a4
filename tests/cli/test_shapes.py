"""Skinned hands, subjects and meshes on the command line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gltf_oracle import Scene

from handclean.hand.marker_set import load_marker_set
from handclean.hand.skinning import posed
from handclean.hand.subject import template_subject
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.io import files
from handclean.io.gltf.write import write_hand
from handclean.io.hdf5.subject import read_subject, write_subject
from handclean.io.mesh.meshes import Mesh, read_mesh, write_mesh
from handclean.recording import Recording, motion_from_poses


@pytest.fixture
def moved(rng):
    """A solved take of a right hand, and its poses."""
    tree = template("right")
    poses = np.zeros((5, 7 + len(tree.hinges)))
    poses[:, 3] = 1.0
    poses[:, 7:] = rng.uniform(0.0, 0.5, (5, len(tree.hinges)))
    return tree, poses


def write_take(path, tree, poses):
    motion = motion_from_poses(tree.hinges, poses)
    recording = Recording(
        rate=50.0,
        frames=len(poses),
        up_axis="+y",
        skeletons={"right": tree},
        motions={"right": motion},
    )
    files.write(path, recording)


def test_a_motion_wears_the_subject_s_own_skin(handclean, moved):
    tree, poses = moved
    write_take(Path("m.h5"), tree, poses)
    plump = template_surface(tree, coarse=True, plump=1.2)
    subject = template_subject(load_marker_set("schroeder8"))
    write_subject(Path("s.h5"), replace(subject, surface=plump))
    for options, surface in (
        ((), template_surface(tree)),
        (("--subject", "s.h5", "--overwrite"), plump),
    ):
        done = handclean("convert", "m.h5", "-o", "m.glb", *options)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout == "m.h5 -> m.glb: 5 frames at 50 Hz, 1 motion\n"
        scene = Scene(Path("m.glb"))
        found = scene.vertices(scene.skinned[0], 3 / 50.0)
        expected = posed(surface, tree, poses[3:4])[0]
        np.testing.assert_allclose(found, expected, atol=1e-5)
    assert Path("m.glb.made.json").is_file()
    told = handclean("inspect", "m.glb").stdout
    assert told.startswith("m.glb: glb, 5 frames at 50 Hz, a skinned right hand, 16 ")


def test_the_motion_of_a_glb_is_said_to_be_left_behind(handclean, moved):
    tree, poses = moved
    write_take(Path("m.h5"), tree, poses)
    files.write("moves.glb", files.read("m.h5"))
    write_hand(Path("rests.glb"), tree, None)
    for name, told in (("moves.glb", True), ("rests.glb", False)):
        done = handclean("convert", name, "-o", f"{name}.h5")
        assert done.returncode == 0
        assert ("warning: its motion is not read" in done.stderr) == told


def test_a_skin_of_the_other_hand_is_refused_and_one_of_another_person_told(
    handclean, moved
):
    tree, poses = moved
    write_take(Path("m.h5"), tree, poses)
    eight = load_marker_set("schroeder8")
    for name, side, length_m in (("left", "left", 0.19), ("large", "right", 0.21)):
        subject = template_subject(eight, side, length_m=length_m)
        skin = template_surface(subject.model.tree, coarse=True)
        write_subject(Path(f"{name}.h5"), replace(subject, surface=skin))
    done = handclean("convert", "m.h5", "-o", "m.glb", "--subject", "left.h5")
    assert done.returncode == 2
    assert done.stderr == (
        "m.h5: has the motion of right, but --subject is left; "
        "it should be the subject of right\n"
    )
    assert not Path("m.glb").exists()
    done = handclean("convert", "m.h5", "-o", "m.glb", "--subject", "large.h5")
    assert done.returncode == 0
    assert "--subject 'template' is hardly the right hand of this take" in done.stderr
    both = ("--subject", "large.h5", "--subject", "left.h5", "--overwrite")
    assert handclean("convert", "m.h5", "-o", "m.glb", *both).returncode == 0


def test_a_skinned_hand_becomes_a_subject_and_goes_out_again(handclean):
    tree = template("left")
    write_hand(Path("hand.glb"), tree, template_surface(tree, coarse=True))
    for options in ((), ("--joint-map", "handclean", "--overwrite")):
        done = handclean("convert", "hand.glb", "-o", "s.h5", *options)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.startswith("hand.glb -> s.h5: a left hand of 187 mm with ")
    back = read_subject(Path("s.h5"))
    assert back.model.tree.side == "left"
    assert back.surface is not None
    for suffix in (".glb", ".ply"):
        done = handclean("convert", "s.h5", "-o", f"out{suffix}")
        assert (done.returncode, done.stderr) == (0, "")
    np.testing.assert_allclose(
        read_mesh(Path("out.ply")).vertices,
        back.surface.vertices,
        atol=1e-7,
    )
    done = handclean("convert", "out.ply", "-o", "again.stl")
    assert done.returncode == 0
    assert "vertices" in done.stdout


@pytest.mark.parametrize(
    ("given", "output", "status", "message"),
    [
        ("s.h5", "s.c3d", 2, "only as .h5 .glb .ply .obj .stl"),
        ("m.ply", "t.h5", 2, "'handclean calibrate-hand scan' makes a subject of it"),
        ("none.glb", "s.h5", 1, "no such file"),
    ],
)
def test_what_does_not_go_together_is_told(handclean, given, output, status, message):
    write_subject(Path("s.h5"), template_subject(load_marker_set("schroeder8")))
    skin = template_surface(template("left"), coarse=True)
    write_mesh(Path("m.ply"), Mesh(vertices=skin.vertices, faces=skin.faces))
    done = handclean("convert", given, "-o", output)
    assert done.returncode == status
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_wrong_joint_map_is_told(handclean):
    tree = template("left")
    write_hand(Path("hand.glb"), tree, template_surface(tree, coarse=True))
    done = handclean("convert", "hand.glb", "-o", "s.h5", "--joint-map", "webxr")
    assert done.returncode == 1
    assert "no joint is called 'wrist'" not in done.stderr
    assert "no joint is called 'thumb-metacarpal'" in done.stderr
    done = handclean("convert", "hand.glb", "-o", "s.h5", "--joint-map", "webx")
    assert done.returncode == 2
    assert "shipped: handclean, humanik, manipnet, webxr" in done.stderr
    done = handclean("label", "hand.glb", "-o", "s.h5", "--marker-set", "xu19")
    assert "convert makes a subject of a skinned hand" in done.stderr
