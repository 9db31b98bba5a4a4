"""``calibrate-glove sample`` and whether recordings fit what is claimed of them."""

import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from takes import take_source
from told import texts

import handclean as hc
from handclean.api import glove_files
from handclean.cli import main as frame
from handclean.commands.inspect import inspect
from handclean.commands.shared.choices import (
    GloveExamining,
    GloveFitting,
    GloveRewearing,
    GloveSampling,
)
from handclean.commands.table import COMMANDS
from handclean.errors import FileError
from handclean.glove.poses import key_poses
from handclean.glove.settings import (
    GloveExamineConfig,
    GloveFitConfig,
    GloveSampleConfig,
)
from handclean.hand.subject import Subject
from handclean.io import files
from handclean.io.glove.write_readings import write_readings
from handclean.io.hdf5.session import write_session
from handclean.io.hdf5.subject import write_subject
from handclean.recording import Motion, Recording
from handclean.runner import plan
from handclean.runner.batch import Task
from handclean.runner.command import Work
from handclean.runner.execute import execute
from handclean.simulation.glove import simulate_glove
from handclean.simulation.settings import SimulateConfig
from tests.edits import edited
from tests.io.c3d.c3d_oracles import c3d_bytes

SAMPLING = GloveSampling(
    sample=GloveSampleConfig(most=60), pose="", holds=(), touch="", glove=""
)
POSES = """
[mine]
index_mcp_flexion = 40
index_pip_flexion = 45

[misspelt]
index_mcp_flexion = 40
index_pip_flexon = 45

[broken]
middle_mcp_flexion = 400

[beyond]
index_mcp_flexion = 98

[unmeasured]
index_dip_flexion = 20
"""


def run(command, settings, output, *paths, reduces=True, **given):
    sources = tuple(take_source(path=Path(path), **given) for path in paths)
    task = Task(sources=sources, outputs=(output,), token=plan.token(), reduces=reduces)
    return execute(Work(command=COMMANDS[command], settings=settings), task)


def sample(folder, *paths, files=None, subjects=(), **known):
    chosen = replace(SAMPLING, **known)
    given = {"files": files or {}, "subjects": subjects}
    paths = [folder / f"{path}.csv" for path in paths]
    return run("calibrate-glove sample", chosen, folder / "out.h5", *paths, **given)


@pytest.fixture(scope="module")
def session():
    return simulate_glove(SimulateConfig(seed=2), 0, key_poses())


@pytest.fixture(scope="module")
def folder(tmp_path_factory, session):
    """Readings, the subject, and poses of one's own."""
    folder = tmp_path_factory.mktemp("sample")
    for take in session.takes:
        if take.name.startswith("w1/"):
            path = folder / f"{take.name[3:]}.csv"
            facts = {"glove": session.glove, "subject": "S01"}
            write_readings(path, take.times, take.readings, session.sensors, facts)
    tips = session.wearer.tips
    subject = Subject(
        name="S01", model=tips, marker_set="fingertips", marker_sigma=np.zeros(5)
    )
    write_subject(folder / "S01.h5", subject)
    (folder / "poses.toml").write_text(POSES)
    return folder


def test_a_pose_of_ones_own_is_sampled(folder):
    report = sample(folder, "pose-half-1", pose=f"{folder / 'poses.toml'}:mine")
    assert report.status == "done", report.error
    assert report.figures["rotations"] == ["index_mcp_flexion", "index_pip_flexion"]
    assert texts(report.remarks) == ()


@pytest.mark.parametrize(
    ("pose", "says"),
    [
        ("misspelt", "poses.toml [misspelt]: no joint is called 'index_pip_flexon'; "
            "did you mean index_pip_flexion"),
        ("broken", "[broken]: middle_mcp_flexion is 400 degrees; it goes from"),
        ("unmeasured", "[unmeasured]: cyberglove18 measures nothing of it"),
    ],
)  # fmt: skip
def test_a_pose_that_no_hand_takes_is_refused(folder, pose, says):
    report = sample(folder, "pose-half-1", pose=f"{folder / 'poses.toml'}:{pose}")
    assert report.status == "failed"
    assert says in report.error
    assert report.exit_status == 2


def test_a_pose_a_little_beyond_its_range_is_told(folder):
    report = sample(folder, "pose-half-1", pose=f"{folder / 'poses.toml'}:beyond")
    assert report.status == "done", report.error
    [told] = texts(report.remarks)
    assert "index_mcp_flexion is 98 degrees; its active range goes from -25" in told


