"""The Makefile and the Snakefile of a data set, in ``configs/``, do what they say."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from handclean import config
from handclean.cli import tables

ROOT = Path(__file__).parents[1]
CONFIGS = ROOT / "configs"
SAMPLES = ROOT / "sample_sessions"
PRESETS = sorted(path.stem for path in CONFIGS.glob("*.toml") if path.stem != "default")
TAKE = "S01_001_thumb_4_finger"


@pytest.fixture
def data_set(tmp_path, monkeypatch):
    """A data set of one subject and one take, and handclean as a program."""
    folder = tmp_path / "with a space"
    for name, place in (
        (f"{TAKE}.c3d", "raw/S01/t1.c3d"),
        ("S01_001_rom.c3d", "raw/S01/rom.c3d"),
        (f"{TAKE}.labelled.c3d", "labelled/S01/t1.c3d"),
    ):
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(SAMPLES / name, folder / place)
    for path in CONFIGS.iterdir():
        shutil.copy(path, folder / path.name)
    program = tmp_path / "bin" / "handclean"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m handclean "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    for name in ("MAKEFLAGS", "MAKELEVEL"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(folder)
    return folder


def run(*words):
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def expect_cleaned():
    assert Path("subjects/S01.h5").is_file()
    assert Path("clean/S01/t1.h5").is_file()
    compared = json.loads(Path("compare/S01/t1.json").read_text())
    assert compared["status"] == "done"
    assert compared["f1"] > 0.99


def test_the_makefile_cleans_a_data_set_once(data_set):
    status, said = run("make", "-j", "2")
    assert status == 0, said
    expect_cleaned()
    assert "--config strict.toml" in said
    assert run("make", "-q")[0] == 0
    Path("raw/S01/t1.c3d").touch()
    status, said = run("make")
    assert (status, "skipped, as before" in said) == (0, True), said
    assert "calibrate-hand" not in said
    assert run("make", "-q")[0] == 0


def test_the_makefile_says_which_take_failed(data_set):
    Path("raw/S01/t1.c3d").write_text("no C3D")
    status, said = run("make", "-k", "subjects/S01.h5", "clean/S01/t1.h5")
    assert status == 2
    assert "raw/S01/t1.c3d: " in said
    assert Path("subjects/S01.h5").is_file()
    assert not Path("clean").exists()


def test_the_makefile_applies_the_calibration_of_a_glove(data_set):
    Path("glove/S01").mkdir(parents=True)
    for name in ("glove/S01.h5", "glove/S01/day1.csv"):
        Path(name).write_text("")
    _, said = run("make", "-n", "angles/S01/day1.h5")
    said = " ".join(said.replace("\\\n", " ").split())
    assert said.endswith(
        "handclean calibrate-glove apply glove/S01/day1.csv -o angles/S01/day1.h5 "
        "--calibration glove/S01.h5 --config glove.toml"
    )


def test_the_snakefile_cleans_a_data_set_once(data_set):
    snakemake = shutil.which("snakemake")
    if snakemake is None:
        pytest.skip("snakemake is not there")
    status, said = run(snakemake, "--cores", "2")
    assert status == 0, said
    expect_cleaned()
    status, said = run(snakemake, "--cores", "2")
    assert (status, "Nothing to be done" in said) == (0, True), said


def test_takes_are_cleaned_by_the_rule_for_many(data_set):
    """The one command that the Makefile names for thousands of takes."""
    (line,) = (
        line.strip("# ")
        for line in Path("Makefile").read_text().splitlines()
        if "--recursive" in line
    )
    assert run("make", "subjects/S01.h5")[0] == 0
    Path("raw/S01/rom.c3d").unlink()
    status, said = run("sh", "-c", line)
    assert status == 0, said
    assert Path("clean/S01/t1.h5").is_file()


def test_commands_hand_their_takes_on_as_json(data_set):
    Path("raw/S01/t2.c3d").write_text("no C3D")
    shutil.copy(SAMPLES / "S01.subject.h5", "raw/S01/subject.h5")
    Path("raw/S01/rom.c3d").unlink()
    chain = (
        "handclean label raw --recursive --subject-for '{parent}/subject.h5' "
        "-o labels --json | handclean solve --manifest - --json --failed failed.csv "
        "--subject-for 'raw/{parent.name}/subject.h5' -o angles > told.jsonl"
    )
    status, said = run("bash", "-c", chain)
    assert status == 1, said
    first, second = map(json.loads, Path("told.jsonl").read_text().splitlines())
    assert (first["status"], first["output"]) == ("done", "angles/t1.h5")
    assert (second["status"], second["input"]) == ("failed", "labels/S01/t2.h5")
    assert "raw/S01/t2.c3d" in second["error"]
    assert "labels/S01/t2.h5" in Path("failed.csv").read_text()


def test_presets_are_there():
    assert PRESETS == ["few_markers", "glove", "strict"]


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_changes_known_settings_and_says_why(name):
    path = CONFIGS / f"{name}.toml"
    classes = tables.classes()
    config.check(path, classes)
    lines = path.read_text().splitlines()
    changed = [i for i, line in enumerate(lines) if " = " in line and line[0] != "#"]
    assert changed
    for i in changed:
        assert lines[i - 1].startswith("# "), f"{name}: why {lines[i]}?"
    table = ""
    for line in lines:
        if line.startswith("["):
            table = line.strip("[]")
        elif " = " in line and line[0] != "#":
            key = line.split(" = ")[0]
            loaded = config.load(path, table, classes[table])
            assert getattr(loaded, key) != getattr(classes[table](), key), line
