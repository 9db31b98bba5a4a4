"""The commands on simulated takes, each the way the command line goes."""

import re
from dataclasses import replace

import numpy as np
import pytest
from takes import take_batch, take_source
from told import texts

from handclean.api.label import lost, renamed
from handclean.commands import simulate
from handclean.commands.shared import hands
from handclean.commands.shared.choices import (
    Calibrating,
    Cleaning,
    Filling,
    LearnConfig,
    Simulating,
    Solving,
)
from handclean.commands.table import COMMANDS, work_of
from handclean.errors import UsageError
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.io import files
from handclean.io.hdf5.prior import read_prior
from handclean.io.hdf5.subject import read_subject, write_subject
from handclean.labels.settings import LabelConfig
from handclean.recording import Origin
from handclean.report.settings import CompareConfig
from handclean.runner import many, plan
from handclean.runner.batch import Task
from handclean.runner.command import Work
from handclean.runner.execute import execute
from handclean.simulation.scenarios import find_scenario, settings_for
from handclean.simulation.settings import SimulateConfig
from handclean.subject.settings import CalibrateConfig

PARTS = (
    "translation", "rotation", "angles", "angles_sigma", "trusted", "residual",
)  # fmt: skip
CLEANING = Cleaning(label=LabelConfig(), fill=FillConfig(), solve=SolveConfig())


def done(command, settings, task):
    report = execute(Work(command=COMMANDS[command], settings=settings), task)
    assert report.status == "done", report.error + report.trace
    return report


