"""Command lines, run as their users do: in a process of their own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from processes import processes

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
    """Start ``handclean`` that has one more command, ``tally``."""
    with processes() as start:

        def go(*arguments, env=None, **options):
            environment = {**os.environ, **(env or {})}
            return start(
                [sys.executable, PROGRAM, *arguments], env=environment, **options
            )

        yield go


@pytest.fixture
def write():
    """Write text files; return their names."""

    def go(**texts):
        for name, text in texts.items():
            Path(f"{name}.txt").write_text(text)
        return [f"{name}.txt" for name in texts]

    return go
