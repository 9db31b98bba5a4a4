"""``calibrate-glove``, as commands run it, on a simulated session."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from takes import take_source
from told import texts

from handclean.api import glove_files
from handclean.commands import simulate as simulating
from handclean.commands.shared.choices import (
    GloveApplying,
    GloveExamining,
    GloveFitting,
    GloveRewearing,
    GloveSampling,
    Simulating,
)
from handclean.commands.table import COMMANDS
from handclean.glove.calibration import predict_measured
from handclean.glove.definitions import load_glove
from handclean.glove.poses import key_poses
from handclean.glove.settings import (
    GloveApplyConfig,
    GloveExamineConfig,
    GloveFitConfig,
    GloveSampleConfig,
)
from handclean.hand.subject import Subject
from handclean.io import files
from handclean.io.glove.write_readings import write_readings
from handclean.io.hdf5 import seal
from handclean.io.hdf5.session import write_session
from handclean.io.hdf5.subject import write_subject
from handclean.recording import Motion, Recording
from handclean.runner import plan
from handclean.runner.batch import Task
from handclean.runner.command import Work
from handclean.runner.execute import execute
from handclean.simulation.glove import GLOVE_RATE_HZ, simulate_glove
from handclean.simulation.settings import SimulateConfig
from tests.edits import edited

QUICK = GloveFitConfig(starts=1, pseudo_inputs=20, evaluations=30, most=300)
SAMPLING = GloveSampling(
    sample=GloveSampleConfig(most=60), pose="", holds=(), touch="", glove=""
)
APPLYING = GloveApplying(apply=GloveApplyConfig(), tips=False)


def run(command, settings, output, *paths, reduces=True, **given):
    sources = tuple(take_source(path=Path(path), **given) for path in paths)
    task = Task(sources=sources, outputs=(output,), token=plan.token(), reduces=reduces)
    return execute(Work(command=COMMANDS[command], settings=settings), task)


def sample(output, *paths, files=None, subjects=(), **known):
    chosen = replace(SAMPLING, **known)
    given = {"files": files or {}, "subjects": subjects}
    return run("calibrate-glove sample", chosen, output, *paths, **given)


def apply(output, path, calibration, settings=APPLYING, **given):
    given["files"] = {"calibration": calibration}
    return run("calibrate-glove apply", settings, output, path, reduces=False, **given)


@pytest.fixture(scope="module")
def session():
    return simulate_glove(SimulateConfig(seed=1, donnings=2), 0, key_poses())


@pytest.fixture(scope="module")
def folder(tmp_path_factory, session):
    """Readings of a session, its subject, and the truth of those with markers."""
    folder = tmp_path_factory.mktemp("glove")
    for take in session.takes:
        path = folder / f"{take.name.replace('/', '_')}.csv"
        facts = {"glove": session.glove, "subject": "S01", "moved": list(take.moved)}
        if not take.moved:
            del facts["moved"]
        times = take.times + take.late
        write_readings(path, times, take.readings, session.sensors, facts)
    tree = session.wearer.tree
    markers = next(take for take in session.takes if take.name == "w1/markers")
    truth = Recording(
        rate=GLOVE_RATE_HZ,
        frames=len(markers.times),
        motions={tree.side: Motion(names=tree.hinges, angles=markers.angles)},
        skeletons={tree.side: tree},
    )
    write_session(folder / "markers.h5", truth)
    tips = session.wearer.tips
    subject = Subject(
        name="S01", model=tips, marker_set="fingertips", marker_sigma=np.zeros(5)
    )
    write_subject(folder / "S01.h5", subject)
    return folder


@pytest.fixture(scope="module")
def samples(folder):
    """Files of FK samples."""
    made = []
    for pose in ("flat", "spread", "fist", "overbend", "half", "thumb-hook"):
        paths = [folder / f"w1_pose-{pose}-{n}.csv" for n in (1, 2)]
        made.append(folder / f"pose-{pose}.h5")
        report = sample(made[-1], *paths, pose=pose)
        assert report.status == "done", report.error
        assert report.figures["kind"] == "FK"
    for angle in (0, 10, 20, 30):
        name = f"index_middle_abduction{angle:+d}"
        made.append(folder / f"hold{angle}.h5")
        path = folder / f"w1_hold-{name}.csv"
        report = sample(made[-1], path, holds=(f"IM_ABD={angle}",))
        assert report.status == "done", report.error
        assert report.figures["rotations"] == ["index_middle_abduction"]
    return made


@pytest.fixture(scope="module")
def calibration(folder, samples):
    settings = GloveFitting(fit=QUICK, jobs=1)
    report = run("calibrate-glove fit", settings, folder / "fk.h5", *samples)
    assert report.status == "done", report.error
    assert report.figures["rotations"] == 17
    return folder / "fk.h5"


def test_examining_finds_the_couplings_of_table_1(folder):
    paths = sorted(folder.glob("w1_free-*.csv"))
    settings = GloveExamining(examine=GloveExamineConfig(), glove="", moved=())
    report = run("calibrate-glove examine", settings, folder / "my.toml", *paths)
    assert report.status == "done", report.error
    coupled = report.figures["coupled"]
    for sensor, by in (
        ("IM_ABD", "M_MCP"), ("MR_ABD", "R_MCP"), ("RP_ABD", "P_MCP"),
        ("TI_ABD", "T_TMC"), ("W_FLEX", "W_ABD"),
    ):  # fmt: skip
        assert by in coupled[sensor]
    for sensor in ("I_MCP", "I_PIP", "M_PIP", "T_IP"):
        assert sensor not in coupled
    glove = load_glove(folder / "my.toml")
    assert set(glove.reading) >= set(glove.used)


def test_free_movement_becomes_angles_near_the_truth(folder, session, calibration):
    out = folder / "motion.h5"
    subject = (folder / "S01.h5",)
    report = apply(out, folder / "w2_motion.csv", calibration, subjects=subject)
    assert report.status == "done", report.error
    take = files.read(out)
    motion = take.motions["right"]
    truth = next(t for t in session.takes if t.name == "w2/motion")
    assert take.rate == pytest.approx(GLOVE_RATE_HZ, rel=1e-4)
    index = [k for k, name in enumerate(motion.names) if name.startswith("index_")]
    error = np.degrees(np.abs(motion.angles - truth.angles)[:, index])
    assert error.mean() < 6.0
    assert np.isfinite(motion.angles).all()
    assert motion.trusted.shape == (take.frames,)
    dip, pip = (motion.names.index(f"index_{j}_flexion") for j in ("dip", "pip"))
    ratio = motion.angles_sigma[:, dip] / motion.angles_sigma[:, pip]
    assert np.all(ratio >= 0.6667 - 1e-9)  # and how people differ from the rule
    assert take.provenance[-1]["command"] == "calibrate-glove apply"


def test_chunks_and_formats_of_readings_make_no_difference(
    folder, session, calibration
):
    tips = replace(APPLYING, tips=True)
    small = replace(tips, apply=GloveApplyConfig(chunk=97))
    one, two, three = (folder / f"chunks{n}.h5" for n in (1, 2, 3))
    take = next(t for t in session.takes if t.name == "w2/motion")
    late = take.times + 3.5
    write_readings(folder / "motion_in.h5", late, take.readings, session.sensors, {})
    assert apply(one, folder / "w2_motion.csv", calibration, tips).status == "done"
    assert apply(two, folder / "w2_motion.csv", calibration, small).status == "done"
    assert apply(three, folder / "motion_in.h5", calibration, small).status == "done"
    first = files.read(one)
    assert first.markers.labels[1] == "index_tip"
    assert files.read(three).start_time - first.start_time == pytest.approx(3.5)
    for other, close in ((files.read(two), 1e-12), (files.read(three), 2e-5)):
        for name in ("angles", "angles_sigma", "trusted"):  # CSV has microseconds
            np.testing.assert_allclose(
                getattr(other.motions["right"], name).astype(float),
                getattr(first.motions["right"], name).astype(float),
                atol=close,
            )
        np.testing.assert_allclose(
            other.markers.positions, first.markers.positions, atol=close
        )


@pytest.mark.parametrize("suffix", [".bvh", ".mot", ".csv", ".glb", ".trc"])
def test_other_formats_follow(folder, calibration, suffix):
    out = folder / f"flat{suffix}"  # the wrist was never sampled at an angle
    tips = replace(APPLYING, tips=True, apply=GloveApplyConfig(max_sigma_deg=90.0))
    report = apply(out, folder / "w2_pose-flat-1.csv", calibration, tips)
    assert report.status == "done", report.error
    assert out.stat().st_size > 1000


def test_touching_is_sampled_from_a_calibration_and_makes_tips_meet(
    folder, samples, calibration
):
    made = []
    for finger in ("index", "middle"):
        made.append(folder / f"touch-{finger}.h5")
        report = sample(
            made[-1],
            folder / f"w1_touch-thumb-{finger}.csv",
            touch=f"thumb,{finger}",
            files={"start": calibration},
            subjects=(folder / "S01.h5",),
        )
        assert report.status == "done", report.error
        assert report.figures["kind"] == "IK"
        assert report.figures["apart_mm"] < 0.1
    out = folder / "all.h5"
    settings = GloveFitting(fit=QUICK, jobs=1)
    assert run("calibrate-glove fit", settings, out, *samples, *made).status == "done"
    apart = {}
    for path in (calibration, out):
        moved = folder / f"touch_{path.name}"
        report = apply(
            moved,
            folder / "w1_touch-thumb-index.csv",
            path,
            replace(APPLYING, tips=True),
            subjects=(folder / "S01.h5",),
        )
        tips = files.read(moved).markers
        between = tips.positions[:, 0] - tips.positions[:, 1]
        apart[path.name] = np.linalg.norm(between, axis=1).mean()
    assert apart["all.h5"] < 0.85 * apart["fk.h5"]
    assert apart["all.h5"] < 0.0065


def rewear(output, calibration, *paths):
    given = {"files": {"calibration": calibration} if calibration else {}}
    command = "calibrate-glove rewear"
    return run(command, GloveRewearing(), output, *paths, **given)


@pytest.fixture(scope="module")
def again(folder):
    """Samples of the second donning: two poses."""
    made = []
    for pose in ("flat", "fist"):
        made.append(folder / f"again-{pose}.h5")
        path = folder / f"w2_pose-{pose}-2.csv"
        assert sample(made[-1], path, pose=pose).status == "done"
    return made


def test_a_few_samples_of_another_donning_adapt_a_calibration(
    folder, session, calibration, again
):
    out = folder / "day2.h5"
    report = rewear(out, calibration, *again)
    assert report.status == "done", report.error
    assert report.figures["after_deg"] < 0.9 * report.figures["before_deg"]
    before, after = map(glove_files.read_calibration, (calibration, out))
    assert after.donning is not None
    hand = after.glove.hand
    own = [hand.index(row.rotation) for row in after.glove.measured]
    errors = []
    for made in (before, after):
        total = 0.0
        for name in ("w2/motion", "w2/pose-rest-1", "w2/pose-ok-1"):
            take = next(t for t in session.takes if t.name == name)
            truth = take.angles @ hand.from_hinges(session.wearer.tree.hinges).T
            mean, _ = predict_measured(made, take.readings)
            total += np.abs(mean - truth[:, own]).mean()
        errors.append(total)
    assert errors[1] < errors[0]


def test_rewearing_without_a_calibration_or_with_one_of_another_glove_is_refused(
    folder, calibration, again
):
    report = rewear(folder / "no.h5", None, *again)
    assert "--calibration: is missing" in report.error
    samples_of, glove = glove_files.read_samples(again[0])
    other = folder / "again-other.h5"
    named = replace(glove, name="mine")
    glove_files.write_samples(other, replace(samples_of, glove="mine"), named, ())
    report = rewear(folder / "no.h5", calibration, other)
    assert "samples: are of glove mine, the calibration of cyberglove18" in report.error
    assert not (folder / "no.h5").exists()


def test_angles_are_kept_as_up_to_date_when_nothing_changed(folder, calibration):
    out, path = folder / "kept.h5", folder / "w2_pose-ok-1.csv"
    assert apply(out, path, calibration).status == "done"
    assert seal.intact(out)
    before = out.read_bytes()
    assert apply(out, path, calibration).status == "skipped"
    tips = replace(APPLYING, tips=True)
    assert apply(out, path, calibration, tips).status == "done"
    assert seal.intact(out)
    assert out.read_bytes() != before


def test_a_saturated_reading_does_not_reach_its_neighbours(folder, calibration):
    def change(lines):
        at = lines[1].split(",").index("I_PIP")
        rows = [line.split(",") for line in lines[2:]]
        for row in rows[500:502]:
            row[at] = "0"
        return [*lines[:2], *(",".join(row) for row in rows)]

    found = []
    for path in (folder / "w2_motion.csv", broken(folder, "spike.csv", change)):
        out = folder / f"spike_{path.stem}.h5"
        assert apply(out, path, calibration).status == "done"
        found.append(files.read(out).motions["right"])
    assert not found[1].trusted[500:502].any()
    near = np.r_[490:500, 502:512]
    off = np.degrees(np.abs(found[1].angles - found[0].angles)[near])
    assert off.max() < 3.0


def test_what_is_wrong_late_in_a_stream_is_told_and_not_trusted(folder, calibration):
    def change(lines):
        head, rows = lines[:2], [line.split(",") for line in lines[2:]]
        names = head[1].split(",")
        for row in rows[600:900]:
            row[names.index("M_PIP")] = "255"
        for row in rows[600:]:
            row[names.index("I_MCP")] = "250"  # far beyond what any sample reads
        return [*head, *(",".join(row) for row in rows)]

    path = broken(folder, "late.csv", change)
    chosen = GloveApplyConfig(chunk=200, max_sigma_deg=90.0)
    report = apply(
        folder / "late.h5", path, calibration, replace(APPLYING, apply=chosen)
    )
    assert any("M_PIP saturated in 25 %" in text for text in texts(report.remarks))
    assert any("I_MCP" in t and "far outside" in t for t in texts(report.remarks))
    trusted = files.read(folder / "late.h5").motions["right"].trusted
    assert trusted[:590].mean() > 0.9
    assert not trusted[600:].any()


def test_two_poses_are_told_to_be_few(folder, samples):
    out = folder / "two.h5"
    settings = GloveFitting(fit=QUICK, jobs=1)
    report = run("calibrate-glove fit", settings, out, samples[0], samples[2])
    assert report.status == "done", report.error
    assert any("is known at 2 angles" in text for text in texts(report.remarks))
    floors = report.figures["floor_deg"]
    assert floors["index_pip_flexion"] > 8.0


def test_a_sensor_that_was_not_connected_is_refused(folder):
    made = []
    for pose in ("flat", "fist"):
        path = folder / f"w1_pose-{pose}-1.csv"
        lines = path.read_text().splitlines()
        at = lines[1].split(",").index("R_PIP")
        rows = [line.split(",") for line in lines[2:]]
        for row in rows:
            row[at] = "120"
        dead = folder / f"dead-{pose}.csv"
        dead.write_text("\n".join([*lines[:2], *(",".join(r) for r in rows)]) + "\n")
        made.append(folder / f"dead-{pose}.h5")
        assert sample(made[-1], dead, pose=pose).status == "done"
    settings = GloveFitting(fit=QUICK, jobs=1)
    report = run("calibrate-glove fit", settings, folder / "no2.h5", *made)
    assert report.status == "failed"
    assert "R_PIP reads 120 in all" in report.error


def test_rotations_that_are_too_unsure_are_named(folder, calibration):
    strict = replace(APPLYING, apply=GloveApplyConfig(max_sigma_deg=0.5))
    report = apply(folder / "w.h5", folder / "w2_motion.csv", calibration, strict)
    assert report.figures["trusted"] == 0.0
    told = next(text for text in texts(report.remarks) if "too unsure" in text)
    assert "wrist_flexion" in told
    assert "100 % of frames" in told
    loose = replace(APPLYING, apply=GloveApplyConfig(max_sigma_deg=90.0))
    report = apply(folder / "w.h5", folder / "w2_motion.csv", calibration, loose)
    assert not any("too unsure" in text for text in texts(report.remarks))


def test_smoothing_takes_noise_out_of_angles(folder, session, calibration):
    errors = []
    truth = next(t for t in session.takes if t.name == "w2/motion").angles
    for cutoff in (0.0, 8.0):
        out = folder / f"smooth{cutoff:g}.h5"
        chosen = replace(APPLYING, apply=GloveApplyConfig(cutoff_hz=cutoff))
        report = apply(out, folder / "w2_motion.csv", calibration, chosen)
        assert report.status == "done", report.error
        angles = files.read(out).motions["right"].angles
        jitter = np.abs(np.diff(angles - truth, axis=0)).mean()
        errors.append((np.abs(angles - truth).mean(), jitter))
    assert errors[1][0] < errors[0][0]
    assert errors[1][1] < 0.5 * errors[0][1]


def test_markers_recorded_with_the_glove_are_brought_to_its_clock(folder, session):
    report = sample(
        folder / "marked.h5",
        folder / "w1_markers.csv",
        files={"markers": folder / "markers.h5"},
    )
    assert report.status == "done", report.error
    take = next(t for t in session.takes if t.name == "w1/markers")
    assert report.figures["offset_s"] == pytest.approx(-take.late, abs=0.01)
    assert len(report.figures["rotations"]) == 22
    read, glove = glove_files.read_samples(folder / "marked.h5")
    pip = read.targets[:, glove.hand.index("index_pip_flexion")]
    sensor = read.readings[:, glove.sensors.index("I_PIP")]
    assert np.corrcoef(pip, sensor)[0, 1] > 0.97


def test_processes_do_not_change_a_calibration(folder, samples):
    few = samples[:6]
    found = []
    for jobs in (1, 2):
        out = folder / f"jobs{jobs}.h5"
        settings = GloveFitting(fit=replace(QUICK, model="linear"), jobs=jobs)
        report = run("calibrate-glove fit", settings, out, *few)
        assert report.status == "done", report.error
        found.append(glove_files.read_calibration(out))
    for one, two in zip(found[0].fits, found[1].fits, strict=True):
        assert one.rotation == two.rotation
        for name, values in one.fitted.to_arrays().items():
            np.testing.assert_array_equal(values, two.fitted.to_arrays()[name])


def test_a_calibration_written_and_read_predicts_the_same(folder, calibration, session):
    made = glove_files.read_calibration(calibration)
    again = folder / "again.h5"
    glove_files.write_calibration(again, made, ())
    values = session.takes[0].readings
    for one, two in zip(
        predict_measured(made, values),
        predict_measured(glove_files.read_calibration(again), values),
        strict=True,
    ):
        np.testing.assert_array_equal(one, two)


def test_a_reworn_calibration_written_and_read_predicts_the_same(
    folder, calibration, again, session
):
    out, copy = folder / "day2b.h5", folder / "day2c.h5"
    assert rewear(out, calibration, *again).status == "done"
    made = glove_files.read_calibration(out)
    glove_files.write_calibration(copy, made, ())
    values = session.takes[0].readings
    first = predict_measured(made, values)
    for one, two in zip(
        first, predict_measured(glove_files.read_calibration(copy), values), strict=True
    ):
        np.testing.assert_array_equal(one, two)
    plain = predict_measured(glove_files.read_calibration(calibration), values)
    assert np.abs(plain[0] - first[0]).max() > 1e-3


def broken(folder, name, change):
    """A copy of a take's readings with its lines changed."""
    lines = (folder / "w2_motion.csv").read_text().splitlines()
    path = folder / name
    path.write_text("\n".join(change(lines)) + "\n")
    return path