@pytest.mark.parametrize(
    ("hold", "says"),
    [
        ("W_FLEX=200", "wrist_flexion is 200 degrees; it goes from -65 to 70"),
        ("IM_ABD=250", "index_middle_abduction is 250 degrees; it goes from -5 to 35"),
        ("index_dip_flexion=20", "--hold index_dip_flexion: cyberglove18 measures"),
    ],
)
def test_a_widget_that_no_hand_takes_or_no_sensor_feels_is_refused(folder, hold, says):
    report = sample(folder, "hold-index_middle_abduction+20", holds=(hold,))
    assert report.status == "failed"
    assert says in report.error


def test_free_movement_is_no_pose(folder):
    report = sample(folder, "markers", pose="fist")
    assert report.status == "done", report.error
    [told] = [text for text in texts(report.remarks) if "should be still" in text]
    assert "and 13 more" in told
    for pose in ("fist", "spread", "thumb-bend"):
        report = sample(folder, f"pose-{pose}-1", f"pose-{pose}-2", pose=pose)
        assert texts(report.remarks) == ()


def test_the_one_sensor_that_moved_in_a_pose_is_named(folder):
    report = sample(folder, "free-I_PIP", pose="flat")
    [told] = texts(report.remarks)
    assert "there moved I_PIP by" in told
    assert told.endswith("of 255; is all of it the pose?")


@pytest.fixture(scope="module")
def glove(folder):
    """The glove with the ends of its sensors' ranges."""
    names = sorted(path for path in folder.glob("free-*.csv") if "+" not in path.stem)
    moved = tuple(path.stem.removeprefix("free-") for path in names)
    settings = GloveExamining(examine=GloveExamineConfig(), glove="", moved=moved)
    out = folder / "my.toml"
    report = run("calibrate-glove examine", settings, out, *names)
    assert report.status == "done", report.error
    return out


def test_drift_is_told_in_degrees_where_the_ends_of_the_range_are_known(folder, glove):
    report = sample(folder, "free-I_PIP", pose="flat", files={"glove": glove})
    [told] = texts(report.remarks)
    degrees = float(re.search(r"I_PIP by (\d+) degrees", told)[1])
    assert degrees == pytest.approx(100.0, abs=15.0)


def test_fingers_that_did_not_touch_are_doubted(folder, glove):
    given = {"files": {"glove": glove}, "subjects": (folder / "S01.h5",)}
    touched = sample(folder, "touch-thumb-index", touch="thumb,index", **given)
    assert texts(touched.remarks) == ()
    assert touched.figures["moved_deg"] < 12.0
    free = sample(folder, "markers", touch="thumb,index", **given)
    [told] = texts(free.remarks)
    assert "degrees from touching: did thumb and index touch? --start" in told


def test_figures_of_touching_are_those_of_all_recordings(folder, glove):
    given = {"files": {"glove": glove}, "subjects": (folder / "S01.h5",)}
    given["touch"] = "thumb,index"
    one, two, both = (
        sample(folder, *names, **given).figures
        for names in (
            ["touch-thumb-index"],
            ["markers"],
            ["touch-thumb-index", "markers"],
        )
    )
    assert both["samples"] == one["samples"] + two["samples"]
    mean = np.average(
        [one["moved_deg"] ** 2, two["moved_deg"] ** 2],
        weights=[one["samples"], two["samples"]],
    )
    assert both["moved_deg"] == pytest.approx(np.sqrt(mean), rel=1e-6)


def test_markers_that_tell_nothing_are_said_to(folder, session):
    take = next(take for take in session.takes if take.name == "w1/markers")
    tree = session.wearer.tree
    motion = Motion(
        names=tree.hinges,
        angles=take.angles,
        trusted=np.zeros(len(take.times), dtype=bool),
    )
    recording = Recording(
        rate=60.0,
        frames=len(take.times),
        motions={"right": motion},
        skeletons={"right": tree},
    )
    write_session(folder / "untrusted.h5", recording)
    given = {"files": {"markers": folder / "untrusted.h5"}}
    report = sample(folder, "markers", **given)
    assert report.status == "failed"
    assert "untrusted.h5: has no angle the glove measures" in report.error


