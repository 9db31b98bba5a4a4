"""A small step to run the machinery with, and a folder of inputs to run it on."""

import json
from pathlib import Path

import pytest

from handclean.runner import many
from handclean.runner.batch import Batch, Work


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to work in, from which the fake step can be imported."""
    monkeypatch.syspath_prepend(Path(__file__).parent / "fakes")
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

    def go(
        *paths, settings=None, seed=0, overwrite=False, suffixes=(".csv", ".h5"), **b
    ):
        batch = Batch(
            inputs=paths, seed=seed, overwrite=overwrite, **{"json": True, **b}
        )
        work = Work(
            command="tally",
            step="tally",
            settings=settings,
            seed=seed,
            overwrite=overwrite,
        )
        status = many.run(work, batch, suffixes)
        out, err = capfd.readouterr()
        lines = out.splitlines()
        return status, [json.loads(s) if batch.json else s for s in lines], err

    return go