def without(sensor):
    def change(lines):
        at = lines[1].split(",").index(sensor)
        cut = [line.split(",") for line in lines[1:]]
        return [lines[0], *(",".join(c[:at] + c[at + 1 :]) for c in cut)]

    return change


def setting(sensor, value):
    def change(lines):
        at = lines[1].split(",").index(sensor)
        rows = [line.split(",") for line in lines[2:]]
        for row in rows:
            row[at] = value
        return [*lines[:2], *(",".join(row) for row in rows)]

    return change


def test_a_calibration_of_another_glove_is_refused(folder, calibration):
    def other(lines):
        return [lines[0].replace("cyberglove18", "cyberglove22"), *lines[1:]]

    path = broken(folder, "other.csv", other)
    report = apply(folder / "no.h5", path, calibration)
    assert "was recorded with glove cyberglove22" in report.error


def test_a_missing_sensor_and_a_wrong_count_are_refused(folder, calibration):
    path = broken(folder, "less.csv", without("R_PIP"))
    assert "has no sensor R_PIP" in apply(folder / "no.h5", path, calibration).error
    bare = broken(folder, "bare.csv", lambda ls: [",".join(["1"] * 12)] * 3)
    report = apply(folder / "no.h5", bare, calibration, rate_hz=60.0)
    assert "has 12 columns of readings; cyberglove18 has 18 sensors" in report.error