def test_what_is_odd_about_the_take_with_the_markers_is_told(folder, session):
    content = c3d_bytes(np.ones((2, 3, 3)), np.zeros((2, 3)), ["A", "B", "A"])
    (folder / "twice.c3d").write_bytes(content)
    given = {"files": {"markers": folder / "twice.c3d"}}
    report = sample(folder, "markers", **given)
    assert "twice.c3d: has no joint angles" in report.error
    told = f"{folder / 'twice.c3d'}: labels that stand twice: A"
    assert report.warnings == (told,)
    take = next(take for take in session.takes if take.name == "w1/markers")
    tree = session.wearer.tree
    motion = Motion(names=tree.hinges, angles=take.angles)
    recording = Recording(
        rate=60.0,
        frames=len(take.times),
        motions={"right": motion},
        skeletons={"right": tree},
    )
    files.write(folder / "moved.bvh", recording)
    given = {"files": {"markers": folder / "moved.bvh"}}
    report = sample(folder, "markers", **given)
    assert report.status == "done", report.error
    (odd,) = files.read(folder / "moved.bvh").remarks
    assert report.remarks == (odd,)
    assert report.warnings == (f"{folder / 'moved.bvh'}: {odd.text}",)


def test_tips_that_do_not_meet_give_no_sample_and_say_so(folder, glove):
    given = {"files": {"glove": glove}, "subjects": (folder / "S01.h5",)}
    never = GloveSampleConfig(most=60, reach_m=0.0)
    report = sample(
        folder, "touch-thumb-index", touch="thumb,index", sample=never, **given
    )
    assert report.status == "failed"
    assert "none of 60 frames could fingertips be brought together" in report.error
    assert "--start CALIBRATION" in report.error


def test_readings_are_no_samples(folder):
    with h5py.File(folder / "natural.h5", "w") as file:
        file["readings"] = np.ones((5, 18))
    for name in ("pose-flat-1.csv", "natural.h5"):
        with pytest.raises(FileError, match="no samples of a glove; 'calibrate-glove"):
            glove_files.read_samples(folder / name)
    with pytest.raises(FileError, match="no such file"):
        glove_files.read_samples(folder / "none.csv")


@pytest.mark.parametrize(
    ("command", "what"),
    [("sample", "samples"), ("fit", "calibrations"), ("rewear", "calibrations")],
)
def test_what_is_written_is_said_to_be_h5(folder, command, what):
    words = [f"{folder / 'pose-flat-1.csv'}", "-o", "out.csv"]
    done = CliRunner().invoke(frame.cli, ["calibrate-glove", command, *words])
    assert f"{what} are .h5 files, not .csv" in str(done.exception) + done.output


def test_one_of_something_is_not_several(folder):
    report = sample(folder, "hold-index_middle_abduction+20", holds=("IM_ABD=20",))
    assert report.line == "60 FK samples of 1 rotation"


def look(path):
    return inspect(take_source(path=path), None)


def test_inspect_tells_of_samples_and_calibrations(folder, glove):
    given = {"files": {"glove": glove}}
    made = []
    for pose in ("flat", "fist", "half"):
        sample(folder, f"pose-{pose}-1", f"pose-{pose}-2", pose=pose, **given)
        made.append((folder / "out.h5").rename(folder / f"{pose}.h5"))
    about = look(made[1])
    assert about.figures["glove"] == "cyberglove18"
    assert about.figures["recordings"] == {
        "pose fist (pose-fist-1.csv)": 60,
        "pose fist (pose-fist-2.csv)": 60,
    }
    assert about.figures["kinds"] == {"fk": 120, "ik": 0}
    assert "on S01, 120 FK samples, 2 recordings, 17 of 17 rotations" in about.line
    assert about.line.endswith("made by calibrate-glove sample")
    quick = GloveFitConfig(model="linear")
    first, again = folder / "first.h5", folder / "again.h5"
    fitting = GloveFitting(fit=quick, jobs=1)
    assert run("calibrate-glove fit", fitting, first, *made).status == "done"
    about = look(first)
    assert "linear from all samples, 17 of 17 rotations" in about.line
    assert about.figures["rotations"]["index_pip_flexion"]["fk"] == 360
    assert about.figures["rotations"]["index_pip_flexion"]["floor_deg"] >= 0.0
    assert "index_pip_flexion from 360 FK samples, floor" in about.details
    assert not about.figures["worn_again"]
    rewearing = {"files": {"calibration": first}}
    command = "calibrate-glove rewear"
    report = run(command, GloveRewearing(), again, *made[:2], **rewearing)
    assert report.status == "done", report.error
    about = look(again)
    assert about.figures["worn_again"]
    assert "for another donning" in about.line
    told = hc.inspect(again)
    assert {name: told[name] for name in about.figures} == about.figures


def test_inspect_tells_what_it_can_of_damaged_samples(folder):
    report = sample(folder, "pose-flat-1", pose="flat")
    assert report.status == "done", report.error
    path = (folder / "out.h5").rename(folder / "damaged.h5")
    with edited(path) as file:
        del file["readings"]
    about = look(path)
    assert about.figures["format"] == "handclean glove samples"
    assert any("readings" in trap for trap in about.figures["traps"])
