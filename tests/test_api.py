"""The public API gives what the commands give, and its examples run as they stand."""

import doctest
import json
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import h5py
import numpy as np
import pytest

import handclean as hc
from handclean.errors import UnknownSettingError, UsageError

ROOT = Path(__file__).parents[1]
FUNCTIONS = [
    *("read", "read_subject", "write", "inspect", "label", "fill_gaps", "solve"),
    *("clean", "calibrate_hand", "compare", "simulate"),
]
TOLD = ("provenance", "sha256", "events")
"""Parts of a session that say who made it, or what is odd."""


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_example_of_a_function_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    function = getattr(hc, name)
    where = {"name": name, "globs": {}, "module": import_module(function.__module__)}
    (found,) = doctest.DocTestFinder(recurse=False).find(function, **where)
    assert found.examples
    told = []
    result = doctest.DocTestRunner(optionflags=0).run(found, out=told.append)
    assert result.failed == 0, "".join(told)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_gives_and_raises(name):
    text = getattr(hc, name).__doc__
    for part in ("Parameters", "Returns", "Raises", "Examples"):
        assert f"\n    {part}\n    {'-' * len(part)}\n" in text, part


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A take as a C3D, the same with names, and its subject."""
    folder = tmp_path_factory.mktemp("api")
    (trial,) = hc.simulate("free", duration_s=1.5, rate_hz=60.0, seed=4)
    hc.write(trial.unlabelled, folder / "take.c3d")
    hc.write(trial.labelled, folder / "labelled.c3d")
    hc.write(trial.subject, folder / "S01.h5")
    return folder


def command(folder, *words):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = [sys.executable, "-m", "handclean", *words, "--quiet"]
    subprocess.run(run, cwd=folder, env=environment, check=True)


def datasets(path):
    found = {}

    def keep(name, item):
        if isinstance(item, h5py.Dataset) and name.split("/")[0] not in TOLD:
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(keep)
    return found


def expect_same_arrays(one, other):
    one, other = datasets(one), datasets(other)
    assert one.keys() == other.keys()
    assert any(name.startswith("motion") for name in one)
    for name, values in one.items():
        assert values.dtype == other[name].dtype, name
        np.testing.assert_array_equal(values, other[name], err_msg=name)


STEPS = {
    "label": (hc.label, "take.c3d", ["--strict", "5"], {"strict": 5.0}),
    "fill-gaps": (
        hc.fill_gaps,
        "labelled.c3d",
        ["--max-gap-s", "0.2", "--solve-prior-m", "4e-4", "--despike"],
        {"max_gap_s": 0.2, "solve_prior_m": 4e-4, "despike": True},
    ),
    "solve": (hc.solve, "labelled.c3d", ["--standard"], {"standard": True}),
    "clean": (
        hc.clean,
        "take.c3d",
        ["--fill-max-gap-s", "0.2", "--label-strict", "5", "--fill-smooth", "8"],
        {"fill_max_gap_s": 0.2, "strict": 5, "smooth": 8.0},
    ),
}
"""By command: the function, what is read, options, and the same as settings."""


@pytest.mark.parametrize("name", STEPS)
def test_a_function_gives_the_arrays_of_its_command(name, folder):
    function, given, options, settings = STEPS[name]
    out = folder / f"{name}.h5"
    command(folder, name, given, "--subject", "S01.h5", *options, "-o", out.name)
    take, subject = hc.read(folder / given), hc.read_subject(folder / "S01.h5")
    made = function(take, [subject], **settings)
    hc.write(made, folder / f"{name}.api.h5")
    expect_same_arrays(out, folder / f"{name}.api.h5")
    assert [entry["command"] for entry in made.provenance] == [name]


def test_steps_one_after_another_give_what_one_pass_gives(folder):
    take, subject = hc.read(folder / "take.c3d"), hc.read_subject(folder / "S01.h5")
    whole = hc.clean(take, subject)
    filled = hc.fill_gaps(hc.label(take, subject), subject)
    assert (filled.markers.origin == 2).any()
    hc.write(whole, folder / "whole.h5")
    for before in (filled, hc.read(_written(filled, folder / "filled.h5"))):
        parts = hc.solve(before, subject)
        hc.write(parts, folder / "parts.h5")
        expect_same_arrays(folder / "whole.h5", folder / "parts.h5")
    command(folder, "solve", "filled.h5", "--subject", "S01.h5", "-o", "solved.h5")
    expect_same_arrays(folder / "whole.h5", folder / "solved.h5")


def _written(take, path):
    hc.write(take, path)
    return path


def test_a_result_carries_the_remarks_of_its_step(folder):
    take = hc.read(folder / "labelled.c3d")
    made = hc.solve(take, marker_set="maycock26")
    assert all(isinstance(one, hc.Remark) for one in made.remarks)
    assert any("nobody calibrated this hand" in one.text for one in made.remarks)


def test_a_setting_that_does_not_exist_is_an_error_with_a_suggestion(folder):
    take, subject = hc.read(folder / "labelled.c3d"), hc.read_subject(folder / "S01.h5")
    for function, wrong, right in (
        (hc.fill_gaps, {"max_gap": 0.2}, "did you mean max_gap_s"),
        (hc.clean, {"label_strickt": 5.0}, "did you mean label_strict"),
        (hc.label, {"max_gap_s": 0.2}, "no setting is called 'max_gap_s'"),
        (hc.solve, {"iteration": 3}, "did you mean iterations"),
    ):
        with pytest.raises(UnknownSettingError, match=right):
            function(take, subject, **wrong)
    with pytest.raises(UsageError, match="iterations should be an int"):
        hc.solve(take, subject, iterations=0.5)
    with pytest.raises(UsageError, match="seed should be 0 or more"):
        hc.simulate("free", seed=-1)


def test_whose_hands_are_sought_is_said_once(folder):
    take, subject = hc.read(folder / "labelled.c3d"), hc.read_subject(folder / "S01.h5")
    for given, wrong in (
        ({}, "give either a subject"),
        ({"subjects": subject, "marker_set": "maycock26"}, "give either a subject"),
        ({"subjects": [subject, subject]}, "are right hands"),
        ({"subjects": subject, "side": "left"}, "side: cannot be 'left' here"),
        ({"marker_set": "maycock27"}, "did you mean maycock26"),
    ):
        with pytest.raises(hc.HandcleanError, match=wrong):
            hc.solve(take, **given)


def test_a_failed_write_leaves_what_stood_there(folder):
    place = folder / "kept.mot"
    place.write_text("here")
    take = hc.read(folder / "take.c3d")
    with pytest.raises(hc.HandcleanError):
        hc.write(take, place)  # no angles
    assert place.read_text() == "here"
    assert not list(folder.glob(".kept*"))
    with pytest.raises(hc.HandcleanError, match="cannot be written: no such file"):
        hc.write(take, folder / "nowhere" / "take.c3d")
    with pytest.raises(UsageError, match="a subject is written as"):
        hc.write(hc.read_subject(folder / "S01.h5"), folder / "S01.c3d")


def test_a_changed_subject_is_not_taken_for_the_one_in_the_file(folder):
    from dataclasses import replace

    from handclean.api.given import identity

    subject = hc.read_subject(folder / "S01.h5")
    same, other = replace(subject), replace(subject, name="S02")
    assert identity(subject) == subject.file_sha256
    assert len({identity(one) for one in (subject, same, other)}) == 3
    assert identity(same) == identity(replace(other, name="S01"))


def test_a_motion_is_a_table_of_pandas(folder):
    take, subject = hc.read(folder / "labelled.c3d"), hc.read_subject(folder / "S01.h5")
    motion = hc.solve(take, subject).motions["right"]
    table = motion.to_dataframe()
    assert len(table) == take.frames
    for d, name in enumerate(motion.names):
        np.testing.assert_array_equal(table[name], motion.angles[:, d])
    np.testing.assert_array_equal(table["translation_z"], motion.translation[:, 2])
    assert {"rotation_w", "trusted", "residual"} <= set(table.columns)


def test_without_pandas_a_table_is_an_error_that_says_so(monkeypatch):
    from handclean.recording import Motion

    monkeypatch.setitem(sys.modules, "pandas", None)
    motion = Motion(names=("a",), angles=np.zeros((2, 1)))
    with pytest.raises(hc.HandcleanError, match="needs pandas"):
        motion.to_dataframe()


def test_what_made_a_take_stands_beside_a_file_that_cannot_hold_it(folder):
    take, subject = hc.read(folder / "labelled.c3d"), hc.read_subject(folder / "S01.h5")
    made, place = hc.solve(take, subject), folder / "beside.c3d"
    record = folder / "beside.c3d.made.json"
    record.write_text("somebody's own")
    told = hc.write(made, place)
    assert any("kept as beside.c3d.made.json~" in one.text for one in told)
    assert (folder / "beside.c3d.made.json~").read_text() == "somebody's own"
    entry = json.loads(record.read_text())["provenance"][-1]
    again = hc.read(place)
    assert [one["command"] for one in again.provenance] == ["solve"]
    assert len(entry["warnings"]) == len(made.remarks) + len(told) - 1
    command(folder, "convert", "labelled.c3d", "-o", place.name)  # it is ours: replaced
    assert [one["command"] for one in hc.read(place).provenance] == ["convert"]
    hc.write(take, place)
    assert not record.exists(), "no step made it"
    assert hc.read(place).provenance == ()


def test_scans_and_sessions_with_a_glove_are_simulated(tmp_path):
    (scan,) = hc.simulate("scan", scan_points=2000, seed=2)
    assert scan.points.shape == scan.normals.shape == (len(scan.colors), 3)
    assert scan.subject.surface is not None
    (session,) = hc.simulate("glove", glove="generic5", donnings=1, duration_s=1.0)
    assert all(len(take.times) == len(take.angles) for take in session.takes)
    assert session.takes[0].readings.shape[1] == len(session.sensors) == 5
    (tmp_path / "my.toml").write_text("kind = 'scan'\nscan_points = 2000\nseed = 2\n")
    (same,) = hc.simulate(tmp_path / "my.toml")
    np.testing.assert_array_equal(same.points, scan.points)
    with pytest.raises(hc.HandcleanError, match="no glove is called 'generic'"):
        hc.simulate("glove", glove="generic")


def test_a_subject_says_what_made_it(tmp_path):
    given = {"marker_set": "maycock26", "rate_hz": 20.0, "ghosts_per_s": 0.0}
    (trial,) = hc.simulate("rom", **given)
    made = hc.calibrate_hand([trial.labelled], "maycock26", name="S01", frames=60)
    hc.write(made, tmp_path / "S01.h5")
    again = hc.read_subject(tmp_path / "S01.h5")
    (entry,) = again.provenance
    assert entry["command"] == "calibrate-hand markers"
    assert entry["settings"]["frames"] == 60
    assert entry["figures"]["heldout_rms_m"] == again.errors["heldout_rms_m"]
    hc.write(again, tmp_path / "copy.h5")
    assert hc.inspect(tmp_path / "copy.h5")["steps"] == ["calibrate-hand markers"]