def test_dead_blank_and_saturated_sensors_are_told(folder, calibration):
    path = broken(folder, "dead.csv", setting("M_PIP", "90"))
    report = apply(folder / "dead.h5", path, calibration)
    assert any("M_PIP never changed" in text for text in texts(report.remarks))
    path = broken(folder, "full.csv", setting("M_PIP", "255"))
    report = apply(folder / "full.h5", path, calibration)
    assert any("M_PIP saturated in 100 %" in text for text in texts(report.remarks))
    assert report.figures["trusted"] == 0.0
    path = broken(folder, "blank.csv", setting("M_PIP", ""))
    report = apply(folder / "blank.h5", path, calibration)
    assert any("M_PIP reads nothing" in text for text in texts(report.remarks))
    motion = files.read(folder / "blank.h5").motions["right"]
    pip = motion.names.index("middle_pip_flexion")
    assert np.isnan(motion.angles[:, pip]).all()
    assert np.isfinite(motion.angles[:, motion.names.index("index_pip_flexion")]).all()
    assert not motion.trusted.any()


def test_readings_far_from_the_samples_are_told(folder, calibration):
    path = broken(folder, "far.csv", setting("I_PIP", "254"))
    report = apply(folder / "far.h5", path, calibration)
    assert any("I_PIP read far outside" in text for text in texts(report.remarks))


