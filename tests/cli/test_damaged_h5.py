"""Damaged HDF5 files among others: each is one line, and none holds the others up."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from handclean.cli.main import main
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.io.hdf5 import walker
from handclean.io.hdf5.session import write_session
from handclean.io.hdf5.subject import write_subject
from handclean.recording import Recording, trajectories
from tests.io.hdf5.test_seal import with_a_flipped_bit
from tests.io.hdf5.test_walker import with_ring


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield
    walker.stop()
    walker._State.bad.clear()


def take(name):
    markers = trajectories(np.arange(60.0).reshape(10, 2, 3) / 50, ("A", "B"))
    write_session(Path(name), Recording(rate=100.0, frames=10, markers=markers))
    return name


@pytest.mark.parametrize("line", [["inspect"], ["convert", "-o", "out.c3d"]])
def test_a_ring_in_a_file_is_one_line_and_exit_1(capfd, line):
    with_ring(Path("ring.h5"))
    assert main([*line, "ring.h5"]) == 1
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("ring.h5: cannot be read")
    assert err.count("\n") == 1
    assert not Path("out.c3d").exists()


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_good_files_beside_a_bad_one_are_done(capfd, jobs):
    good = [take(f"{name}.h5") for name in "abc"]
    with_ring(Path("bad.h5"))
    names = [good[0], "bad.h5", *good[1:]]
    line = ["convert", *names, "-o", "out", "--format", ".csv", "--json", "-j", jobs]
    assert main(line) == 1
    lines = [json.loads(text) for text in capfd.readouterr().out.splitlines()]
    status = {Path(line["input"]).name: line["status"] for line in lines}
    assert status == dict.fromkeys(good, "done") | {"bad.h5": "failed"}


def test_skipped_files_start_no_process(capfd, monkeypatch):
    take("a.h5")
    line = ["convert", "a.h5", "-o", "b.h5", "--json"]
    assert main(line) == 0
    walker.stop()
    capfd.readouterr()
    monkeypatch.setattr(walker, "_started", None)
    assert main(line) == 0
    assert json.loads(capfd.readouterr().out)["status"] == "skipped"


def test_rotten_numbers_are_an_error_and_lenient_reads_them_with_a_warning(capfd):
    take("a.h5")
    with_a_flipped_bit(Path("a.h5"), "markers/positions")
    assert main(["convert", "a.h5", "-o", "b.csv"]) == 1
    out, err = capfd.readouterr()
    assert out == ""
    assert "a.h5: is damaged or was edited: its bytes do not fit its /sha256" in err
    assert "--lenient" in err
    assert err.count("\n") == 1
    assert not Path("b.csv").exists()
    assert main(["convert", "a.h5", "-o", "b.csv", "--lenient"]) == 0
    err = capfd.readouterr().err
    assert err.count("a.h5 is damaged or was edited") == 1
    assert "warning" in err
    assert Path("b.csv").exists()
    assert main(["learn", "subspace", "a.h5", "-o", "p.h5", "--lenient"]) == 1
    err = capfd.readouterr().err
    assert err.count("warning: a.h5 is damaged or was edited") == 1
    assert main(["inspect", "a.h5"]) == 0
    assert "odd: a.h5 is damaged or was edited" in capfd.readouterr().out


def test_inspecting_attributes_that_are_called_like_figures_does_no_harm(capfd):
    with h5py.File("x.h5", "w") as file:
        file.attrs.update(format="handclean thing", version=1, frames="many")
        file.attrs.update(rate="fast", markers=3, traps="none", skin=1, name=5)
    assert main(["inspect", "x.h5"]) == 0
    assert "handclean thing" in capfd.readouterr().out


def test_a_rotten_subject_is_taken_with_a_warning_where_lenient(capfd):
    subject = template_subject(load_marker_set("schroeder8"), "right")
    write_subject(Path("s.h5"), subject)
    places = marker_positions(subject.model, neutral_pose(subject.model.tree)[None])
    markers = trajectories(np.tile(places, (5, 1, 1)), subject.model.labels)
    write_session(Path("a.h5"), Recording(rate=100.0, frames=5, markers=markers))
    with_a_flipped_bit(Path("s.h5"), "markers/at")
    line = ["solve", "a.h5", "--subject", "s.h5", "-o", "b.h5"]
    assert main(line) == 2
    assert "s.h5: is damaged or was edited" in capfd.readouterr().err
    assert main([*line, "--lenient"]) == 0
    assert capfd.readouterr().err.count("s.h5 is damaged or was edited") == 1
