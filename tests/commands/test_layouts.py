"""``optimize-layout`` as commands run it: files in, files out, errors in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
from gltf_oracle import Scene

from handclean.cli import main as frame
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.hand.surface import vertex_normals
from handclean.hand.template import HAND_LENGTH_M, template
from handclean.hand.template_surface import template_surface
from handclean.io import files
from handclean.io.hdf5.subject import write_subject
from handclean.io.mesh.meshes import Mesh, write_mesh
from handclean.recording import Recording, motion_from_poses

QUICK = ("--particles", "60", "--iterations", "15", "--keyframes", "4")


def write_motion(path, tree, poses):
    recording = Recording(
        rate=50.0,
        frames=len(poses),
        skeletons={tree.side: tree},
        motions={tree.side: motion_from_poses(tree.hinges, poses)},
    )
    files.write(path, recording)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two takes of a left hand, and one in which only a finger moves."""
    rng = np.random.default_rng(5)
    tree = template("left")
    ways = rng.normal(size=(5, len(tree.hinges)))
    home = tmp_path_factory.mktemp("layouts")
    for name in ("a", "b"):
        poses = np.tile(neutral_pose(tree), (60, 1))
        angles = 0.4 + 0.2 * rng.normal(size=(60, 5)) @ ways
        poses[:, 7:] = np.clip(angles, *(0.8 * tree.limits.T))
        write_motion(home / f"{name}.h5", tree, poses)
    poses = np.tile(neutral_pose(tree), (60, 1))
    poses[:, 7 + tree.hinges.index("index_pip_flexion")] = np.linspace(0, 1, 60)
    write_motion(home / "one.h5", tree, poses)
    poses[:] = poses[0]
    write_motion(home / "still.h5", tree, poses)
    return home


@pytest.fixture
def run(folder, monkeypatch, capfd):
    """Run the command in the folder; return status, stdout, stderr."""
    monkeypatch.chdir(folder)

    def call(*words):
        status = frame.main(["optimize-layout", *words])
        out, err = capfd.readouterr()
        return status, out, err

    return call


def test_a_layout_is_a_marker_set_on_the_skin(run):
    status, out, err = run(
        "a.h5", "b.h5", "-o", "five.toml", "--markers", "5", *QUICK, "--json",
        "--glb", "five.glb",
    )  # fmt: skip
    assert (status, err) == (0, "")
    figures = json.loads(out)
    markers = load_marker_set("five.toml")
    assert (markers.side, markers.name) == ("left", "five")
    assert list(markers.labels) == figures["labels"]
    assert list(markers.bones) == figures["bones"]
    assert all(label.startswith("L_") for label in markers.labels)
    tree = template("left")
    skin = template_surface(tree)
    rows = figures["vertices"]
    lift = 0.003 * vertex_normals(skin.vertices, skin.faces)[rows]
    places = marker_positions(markers.on(tree), neutral_pose(tree)[None])[0]
    np.testing.assert_allclose(places, skin.vertices[rows] + lift, atol=1e-6)
    assert figures["energy"] == pytest.approx(
        0.1 * figures["condition"] + 100.0 * figures["distance"]
    )
    assert np.mean(figures["kappa"]) == pytest.approx(figures["condition"])
    assert figures["smallest_mm"] == pytest.approx(
        1e3 * np.sqrt(-figures["distance"]) * HAND_LENGTH_M
    )
    energies = [energy for _, energy in figures["history"]]
    assert energies == sorted(energies, reverse=True)
    scene = Scene(Path("five.glb"))
    found = scene.vertices(scene.skinned[0], 0.0)
    assert len(found) > len(skin.vertices)
    made = json.loads(Path("five.toml.made.json").read_text())["provenance"][-1]
    assert made["figures"] == {k: figures[k] for k in made["figures"]}


def test_the_same_seed_makes_the_same_layout(run):
    texts = []
    for seed, name in (("1", "x.toml"), ("1", "y.toml")):
        assert run("a.h5", "-o", name, "--seed", seed, *QUICK, "-q")[0] == 0
        texts.append(Path(name).read_text())
    assert texts[0] == texts[1]


def test_a_layout_from_a_set_has_its_markers(run):
    assert run("a.h5", "-o", "8.toml", "--from-set", "schroeder17", "--markers", "8",
               *QUICK)[0] == 0  # fmt: skip
    assert run("a.h5", "-o", "6.toml", "--from-set", "8.toml", "--markers", "6",
               *QUICK)[0] == 0  # fmt: skip
    sets = [load_marker_set(name) for name in ("schroeder17", "8.toml", "6.toml")]
    assert [len(s.labels) for s in sets] == [17, 8, 6]
    for larger, smaller in ((0, 1), (1, 2)):
        rows = [sets[larger].labels.index(x) for x in sets[smaller].labels]
        np.testing.assert_allclose(sets[smaller].at, sets[larger].at[rows], atol=1e-6)


