"""``handclean convert`` and ``handclean inspect`` on small takes, as users run them."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from handclean.cli.main import main
from handclean.commands.inspect import FIGURES
from handclean.commands.shared import sessions
from handclean.commands.shared.formats import RECORDINGS
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.hand.template import template
from handclean.io import files
from handclean.io.formats import TAKES_WRITTEN
from handclean.io.hdf5.prior import read_prior
from handclean.recording import Recording, motion_from_poses, trajectories
from handclean.runner.batch import Source
from tests.io.c3d.c3d_oracles import c3d_bytes


@pytest.fixture
def take(rng):
    """Write a small take."""

    def write(path, frames=6):
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        positions = rng.normal(scale=0.1, size=(frames, 3, 3))
        positions[2:4, 1] = np.nan
        labels = ("R_THUMB_TIP", "R_INDEX_TIP", "R_WRIST")
        recording = Recording(
            rate=120.0, frames=frames, markers=trajectories(positions, labels)
        )
        files.write(path, recording)
        return path

    return write


def tree(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(Path(folder).rglob("*"))
        if path.is_file()
    }


def provenance(path):
    with h5py.File(path) as file:
        return [json.loads(text) for text in file["provenance"][()]]


def test_the_formats_that_are_planned_for_are_those_that_are_written():
    assert set(RECORDINGS) == set(TAKES_WRITTEN)


def test_every_take_arrives_whatever_its_name_jobs_and_shards(handclean, take):
    for name in ("S 01/tä ke.h5", "S 01/b.c.csv", "S 02/tä ke.trc"):
        take(Path("raw") / name)
    Path("raw/S 02/link.h5").symlink_to("../S 01/tä ke.h5")
    Path("list.txt").write_text(
        "".join(f"{path}\n" for path in sorted(Path("raw").rglob("*.*")))
    )
    line = ["convert", "--manifest", "list.txt", "--format", "c3d"]
    env = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}
    one = handclean(*line, "-o", "one", env=env)
    two = handclean(*line, "-o", "two", "-j2", env=env)
    for part in ("1/2", "2/2"):
        handclean(*line, "-o", "parts", "--shard", part, env=env)
    assert (one.returncode, one.stderr) == (0, "4 done\n")
    assert one.stdout.splitlines() == [
        f"{path} -> {str(path.with_suffix('.c3d')).replace('raw', 'one', 1)}: "
        "6 frames at 120 Hz, 3 markers"
        for path in sorted(Path("raw").rglob("*.*"))
    ]
    assert two.stdout == one.stdout.replace("> one", "> two")
    assert [n for n in tree("one") if n.endswith(".c3d")] == [
        "S 01/b.c.c3d",
        "S 01/tä ke.c3d",
        "S 02/link.c3d",
        "S 02/tä ke.c3d",
    ]
    assert tree("one") == tree("two") == tree("parts")


def test_a_take_keeps_its_history_through_every_format(handclean, take):
    take("a.h5")
    for source, target in (("a.h5", "b.h5"), ("b.h5", "c.c3d"), ("c.c3d", "d.h5")):
        done = handclean("convert", source, "-o", target)
        assert done.returncode == 0, done.stderr
    steps = provenance("d.h5")
    assert [step["inputs"][0]["name"] for step in steps] == ["a.h5", "b.h5", "c.c3d"]
    assert {step["command"] for step in steps} == {"convert"}
    assert steps[-1]["figures"]["markers"] == 3
    assert sessions.read(Source(path=Path("c.c3d"))).provenance == tuple(steps[:2])


def test_a_rerun_skips_until_the_options_differ(handclean, take):
    take("a.csv")
    line = ["convert", "a.csv", "-o", "a.h5", "--rate", "120", "--json"]

    def status():
        return json.loads(handclean(*line).stdout)["status"]

    assert [status(), status()] == ["done", "skipped"]
    before = Path("a.h5").read_bytes()
    line += ["--seed", "1"]  # nothing is drawn: accepted, and the same record
    assert [status(), status()] == ["skipped", "skipped"]
    assert Path("a.h5").read_bytes() == before
    line += ["--unit", "mm"]
    assert [status(), status()] == ["done", "skipped"]
    assert Path("a.h5").read_bytes() != before


@pytest.mark.parametrize("name", ["a.h5", "a.c3d", "a.trc", "a.csv", "a.tsv", "a.bvh"])
@pytest.mark.parametrize("content", [b"", b"no such format\n", None, "folder"])
def test_a_bad_input_is_one_line_and_nothing_is_written(capfd, folder, name, content):
    if content == "folder":
        Path(name).mkdir()
    elif content is not None:
        Path(name).write_bytes(content)
    line = ["convert", name, "-o", "out/b.h5", "--rate", "120", "--unit", "mm"]
    before = tree(".")
    assert main(line) == 1
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith(name)
    assert err.count("\n") == 1
    assert tree(".") == before
    assert not Path("out").exists()


def test_a_truncated_take_is_one_line_with_a_way_out(handclean, take):
    whole = take("a.c3d", frames=200).read_bytes()
    Path("a.c3d").write_bytes(whole[: len(whole) - 1500])
    done = handclean("convert", "a.c3d", "-o", "b.h5")
    assert (done.returncode, done.stdout) == (1, "")
    assert "--lenient" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not Path("b.h5").exists()
    done = handclean("convert", "a.c3d", "-o", "b.h5", "--lenient")
    assert done.returncode == 0
    assert done.stderr.startswith("a.c3d: warning: ")


WITH_A_HAND = ("-o", "out.h5", "--marker-set", "pavllo9")


@pytest.mark.parametrize(
    "line",
    [
        ("inspect",),
        ("convert", "-o", "out.h5"),
        ("solve", *WITH_A_HAND),
        ("label", *WITH_A_HAND),
        ("fill-gaps", *WITH_A_HAND),
        ("clean", *WITH_A_HAND),
        ("calibrate-hand markers", *WITH_A_HAND),
        ("learn subspace", "-o", "out.h5"),
    ],
    ids=lambda line: line[0],
)
def test_a_rate_that_contradicts_a_file_is_wrong_usage(folder, capfd, take, line):
    take("a.trc")
    command, *rest = line
    assert main([*command.split(), "a.trc", *rest, "--rate", "121"]) == 2
    out, err = capfd.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith("a.trc: --rate 121 contradicts its ")
    assert sorted(tree(".")) == ["a.trc"]


def test_a_unit_that_contradicts_one_of_several_files_is_taken_and_told(
    folder, capfd, take
):
    take("a.trc")
    take("b.h5")  # in metres
    line = ["convert", "a.trc", "b.h5", "-o", "out", "--format", "h5"]
    assert main([*line, "--unit", "mm"]) == 0
    warned = [s for s in capfd.readouterr().err.splitlines() if "--unit mm" in s]
    assert warned == ["b.h5: warning: --unit mm is taken, though the file says m"]
    one, other = files.read("b.h5"), files.read("out/b.h5")
    np.testing.assert_allclose(other.markers.positions, 1e-3 * one.markers.positions)


def test_a_hand_of_a_fifth_of_a_millimetre_is_told(folder, capfd):
    model = template_subject(load_marker_set("maycock26")).model
    places = 1e-3 * marker_positions(model, neutral_pose(model.tree)[None])
    markers = trajectories(np.tile(places, (9, 1, 1)), model.labels)
    files.write("a.c3d", Recording(rate=100.0, frames=9, markers=markers))
    wanted = r"an adult's is about \d+ mm: is the unit right\? \(--unit\)"
    assert main(["inspect", "a.c3d"]) == 0
    assert re.search(wanted, capfd.readouterr().out)
    assert main(["convert", "a.c3d", "-o", "b.h5"]) == 0
    assert re.search(wanted, capfd.readouterr().err)
    assert main(["convert", "a.c3d", "-o", "c.h5", "--unit", "m"]) == 0
    err = capfd.readouterr().err
    assert "a.c3d: warning: --unit m is taken, though the file says mm" in err
    assert "is the unit right" not in err


def test_what_a_format_cannot_hold_names_the_output(handclean, take):
    take("a.h5")
    done = handclean("convert", "a.h5", "-o", "out/b.bvh")
    assert done.returncode == 1
    assert done.stderr.startswith("out/b.bvh: ")
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("suffix", "holds", "loses"),
    [
        ("h5", "6 frames at 120 Hz, 3 markers, 1 motion", None),
        ("trc", "6 frames at 120 Hz, 3 markers", "joint angles, where the hand is"),
        ("csv", "6 frames at 120 Hz, 3 markers, 1 motion", "joint trees"),
        ("c3d", "6 frames at 120 Hz, 3 markers, 1 motion", "where the hand is"),
        ("bvh", "6 frames at 120 Hz, 1 motion", "markers"),
        ("mot", "6 frames at 120 Hz, 1 motion", "markers, joint trees"),
    ],
)
def test_convert_says_what_the_written_file_holds(
    handclean, take, suffix, holds, loses
):
    recording = files.read(take("a.h5"))
    hand = template("right")
    poses = np.zeros((6, 7 + len(hand.hinges)))
    poses[:, 3] = 1.0
    moved = motion_from_poses(hand.hinges, poses)
    recording = replace(recording, motions={"right": moved}, skeletons={"right": hand})
    files.write("a.h5", recording)
    done = handclean("convert", "a.h5", "-o", f"b.{suffix}")
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"a.h5 -> b.{suffix}: {holds}\n"
    if loses is None:
        assert done.stderr == ""
    else:
        assert done.stderr.startswith(
            f"a.h5: warning: {suffix.upper()} keeps no {loses}"
        )
        up = suffix == "bvh"  # and which way is up
        assert done.stderr.count("\n") == 1 + up
    found = handclean("inspect", f"b.{suffix}").stdout
    if suffix == "mot":
        assert found == "b.mot: mot, 6 frames at 120 Hz, 27 columns\n"
    else:
        assert ("3 markers" in found) == ("3 markers" in holds)
        angles = "15 joints with angles" if suffix == "c3d" else "1 motion"
        assert (angles in found) == ("1 motion" in holds)


def test_the_axis_that_is_up_in_a_bvh_can_be_chosen(handclean, rng):
    tree = template("right")
    poses = np.tile(neutral_pose(tree), (4, 1))
    poses[:, :3] = [0.1, 0.2, 0.3]
    take = Recording(
        rate=100.0,
        frames=4,
        up_axis="+z",
        motions={"right": motion_from_poses(tree.hinges, poses)},
        skeletons={"right": tree},
    )
    files.write("a.h5", take)
    found = {}
    for axis in ("+y", "+z"):
        more = () if axis == "+y" else ("--bvh-up", axis)
        done = handclean("convert", "a.h5", "-o", f"a{axis}.bvh", *more)
        assert done.returncode == 0
        found[axis] = Path(f"a{axis}.bvh").read_text().splitlines()[-1].split()[:3]
        assert ("--bvh-up" in done.stderr) == (axis == "+y")
    assert [float(x) for x in found["+z"]] == pytest.approx([10.0, 20.0, 30.0])
    assert [float(x) for x in found["+y"]] == pytest.approx([10.0, 30.0, -20.0])
    wrong = handclean("convert", "a.h5", "-o", "b.bvh", "--bvh-up", "up")
    assert wrong.returncode == 2


def test_a_prior_learnt_from_bvh_is_that_of_the_session(handclean, rng):
    hand = template("right")
    poses = np.zeros((240, 7 + len(hand.hinges)))
    poses[:, 3] = 1.0
    share = 0.5 + 0.4 * np.sin(np.linspace(0, 27, 240)[:, None] * rng.uniform(1, 3, 20))
    poses[:, 7:] = hand.limits[:, 0] + share * np.ptp(hand.limits, axis=1)
    poses[120:, 7:] = poses[:120, 7:][::-1]  # a jump, were it a finger's
    recording = Recording(
        rate=120.0,
        frames=240,
        skeletons={"right": hand},
        motions={"right": motion_from_poses(hand.hinges, poses)},
    )
    files.write("a.h5", recording)
    assert handclean("convert", "a.h5", "-o", "a.bvh").returncode == 0
    priors = []
    for name in ("a.h5", "a.bvh"):
        done = handclean("learn", "subspace", name, "-o", "p.h5", "--overwrite")
        assert (done.returncode, done.stderr) == (0, "")
        priors.append(read_prior(Path("p.h5")))
    first, second = priors
    np.testing.assert_allclose(second.mean, first.mean, atol=1e-9)
    np.testing.assert_allclose(second.deviations, first.deviations, atol=1e-9)
    share = np.abs(np.sum(first.components * second.components, axis=0))
    np.testing.assert_allclose(share, 1.0, atol=1e-9)


def test_what_is_odd_about_a_bvh_is_told_where_it_is_learnt_from(
    shared_data, handclean
):
    take = shared_data / "manipnet" / "teapot2" / "rightHand.bvh"
    done = handclean("learn", "subspace", take, "-o", "p.h5")
    assert done.returncode == 0
    assert done.stderr.startswith(f"{take}: warning: ")
    assert done.stderr.count(str(take)) == done.stderr.count("\n")
    assert "tracking jumps are left out" in done.stderr


def test_inspect_has_one_line_or_object_per_file(handclean, take):
    names = [take("a.h5"), take("b.c3d"), take("c.trc"), Path("none.c3d")]
    done = handclean("inspect", *names)
    assert done.returncode == 1
    assert [line.split(":")[0] for line in done.stdout.splitlines()] == [
        "a.h5", "b.c3d", "c.trc",
    ]  # fmt: skip
    assert "6 frames at 120 Hz, 3 markers" in done.stdout
    assert done.stderr == "none.c3d: no such file\n3 done, 1 failed\n"
    done = handclean("inspect", *names, "--json", "--require", "gaps<=0")
    objects = [json.loads(line) for line in done.stdout.splitlines()]
    assert [o["status"] for o in objects] == ["done"] * 3 + ["failed"]
    assert [o.get("gaps") for o in objects] == [1, 1, 1, None]
    assert all(o["output"] is None and "other" not in o for o in objects)
    assert "a.h5: gaps is 1, required <= 0" in done.stderr
    assert handclean("inspect", "a.h5", "--require", "gaps<=0").returncode == 3


def latin1(path):
    """Put a byte that is no UTF-8 into a label of a C3D file."""
    content = path.read_bytes()
    assert content.count(b"R_WRIST") == 1
    path.write_bytes(content.replace(b"R_WRIST", b"R_WR\xcfST"))


@pytest.mark.parametrize("command", ["inspect", "convert"])
def test_json_can_be_read_by_anybody_whatever_names_are(handclean, take, command):
    path = take("a.c3d")
    latin1(path)
    odd = Path(os.fsdecode(b"t\xe4ke.c3d"))
    path.rename(odd)
    lists = ["--json", odd, Path(os.fsdecode(b"n\xf6ne.c3d"))]
    done = handclean(command, *lists, *(["-o", "out"] if command == "convert" else []))
    assert done.returncode == 1
    raw = done.stdout.encode("utf-8", "strict")
    assert b"\\ud" not in raw
    found, missing = (json.loads(line) for line in raw.splitlines())
    assert found["input"] == "t\ufffdke.c3d"
    assert missing["input"] == "n\ufffdne.c3d"
    assert "n\ufffdne.c3d" in missing["error"]
    if command == "inspect":
        assert found["markers"][2] == "R_WR\u00cfST"


def test_labels_in_latin1_are_rewritten_byte_by_byte(handclean, take):
    path = take("a.c3d")
    latin1(path)
    assert handclean("convert", path, "-o", "b.c3d").returncode == 0
    assert handclean("convert", path, "-o", "c.h5").returncode == 0
    assert handclean("convert", "c.h5", "-o", "d.c3d").returncode == 0
    content = path.read_bytes()
    assert content == Path("b.c3d").read_bytes() == Path("d.c3d").read_bytes()
    with h5py.File("c.h5") as file:
        assert file["markers/labels"].asstr()[2] == "R_WR\u00cfST"


def test_inspect_knows_every_figure_it_is_given(shared_data, handclean):
    some = sorted(shared_data.rglob("*.c3d"))[:6]
    some += (
        sorted(shared_data.rglob("*.tsv"))[:1] + sorted(shared_data.rglob("*.bvh"))[:1]
    )
    done = handclean("inspect", *some, "--json")
    objects = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(objects) == len(some)
    for found in objects:
        assert "other" not in found
        assert set(found) - set(FIGURES) == {
            "input", "output", "status", "error", "seconds", "warnings",
        }  # fmt: skip


def c3d(path, labels, word=257, **more):
    """Write a C3D of two frames whose fourth words are all the same."""
    at = 100.0 * np.arange(6.0 * len(labels)).reshape(2, len(labels), 3) + 1.0
    words = np.full((2, len(labels)), word)
    Path(path).write_bytes(c3d_bytes(at, words, labels, **more))


def test_every_command_that_reads_takes_tells_of_labels_that_stand_twice(handclean):
    c3d("a.c3d", ["A", "B", "A"])
    c3d("b.c3d", ["A", "B", "C"])
    told = "warning: labels that stand twice: A\n"
    done = handclean("convert", "a.c3d", "-o", "a.h5")
    assert done.stdout == "a.c3d -> a.h5: 2 frames at 100 Hz, 2 markers\n"
    assert done.stderr == f"a.c3d: {told}"
    assert "labels that stand twice: A" in handclean("inspect", "a.c3d").stdout
    assert (
        told.replace(" labels", " a.c3d: labels")
        in handclean("compare", "b.c3d", "a.c3d").stderr
    )


FAILING = [
    ("label", "--marker-set", "maycock26", "--side", "right"),
    ("clean", "--marker-set", "maycock26", "--side", "right"),
    ("solve", "--marker-set", "maycock26", "--side", "right"),
    ("fill-gaps", "--marker-set", "maycock26", "--side", "right"),
    ("calibrate-hand", "markers", "--marker-set", "maycock26", "--side", "right"),
    ("learn", "subspace"),
    ("compare", "b.c3d"),
]


@pytest.mark.parametrize("line", FAILING, ids=[line[0] for line in FAILING])
@pytest.mark.parametrize(
    ("word", "says"),
    [(-1, "--believe-coordinates takes these"), (257, "the parameters' was taken")],
    ids=["missing", "scale"],
)
def test_what_is_odd_about_a_take_is_told_also_if_a_command_fails(
    folder, capfd, line, word, says
):
    labels = load_marker_set("maycock26").labels
    c3d("b.c3d", ["NONE", "OTHER"])
    c3d("a.c3d", list(labels[:2]), word=word, is_float=False)
    if word > 0:
        content = bytearray(Path("a.c3d").read_bytes())
        content[12:16] = np.float32(0.25).tobytes()
        Path("a.c3d").write_bytes(content)
    output = () if line[0] == "compare" else ("-o", "out.h5")
    assert main([*line, "a.c3d", *output, "--json"]) == 1
    out, err = capfd.readouterr()
    found = json.loads(out)
    assert found["status"] == "failed"
    assert [says in text for text in found["warnings"]].count(True) == 1
    assert err.count(says) == 1
    assert err.splitlines()[-1] == found["error"]


def test_points_marked_missing_are_believed_on_request_and_that_is_recorded(handclean):
    c3d("a.c3d", ["A", "B"], word=-1)
    done = handclean("convert", "a.c3d", "-o", "a.h5")
    assert "though 4 have coordinates; --believe-coordinates takes" in done.stderr
    line = "convert", "a.c3d", "-o", "a.h5", "--believe-coordinates"
    done = handclean(*line)
    assert "4 that have coordinates are believed" in done.stderr
    assert np.isfinite(files.read("a.h5").markers.positions).all()
    assert provenance("a.h5")[0]["inputs"][0]["believe_coordinates"] is True
    assert json.loads(handclean(*line, "--json").stdout)["status"] == "skipped"
    found = handclean("inspect", "a.c3d", "--believe-coordinates", "--json")
    assert json.loads(found.stdout)["measured"] == {"A": 2, "B": 2}


def test_analog_channels_alone_are_inspected_and_not_converted(handclean):
    c3d("a.c3d", [], analog=np.ones((2, 4)), per_frame=2)
    done = handclean("inspect", "a.c3d")
    assert done.returncode == 0, done.stderr
    assert "2 analog channels; odd: it has no points, only analog" in done.stdout
    done = handclean("convert", "a.c3d", "-o", "a.h5")
    assert done.returncode == 1
    assert done.stderr.startswith("a.c3d: has no points, only analog channels; ")