def step(command, settings, source, output, **given):
    """Do a command that maps; return its figures."""
    sources = (take_source(path=source, **given),)
    task = Task(sources=sources, outputs=(output,), token=plan.token())
    return done(command, settings, task).figures


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Folder of one short take with its truth."""
    folder = tmp_path_factory.mktemp("simulated")
    config = settings_for(find_scenario("demo"), duration_s=3.0)
    chosen = Simulating(scenario="demo", kind="demo", simulate=config)
    for task in simulate.tasks(chosen, folder):
        done("simulate", chosen, task)
    return folder


@pytest.fixture(scope="module")
def cleaned(simulated):
    """What the chain makes of it, in one pass, and its figures."""
    output = simulated / "cleaned.h5"
    figures = step(
        "clean",
        CLEANING,
        simulated / "S01_001.c3d",
        output,
        subjects=(simulated / "subjects" / "S01.h5",),
    )
    return files.read(output), figures


def test_a_simulated_trial_is_what_cameras_saw_its_labels_and_its_truth(simulated):
    raw = files.read(simulated / "S01_001.c3d")
    labelled = files.read(simulated / "labelled" / "S01_001.c3d")
    truth = files.read(simulated / "truth" / "S01_001.h5")
    assert raw.markers is None
    assert labelled.markers.labels == truth.markers.labels
    seen = labelled.markers.measured
    away = labelled.markers.positions[seen] - truth.markers.positions[seen]
    assert 1e-5 < np.sqrt(np.mean(away**2)) < 1e-3  # [m] the cameras' noise
    assert len(raw.unlabelled.frame) == seen.sum() + len(labelled.unlabelled.frame)
    assert truth.markers.measured.all()


def test_a_trial_does_not_depend_on_how_many_are_made(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    made = []
    for trials in (2, 3):
        config = SimulateConfig(
            trials=trials, subjects=2, duration_s=0.5, rate_hz=50.0, occlusion=False
        )
        chosen = Simulating(scenario="free", kind="free", simulate=config)
        tasks = simulate.tasks(chosen, tmp_path / str(trials))
        assert len(tasks) == trials
        assert [len(task.outputs) for task in tasks] == [4, 4, 3][:trials]
        done("simulate", chosen, tasks[1])
        made.append(tasks[1].outputs)
    for one, other in zip(*made, strict=True):
        if one.suffix == ".c3d":
            assert one.read_bytes() == other.read_bytes()


def test_the_chain_finds_the_labels_and_the_angles_of_the_truth(simulated, cleaned):
    recording, figures = cleaned
    labelled = files.read(simulated / "labelled" / "S01_001.c3d").markers
    truth = files.read(simulated / "truth" / "S01_001.h5")
    order = [recording.markers.index(label) for label in labelled.labels]
    found = recording.markers.measured[:, order]
    right = found & labelled.measured
    away = recording.markers.positions[:, order] - labelled.positions
    right &= np.nan_to_num(np.linalg.norm(away, axis=2), nan=1.0) < 1e-4
    assert right.sum() / labelled.measured.sum() > 0.99
    assert right.sum() / found.sum() > 0.99
    side = next(name for name in truth.motions if name != "object")
    error = recording.motions[side].angles - truth.motions[side].angles
    assert np.degrees(np.median(np.abs(error))) < 1.0
    assert figures["followed"] == figures["frames"] == recording.frames
    assert figures["residual_mm"] < 1.0


def test_the_chain_is_its_steps_one_after_the_other(simulated, cleaned, tmp_path):
    recording, figures = cleaned
    given = {"subjects": (simulated / "subjects" / "S01.h5",)}
    labels, filled = tmp_path / "labels.h5", tmp_path / "filled.h5"
    raw = simulated / "S01_001.c3d"
    first = step("label", LabelConfig(), raw, labels, **given)
    filling = Filling(fill=FillConfig(), solve=SolveConfig())
    second = step("fill-gaps", filling, labels, filled, **given)
    one_by_one = files.read(filled)
    np.testing.assert_array_equal(
        one_by_one.markers.positions, recording.markers.positions
    )
    assert {**figures, **first, **second} == figures
    assert [entry["command"] for entry in one_by_one.provenance] == [
        "simulate", "label", "fill-gaps",
    ]  # fmt: skip
    assert figures["filled"] > 0
    assert (one_by_one.markers.origin == Origin.FILLED).sum() == (
        figures["filled_samples"]
    )
    solving = Solving(solve=SolveConfig(), standard=False)
    third = step("solve", solving, filled, tmp_path / "angles.h5", **given)
    assert third.pop("kept") == third["hands"] == 1
    assert {**figures, **third} == figures
    solved, cleaned = files.read(tmp_path / "angles.h5").motions, recording.motions
    assert solved.keys() == cleaned.keys()
    for name, motion in cleaned.items():
        assert np.isnan(motion.angles_sigma).sum() == 0
        assert solved[name].names == motion.names
        for part in PARTS:
            one, other = getattr(solved[name], part), getattr(motion, part)
            np.testing.assert_array_equal(one, other, err_msg=part)


def test_names_a_take_had_before_labelling_are_said_not_to_be_kept(simulated, tmp_path):
    take = files.read(simulated / "labelled" / "S01_001.c3d")
    known = take.markers.labels
    subject = read_subject(simulated / "subjects" / "S01.h5")
    (told,) = renamed(take, subject)
    named = f"its {len(known)} markers are named anew"
    assert told.text == f"names the take had are not kept: {named}"
    labels = ("elbow", *(f"x{i}" for i in range(4)), *known[5:])
    other = replace(take, markers=replace(take.markers, labels=labels))
    (told,) = renamed(other, subject)
    few = "elbow, x0, x1, x2, ..."
    assert told.text.endswith(f"5 other markers ({few}) are points without a name now")
    assert renamed(files.read(simulated / "S01_001.c3d"), subject) == ()


def test_comparing_with_the_truth_says_how_good_the_chain_is(simulated, cleaned):
    pair = (simulated / "truth" / "S01_001.h5", simulated / "cleaned.h5")
    task = Task(sources=tuple(take_source(path=path) for path in pair), reduces=True)
    figures = done("compare", CompareConfig(), task).figures
    assert figures["measured_mean_mm"] < 0.5
    assert figures["angles_mean_deg"] < 1.5
    assert figures["swaps"] == 0
    same = tuple(take_source(path=pair[1]) for _ in range(2))
    figures = done("compare", CompareConfig(), Task(sources=same, reduces=True)).figures
    assert figures["f1"] == 1.0
    assert figures["measured_mean_mm"] == figures["angles_mean_deg"] == 0.0


def test_solving_adds_the_motion_of_measured_markers(simulated, tmp_path):
    given = {"subjects": (simulated / "subjects" / "S01.h5",)}
    labelled = simulated / "labelled" / "S01_001.c3d"
    for standard in (False, True):
        settings = Solving(solve=SolveConfig(), standard=standard)
        output = tmp_path / f"{standard}.h5"
        figures = step("solve", settings, labelled, output, **given)
        assert figures["residual_mm"] < 1.0
        assert figures["trusted"] > 0.9
        assert len(files.read(output).motions) == 1


def test_without_a_subject_the_template_wears_the_markers_and_it_is_said(
    simulated, tmp_path
):
    source = take_source(
        path=simulated / "labelled" / "S01_001.c3d", marker_set="maycock26"
    )
    task = Task(sources=(source,), outputs=(tmp_path / "a.h5",), token="t")
    settings = Solving(solve=SolveConfig(), standard=False)
    report = done("solve", settings, task)
    assert any("nobody calibrated" in warning for warning in texts(report.remarks))


@pytest.mark.parametrize(
    ("given", "status", "said"),
    [
        ({}, 2, "--subject: is missing"),
        ({"marker_set": "maycock27"}, 1, "did you mean maycock26"),
        ({"marker_set": "maycock26", "side": "both"}, 2, "--side both"),
        ({"marker_set": "pavllo9"}, 1, "none of the subject's markers"),
    ],
)
def test_a_hand_that_cannot_be_had_is_one_line(
    simulated, tmp_path, given, status, said
):
    source = take_source(path=simulated / "labelled" / "S01_001.c3d", **given)
    task = Task(sources=(source,), outputs=(tmp_path / "a.h5",), token="t")
    settings = Solving(solve=SolveConfig(), standard=False)
    report = execute(Work(command=COMMANDS["solve"], settings=settings), task)
    assert (report.status, report.exit_status) == ("failed", status)
    assert said in report.error
    assert report.error.startswith(str(source.path))


def left_hand(simulated, folder):
    """Write the subject's hand as if it were the left one."""
    subject = read_subject(simulated / "subjects" / "S01.h5")
    tree = replace(subject.model.tree, side="left")
    path = folder / "left.h5"
    write_subject(path, replace(subject, model=replace(subject.model, tree=tree)))
    return path