def test_a_subject_s_layout_sits_on_its_own_hand(run):
    subject = template_subject(load_marker_set("hoyet6"), "right", 0.2)
    write_subject(Path("big.h5"), subject)
    status, out, _ = run(
        "a.h5", "-o", "big.toml", "--subject", "big.h5", *QUICK, "--marker-mm", "0",
        "--json", "-q",
    )  # fmt: skip
    assert status == 0
    tree = subject.model.tree
    places = marker_positions(
        load_marker_set("big.toml").on(tree), neutral_pose(tree)[None]
    )[0]
    skin = template_surface(tree).vertices[json.loads(out)["vertices"]]
    np.testing.assert_allclose(places, skin, atol=1e-6)


def test_what_is_painted_red_has_no_marker(run):
    skin = template_surface(template("left"))
    colors = np.full(skin.vertices.shape, 200, dtype=np.uint8)
    fingers = skin.vertices[:, 1] > 0.11
    colors[fingers] = [250, 10, 10]
    mesh = Mesh(vertices=skin.vertices, faces=skin.faces, normals=None, colors=colors)
    write_mesh(Path("skin.ply"), mesh)
    words = ("a.h5", "-o", "painted.toml", "--painted", "skin.ply", "--json", *QUICK)
    status, out, _ = run(*words, "--dimensions", "3")
    assert status == 0
    assert not fingers[json.loads(out)["vertices"]].any()


def test_a_layout_nobody_could_use_is_warned_of(run):
    words = ("--full", "--markers", "12", "--marker-mm", "50")
    status, _, err = run("a.h5", "-o", "many.toml", *words, *QUICK)
    assert status == 0
    assert "are 50 mm wide: they touch; take fewer than 12" in err
    words = ("--markers", "2", "--dimensions", "3")
    status, _, err = run("a.h5", "-o", "two.toml", *words, *QUICK)
    assert status == 0
    assert "2 markers can be solved but not labelled" in err


def test_layouts_are_judged_on_other_motion(run):
    assert run("a.h5", "-o", "j.toml", "--markers", "6", *QUICK)[0] == 0
    assert run("a.h5", "-o", "j.h5")[0] == 2
    status, out, err = run(
        "--evaluate", "j.toml", "hoyet6", "maycock26", "--on", "b.h5", "a.h5", "--json"
    )
    assert (status, err) == (0, "")
    figures = json.loads(out)
    assert (figures["takes"], figures["frames"]) == (2, 120)
    assert list(figures["layouts"]) == ["j.toml", "hoyet6", "maycock26"]
    assert figures["best"] == "maycock26"
    assert figures["mean_mm"] < 0.5
    for row in figures["layouts"].values():
        for kind in ("standard", "subspace"):
            assert 0.0 < row[kind]["mean_mm"] < row[kind]["max_mm"]
    status, out, _ = run("--evaluate", "hoyet6", "--no-anchor", "--on", "b.h5")
    assert status == 0
    assert "subspace" in out
    far = json.loads(run("--evaluate", "hoyet6", "--no-anchor", "--json", "--on",
                         "b.h5")[1])  # fmt: skip
    assert far["mean_mm"] > figures["layouts"]["hoyet6"]["subspace"]["mean_mm"]


@pytest.mark.parametrize(
    ("words", "status", "wrong"),
    [
        (("a.h5", "-o", "w.toml", "--markers", "7", "--full"), 1, "8 markers or more"),
        (("a.h5", "-o", "w.toml", "--markers", "2", "--dimensions", "5"), 1,
         "take 3 markers or more"),
        (("a.h5", "-o", "w.toml", "--keyframes", "100"), 1, "60 frames"),
        (("still.h5", "-o", "w.toml"), 1, "no joint moves (thumb_cmc_abduction"),
        (("one.h5", "-o", "w.toml", "--dimensions", "3"), 1,
         "thumb_cmc_abduction, thumb_cmc_flexion"),
        (("a.h5", "-o", "w.toml", "--from-set", "schroder17"), 2,
         "--from-set: no marker set is called 'schroder17'; did you mean schroeder17"),
        (("a.h5", "-o", "w.toml", "--from-set", "none.toml"), 1, "none.toml"),
        (("a.h5", "-o", "w.toml", "--from-set", "hoyet6", "--markers", "8"), 1,
         "8 markers cannot be placed on 6 candidates"),
        (("a.h5", "-o", "w.toml", "--sheet", "s.doc"), 2, "s.doc"),
        (("a.h5", "-o", "w.toml", "--sheet", "w.toml"), 2, "w.toml"),
        (("a.h5", "-o", "w.toml", "--marker-mm", "-3"), 2, "--marker-mm"),
        (("a.h5", "-o", "w.toml", "--on", "b.h5"), 2, "--on: is for --evaluate"),
        (("a.h5", "-o", "w.toml", "--side", "up"), 2, "--side"),
        (("a.h5", "-o", "w.toml", "--method", "swarn"), 2, "method should be one of"),
        (("--evaluate", "hoyet6"), 2, "--on: is missing"),
        (("--evaluate", "hoyet6", "-o", "x.toml", "--on", "a.h5"), 2, "writes nothing"),
        (("--evaluate", "hoyet7", "--on", "a.h5"), 1, "did you mean hoyet"),
        (("--evaluate", "hoyet6", "--on", "no.h5"), 1, "no.h5: no such file"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_line(run, words, status, wrong):
    found, out, err = run(*words)
    assert (found, out) == (status, "")
    assert wrong in err
    assert err.count("\n") == 1
    assert not Path("w.toml").exists()
