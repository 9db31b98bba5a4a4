"""Every block of the README runs as it stands, in a new folder with a space."""

import os
import re
import shutil
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.template import template
from handclean.io.landmarks import read_landmarks
from handclean.kernels import cache_directory

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```", README, re.DOTALL | re.MULTILINE)
FAILURES = """
trap 'echo "failed with $?: $BASH_COMMAND" >&3' ERR
"""
FAILS = {
    # one of the raw takes is no C3D, so that there is something in the list
    "clean raw/*/*.c3d": 1,
    "clean --manifest failed.csv": 1,
    "inspect --manifest - --json": 1,
    "solve --manifest -": 1,
}
"""Lines that should fail, by what they have, and how."""


def of(*languages):
    return [text for language, text in BLOCKS if language in languages]


def raw(folder):
    for name in ("raw/t1.c3d", "raw/S01/t1.c3d", "raw/S01/t2.c3d"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(folder / "take_07.c3d", folder / name)
    (folder / "raw/S01/t3.c3d").write_bytes(b"no C3D")


def manifest(folder):
    takes = "input,subject\ntake_07.c3d,S01.h5\n"
    (folder / "takes.csv").write_text(takes)


def table(folder):
    rng = np.random.default_rng(0)
    names = ["frame", *(f"R_INDEX_TIP_{axis}" for axis in "xyz")]
    rows = [
        f"{n},{','.join(f'{v:.2f}' for v in rng.normal(300, 9, 3))}" for n in range(99)
    ]
    (folder / "take_07.csv").write_text("\n".join([",".join(names), *rows, ""]))
    whole = (folder / "take_07.c3d").read_bytes()
    (folder / "cut_off.c3d").write_bytes(whole[: len(whole) * 4 // 5])


def rigged(folder):
    beside = Path(__file__).parents[2] / "shared" / "data"
    data = Path(os.environ.get("HANDCLEAN_DATA", beside))
    hand = data / "webxr_hand" / "right.glb"
    if not hand.is_file():
        pytest.skip(f"no {hand}; all blocks before this one ran")
    shutil.copy(hand, folder / "hand.glb")


GIVEN = {
    "clean raw/*/*.c3d": raw,
    "--manifest takes.csv": manifest,
    "take_07.csv": table,
    "hand.glb": rigged,
}
"""What the reader has, by what a block needs of it."""


def program(folder, name, text):
    path = folder / name
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.fixture
def place(tmp_path):
    """(a new folder, the environment of a reader who has installed handclean)."""
    folder, programs = tmp_path / "a new folder", tmp_path / "bin"
    folder.mkdir()
    programs.mkdir()
    program(programs, "handclean", f'exec "{sys.executable}" -m handclean "$@"')
    program(programs, "srun", 'exec "$@"')
    environment = {
        **os.environ,
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "SLURM_ARRAY_TASK_ID": "1",
        "TMPDIR": str(cache_directory()),
    }
    environment.pop("SLURM_CPUS_PER_TASK", None)
    return folder, environment


def run(text, folder, environment):
    """Run a block; the lines that failed, and all it said."""
    read, write = os.pipe()
    with open(read) as told:
        done = subprocess.run(
            ["bash", "-c", f"exec 3>&{write}\n{FAILURES}\n{text}"],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            pass_fds=(write,),
            check=False,
        )
        os.close(write)
        return told.read().splitlines(), done.stdout


def as_expected(line):
    return any(
        part in line and line.startswith(f"failed with {status}:")
        for part, status in FAILS.items()
    )


@pytest.mark.slow
def test_every_block_runs_in_order_in_a_new_folder(place):
    folder, environment = place
    for text in of("sh"):
        if text.startswith("make demo"):
            continue  # of the project's folder: the test below
        for part, give in GIVEN.items():
            if part in text:
                give(folder)
        failed, said = run(text, folder, environment)
        assert [line for line in failed if not as_expected(line)] == [], said
        should = {part for part in FAILS if part in text}
        assert len(failed) == len(should), f"should have failed: {text}"


@pytest.mark.slow
def test_the_rule_for_make_runs(place):
    folder, environment = place
    (text,) = of("make")
    (folder / "Makefile").write_text(text)
    samples = ROOT / "sample_sessions"
    shutil.copy(samples / "S01_001_thumb_4_finger.c3d", folder / "take_07.c3d")
    shutil.copy(samples / "S01.subject.h5", folder / "S01.h5")
    failed, said = run("make take_07.h5", folder, environment)
    assert failed == [], said
    assert (folder / "take_07.h5").is_file()


@pytest.mark.slow
def test_the_example_in_python_runs(place):
    folder, environment = place
    samples = ROOT / "sample_sessions"
    shutil.copy(samples / "S01_001_thumb_4_finger.c3d", folder / "take_07.c3d")
    shutil.copy(samples / "S01_001_rom.c3d", folder / "rom.c3d")
    (text,) = of("python")
    run = [sys.executable, "-c", text]
    subprocess.run(run, cwd=folder, env=environment, check=True)
    assert (folder / "take_07.clean.h5").is_file()


@pytest.mark.slow
def test_make_demo_runs_in_a_folder_with_a_space(place, tmp_path):
    """``make test``, the line after it, is what runs these tests."""
    _, environment = place
    copy = tmp_path / "the project"
    left = shutil.ignore_patterns(".git", ".venv", "__pycache__", ".*_cache", "tests")
    shutil.copytree(ROOT, copy, ignore=left)
    python = copy / ".venv" / "bin"
    python.mkdir(parents=True)
    program(python, "python", f'exec "{sys.executable}" "$@"')
    (copy / ".venv" / "ready").write_text(f"{copy}\n")
    assert of("sh")[0].startswith("make demo")
    failed, said = run("make demo", copy, environment)
    assert failed == [], said
    assert "compiled" in said
    assert len(list((copy / "demo_out").glob("*.h5"))) >= 6


@pytest.mark.parametrize(
    "language", ["sh", "make", "python", "py", "toml", "bash", "zsh", "fish", ""]
)
def test_every_kind_of_block_is_run_somewhere(language):
    """Those of shells by `cli/test_completion`; the plan of floors is no command.

    What is called "py" needs a Slurm cluster; see below.
    """
    assert {language for language, _ in BLOCKS} <= {
        "sh", "make", "python", "py", "toml", "bash", "zsh", "fish", "",
    }  # fmt: skip
    assert of(language)


def test_the_example_of_a_cluster_gives_its_address_to_a_command(monkeypatch):
    """With a cluster that is none: what it is asked for, and what is run then."""
    asked, ran = [], []

    class Cluster(nullcontext):
        scheduler_address = "tcp://there:8786"

        def __init__(self, **settings):
            super().__init__(self)
            asked.append(settings["cores"])

        def scale(self, jobs):
            asked.append(jobs)

    fake = SimpleNamespace(SLURMCluster=Cluster)
    monkeypatch.setitem(sys.modules, "dask_jobqueue", fake)
    monkeypatch.setattr(subprocess, "run", ran.append)
    (text,) = of("py")
    exec(compile(text, "README.md", "exec"), {})
    assert asked == [8, 20]
    [line] = ran
    assert line[:2] == ["handclean", "clean"]
    assert line[line.index("--scheduler") + 1] == "tcp://there:8786"


def test_blocks_of_toml_are_read(tmp_path):
    places, landmarks = of("toml")
    (tmp_path / "mine.toml").write_text(places)
    model = load_marker_set(str(tmp_path / "mine.toml")).on(template("right"))
    assert model.labels == ("R_INDEX_TIP",)
    (tmp_path / "hand.toml").write_text(landmarks)
    assert set(read_landmarks(tmp_path / "hand.toml", "mm")) == {
        "thumb_tip",
        "index_tip",
        "index_knuckle",
    }
