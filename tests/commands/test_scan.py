"""``calibrate-hand scan`` and the markers on what it makes, as commands run them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scanned import scanned
from takes import take_source
from told import texts

from handclean.commands.shared.choices import Calibrating, Scanning
from handclean.commands.table import COMMANDS
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.io import files
from handclean.io.hdf5.subject import read_subject, write_subject
from handclean.io.landmarks import write_landmarks
from handclean.io.mesh.meshes import Mesh, write_mesh
from handclean.recording import Recording, trajectories
from handclean.runner import plan, progress
from handclean.runner.batch import Task
from handclean.runner.command import Work
from handclean.runner.execute import execute
from handclean.subject.scan.fit import shipped_start
from handclean.subject.scan.markers import put_on_skin
from handclean.subject.scan.settings import ScanConfig
from handclean.subject.settings import CalibrateConfig

QUICK = Scanning(scan=ScanConfig(rounds=3, steps=1), name="S01")


def run(command, settings, output, *paths, **given):
    sources = tuple(take_source(path=path, **given) for path in paths)
    outputs = (output,)
    task = Task(sources=sources, outputs=outputs, token=plan.token(), reduces=True)
    return execute(Work(command=COMMANDS[command], settings=settings), task)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A scan in millimetres that does not say so, with landmarks."""
    folder = tmp_path_factory.mktemp("scan")
    truth = scanned(4, count=5000, start=shipped_start("right"))
    mesh = Mesh(
        vertices=truth.scan.points,
        faces=np.zeros((0, 3), dtype=np.int64),
        normals=truth.scan.normals,
        colors=truth.scan.colors,
    )
    write_mesh(folder / "hand.ply", mesh)
    write_landmarks(folder / "hand.toml", truth.marks)
    return folder


@pytest.fixture(scope="module")
def subject(folder):
    """The subject of the scan, as a file."""
    report = run(
        "calibrate-hand scan",
        QUICK,
        folder / "scan.h5",
        folder / "hand.ply",
        files={"landmarks": folder / "hand.toml"},
    )
    assert report.status == "done", report.error + report.trace
    assert report.figures["fit_mean_mm"] < 1.0
    assert report.figures["lengths_mm"]["index_pip"] > 30.0
    assert texts(report.remarks) == ()
    return folder / "scan.h5"


def test_a_scan_becomes_a_subject_with_a_skin(subject):
    found = read_subject(subject)
    assert found.name == "S01"
    assert found.surface is not None
    assert found.model.labels == ()
    assert found.errors["scan_fit_mean_m"] < 0.001


def test_a_rerun_is_skipped(subject, folder):
    report = run(
        "calibrate-hand scan",
        QUICK,
        subject,
        folder / "hand.ply",
        files={"landmarks": folder / "hand.toml"},
    )
    assert report.status == "skipped"


def test_a_neutral_take_puts_markers_on_it(subject, folder, rng):
    scan = read_subject(subject)
    model, _ = put_on_skin(scan, load_marker_set("maycock26"))
    pose = np.zeros((30, 7 + len(model.tree.hinges)))
    pose[:, 3] = 1.0
    seen = marker_positions(model, pose) + rng.normal(scale=2e-4, size=(30, 26, 3))
    take = Recording(rate=100.0, frames=30, markers=trajectories(seen, model.labels))
    files.write(folder / "flat.h5", take)
    settings = Calibrating(calibrate=CalibrateConfig(), name="")
    given = {"subjects": (subject,), "marker_set": "maycock26"}
    report = run(
        "calibrate-hand markers",
        settings,
        folder / "worn.h5",
        folder / "flat.h5",
        **given,
    )
    assert report.status == "done", report.error + report.trace
    assert report.figures["neutral_rms_mm"] < 0.5
    found = read_subject(folder / "worn.h5")
    assert found.name == "S01"
    assert found.marker_set == "maycock26"
    assert found.surface is not None
    assert np.linalg.norm(found.model.at - model.at, axis=1).mean() < 0.002
    wrong = run(
        "calibrate-hand markers",
        settings,
        folder / "wrong.h5",
        folder / "flat.h5",
        side="left",
        **given,
    )
    assert wrong.exit_status == 2
    assert "right hand" in wrong.error
    write_subject(folder / "bare.h5", replace(found, surface=None))
    bare = run(
        "calibrate-hand markers",
        settings,
        folder / "wrong.h5",
        folder / "flat.h5",
        subjects=(folder / "bare.h5",),
        marker_set="maycock26",
    )
    assert "has no skin" in bare.error


@pytest.mark.parametrize(
    ("given", "scans", "word"),
    [
        ({}, 1, "--landmarks: is missing"),
        ({"files": {"landmarks": Path("hand.toml")}}, 2, "one scan"),
        ({"files": {"landmarks": Path("none.toml")}}, 1, "none.toml"),
        ({"files": {"landmarks": Path("hand.toml")}, "unit": "mm"}, 1, "--unit"),
        (
            {"files": {"landmarks": Path("hand.toml")}, "side": "left"},
            1,
            "--side right",
        ),
        ({"files": {"landmarks": Path("hand.toml")}, "side": "both"}, 1, "--side"),
    ],
)
def test_bad_input_is_one_line(folder, monkeypatch, given, scans, word):
    monkeypatch.chdir(folder)
    paths = [Path("hand.ply")] * scans
    report = run("calibrate-hand scan", QUICK, Path("no.h5"), *paths, **given)
    assert report.status == "failed"
    assert word in report.error
    assert "\n" not in report.error
    assert "internal" not in report.error


def test_progress_is_told_to_terminals_only(capsys, monkeypatch):
    with progress.shown(quiet=False):
        progress.tell("in a pipe")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with progress.shown(quiet=True):
        progress.tell("quietly")
    progress.tell("outside")
    with progress.shown(quiet=False):
        progress.tell("joints")
        progress.done()
    assert capsys.readouterr().err == "\r\033[Kjoints\r\033[K"
