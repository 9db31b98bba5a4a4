"""A small step to run the machinery with, and a folder of inputs to run it on."""

import json
import sys
from pathlib import Path

import pytest

from handclean.runner import many
from handclean.runner.batch import Batch
from handclean.runner.command import Work

sys.path.insert(0, str(Path(__file__).parent / "fakes"))

import boxes


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to work in, from which the fake step can be imported."""
    monkeypatch.delenv("SLURM_CPUS_PER_TASK", raising=False)
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def inputs(folder):
    """Write inputs; return their relative paths."""

    def write(**texts):
        paths = []
        for name, text in texts.items():
            path = Path("in", *name.split("__")).with_suffix(".txt")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            paths.append(path)
        return tuple(paths)

    return write


@pytest.fixture
def run(capfd):
    """Run the fake step; return the exit status, the JSON objects, and stderr."""

    def go(*paths, settings=None, command=None, **options):
        batch = Batch(inputs=paths, **{"json": True, **options})
        work = Work.of(command or boxes.tally(), batch, settings)
        status = many.run(work, batch)
        out, err = capfd.readouterr()
        lines = out.splitlines()
        return status, [json.loads(s) if batch.json else s for s in lines], err

    return go