@pytest.mark.parametrize(
    ("known", "says"),
    [
        ({}, "give one of --pose"),
        ({"pose": "flat", "touch": "thumb,index"}, "--pose and --touch"),
        ({"pose": "flta"}, "did you mean flat"),
        ({"holds": ("IM_ABD",)}, "should be like IM_ABD=20"),
        ({"holds": ("IM=20",)}, "no rotation is called 'IM'"),
        ({"touch": "thumb"}, "two or more"),
    ],
)
def test_what_cannot_be_sampled_is_said(folder, known, says):
    report = sample(folder / "no.h5", folder / "w1_pose-flat-1.csv", **known)
    assert report.status == "failed"
    assert says in report.error


def test_a_take_without_angles_cannot_mark_readings(folder):
    bare = folder / "bare.h5"
    write_session(bare, Recording(rate=60.0, frames=3))
    report = sample(
        folder / "no.h5", folder / "w1_markers.csv", files={"markers": bare}
    )
    assert "has no joint angles; 'handclean solve' adds them" in report.error


def test_files_of_other_kinds_are_refused(folder, samples, calibration):
    settings = GloveFitting(fit=QUICK, jobs=1)
    report = run("calibrate-glove fit", settings, folder / "no.h5", calibration)
    assert "not a handclean glove samples" in report.error
    report = apply(folder / "no.h5", folder / "w2_motion.csv", samples[0])
    assert "not a handclean glove calibration" in report.error