def test_two_hands_at_once_are_refused_until_they_can_be_labelled(simulated, tmp_path):
    subject = simulated / "subjects" / "S01.h5"
    both = (subject, left_hand(simulated, tmp_path))
    source = take_source(path=simulated / "S01_001.c3d", subjects=both)
    task = Task(sources=(source,), outputs=(tmp_path / "a.h5",), token="t")
    report = execute(Work(command=COMMANDS["clean"], settings=CLEANING), task)
    assert report.exit_status == 2
    assert "2 hands cannot be labelled at once" in report.error


@pytest.mark.parametrize(
    ("command", "settings"),
    [
        ("clean", CLEANING),
        ("label", LabelConfig()),
        ("solve", Solving(solve=SolveConfig(), standard=False)),
        ("fill-gaps", Filling(fill=FillConfig(), solve=SolveConfig())),
    ],
)
def test_two_subjects_of_one_side_are_wrong_usage(
    simulated, tmp_path, command, settings
):
    subject = simulated / "subjects" / "S01.h5"
    other = tmp_path / "other.h5"
    other.write_bytes(subject.read_bytes())
    said = f"--subject: {subject} and {other} are right hands"
    source = take_source(path=simulated / "S01_001.c3d", subjects=(subject, other))
    task = Task(sources=(source,), outputs=(tmp_path / "a.h5",), token="t")
    report = execute(Work(command=COMMANDS[command], settings=settings), task)
    assert (report.status, report.exit_status) == ("failed", 2)
    assert said in report.error
    batch = take_batch(
        inputs=(source.path,), output=str(tmp_path / "out"), subjects=(subject, other)
    )
    with pytest.raises(UsageError, match=re.escape(said)):
        many.run(work_of(command, batch, settings), batch)
    left = left_hand(simulated, tmp_path)
    hands.check(take_batch(subjects=(subject, left)))
    hands.check(take_batch(subjects=(subject, other, left), side="left"))


def far_away(recording, share):
    """Points of a share of the frames, from the middle on, where no hand is."""
    points = recording.unlabelled
    hidden = points.frame < round((1.0 - share) * recording.frames)
    at = points.positions.copy()
    spread = np.random.default_rng(5).uniform(-5.0, 5.0, size=at.shape)  # [m]
    at[hidden] = spread[hidden]
    return replace(recording, unlabelled=replace(points, positions=at))


@pytest.mark.parametrize(
    ("command", "settings"), [("label", LabelConfig()), ("clean", CLEANING)]
)
def test_a_take_without_the_hand_fails_and_one_with_little_of_it_is_warned_of(
    simulated, tmp_path, command, settings
):
    given = {"subjects": (simulated / "subjects" / "S01.h5",)}
    raw = files.read(simulated / "S01_001.c3d")
    for share in (0.0, 0.3):
        path, output = tmp_path / f"{share}.h5", tmp_path / f"{share}.out.h5"
        files.write(path, far_away(raw, share))
        task = Task(
            sources=(take_source(path=path, **given),), outputs=(output,), token="t"
        )
        report = execute(Work(command=COMMANDS[command], settings=settings), task)
        if share == 0.0:
            assert (report.status, report.exit_status) == ("failed", 1)
            assert report.error.startswith(f"{path}: ")
            assert not output.exists()
            continue
        assert report.status == "done"
        followed, frames = report.figures["followed"], report.figures["frames"]
        assert 0 < followed < frames / 2
        assert f"{followed} of {frames} frames only" in report.line
        assert any(f"{followed} of {frames} frames" in w for w in texts(report.remarks))


