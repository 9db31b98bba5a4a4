"""Command lines, run as their users do: in a process of their own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parent / "program.py"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, with a space and an umlaut in its name."""
    path = tmp_path / "with späce"
    path.mkdir()
    monkeypatch.chdir(path)
    for name in ("SLURM_CPUS_PER_TASK", "SOURCE_DATE_EPOCH"):
        monkeypatch.delenv(name, raising=False)
    return path


@pytest.fixture
def handclean(folder):
    """Run ``handclean ...``; return what `subprocess.run` returns."""

    def run(*arguments, **options):
        line = [sys.executable, "-m", "handclean", *map(str, arguments)]
        return subprocess.run(line, capture_output=True, text=True, **options)

    return run


@pytest.fixture
def program(folder):
    """Start ``handclean`` that has one more command, ``tally``.

    A test that gives up leaves no process and no open pipe behind: the warnings of
    those would fail whichever test runs when they are collected as garbage.
    """
    started = []

    def start(*arguments, **options):
        process = subprocess.Popen(
            [sys.executable, str(PROGRAM), *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, **options.pop("env", {})},
            **options,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        for pipe in (process.stdout, process.stderr):
            pipe.close()
        process.wait()


@pytest.fixture
def write():
    """Write text files; return their names."""

    def go(**texts):
        for name, text in texts.items():
            Path(f"{name}.txt").write_text(text)
        return [f"{name}.txt" for name in texts]

    return go