def test_a_damaged_calibration_is_refused(folder, calibration):
    path = folder / "damaged.h5"
    shutil.copy(calibration, path)
    with edited(path) as file:
        del file["rotations/index_pip_flexion/model/input_center"]
    report = apply(folder / "no.h5", folder / "w2_motion.csv", path)
    assert "input_center" in report.error
    assert "internal error" not in report.error


def test_a_simulated_session_is_written_with_its_truth(tmp_path):
    config = SimulateConfig(glove="generic5", donnings=1)
    settings = Simulating(scenario="glove", kind="glove", simulate=config)
    (task,) = simulating.tasks(settings, tmp_path)
    report = execute(Work(command=COMMANDS["simulate"], settings=settings), task)
    assert report.status == "done", report.error
    reading = tmp_path / "S01_001" / "w1" / "pose-fist-1.csv"
    facts = json.loads(reading.read_text().splitlines()[0].split("readings ")[1])
    assert facts == {"glove": "generic5", "subject": "S01"}
    truth = files.read(tmp_path / "truth" / "S01_001" / "w1" / "pose-fist-1.h5")
    motion = truth.motions["right"]
    bend = np.degrees(motion.angles[:, motion.names.index("ring_pip_flexion")])
    assert bend.mean() == pytest.approx(98.0, abs=5.0)
    assert (tmp_path / "subjects" / "S01.h5").exists()