def test_a_take_that_was_followed_in_few_frames_is_warned_of():
    assert lost({"followed": 4, "frames": 7}) == ()
    assert len(lost({"followed": 3, "frames": 7})) == 1


def misspelt(simulated, folder):
    """Write the labelled take with one marker's name misspelt."""
    recording = files.read(simulated / "labelled" / "S01_001.c3d")
    labels = tuple(n.replace("INDEX_TIP", "INDX_TIP") for n in recording.markers.labels)
    path = folder / "misspelt.h5"
    markers = replace(recording.markers, labels=labels)
    files.write(path, replace(recording, markers=markers))
    return path


@pytest.mark.parametrize(
    ("command", "settings"),
    [
        ("solve", Solving(solve=SolveConfig(), standard=False)),
        ("fill-gaps", Filling(fill=FillConfig(), solve=SolveConfig())),
    ],
)
def test_a_misspelt_marker_is_warned_of(simulated, tmp_path, command, settings):
    source = take_source(
        path=misspelt(simulated, tmp_path),
        subjects=(simulated / "subjects" / "S01.h5",),
    )
    task = Task(sources=(source,), outputs=(tmp_path / "a.h5",), token="t")
    said = "marker 'R_INDEX_TIP' of the subject is not in the take; "
    warnings = texts(done(command, settings, task).remarks)
    assert warnings[0] == said + "the take has 'R_INDX_TIP'"
    assert warnings[1:] == (
        "right: no marker beyond index_dip_flexion in 100 % of frames: its angles are "
        "the prior's",
    )


@pytest.mark.parametrize(
    ("marker_set", "said"),
    [
        ("maycock26", "'R_INDEX_TIP' of marker set maycock26 is not in it; it has"),
        ("han19", "it has 25 of the 26 of maycock26: --marker-set maycock26"),
    ],
)
def test_a_set_that_is_not_the_takes_teaches_nothing_but_what_fits(
    simulated, tmp_path, marker_set, said
):
    path = misspelt(simulated, tmp_path)
    source = take_source(path=path, marker_set=marker_set)
    output = tmp_path / "s.h5"
    task = Task(sources=(source,), outputs=(output,), token="t", reduces=True)
    settings = Calibrating(calibrate=CalibrateConfig(), name="")
    report = execute(
        Work(command=COMMANDS["calibrate-hand markers"], settings=settings), task
    )
    assert (report.status, report.exit_status) == ("failed", 1)
    assert report.error.startswith(f"{path}: ")
    assert said in report.error


def test_a_subject_is_learnt_from_a_range_of_motion(tmp_path):
    config = SimulateConfig(rate_hz=25.0, occlusion=False, noise_m=1e-4, slide=0.2)
    chosen = Simulating(scenario="rom", kind="rom", simulate=config)
    (task,) = simulate.tasks(chosen, tmp_path)
    done("simulate", chosen, task)
    settings = Calibrating(calibrate=CalibrateConfig(frames=80), name="Ada")
    source = take_source(path=task.outputs[1], marker_set="maycock26")
    output = tmp_path / "ada.h5"
    reduce = Task(sources=(source,), outputs=(output,), token="t", reduces=True)
    figures = done("calibrate-hand markers", settings, reduce).figures
    assert figures["heldout_rms_mm"] < 1.0
    subject, true = read_subject(output), read_subject(task.outputs[3])
    assert (subject.name, subject.calibrated) == ("Ada", True)
    assert subject.model.tree.side == true.model.tree.side


def test_a_prior_holds_what_it_was_learnt_from(simulated, tmp_path, capsys):
    truth = simulated / "truth" / "S01_001.h5"
    batch = take_batch(
        inputs=(truth,),
        output=str(tmp_path / "prior.h5"),
        files={"held_out 1": truth},
        require=("covered>=0.9", "held_out_covered>=0.9"),
    )
    work = work_of("learn subspace", batch, LearnConfig(share=0.9))
    assert many.reduce(work, batch) == 0
    assert "of the variance of 20 angles" in capsys.readouterr().out
    prior = read_prior(tmp_path / "prior.h5")
    assert 0.9 <= prior.variance_share.sum() <= 1.0
    hand = next(n for n in files.read(truth).motions if n != "object")
    assert prior.names == files.read(truth).motions[hand].names


def test_learning_wants_angles(simulated, tmp_path):
    source = take_source(path=simulated / "S01_001.c3d")
    task = Task(
        sources=(source,), outputs=(tmp_path / "p.h5",), token="t", reduces=True
    )
    report = execute(
        Work(command=COMMANDS["learn subspace"], settings=LearnConfig()), task
    )
    assert "has no joint angles" in report.error
