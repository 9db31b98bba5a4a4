"""The source distribution has all that `make test` needs."""

import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LEFT = (
    ".git", ".venv", "*.egg-info", "__pycache__", "*.nbi", "*.nbc", ".pytest_cache",
    ".mypy_cache", ".ruff_cache", ".hypothesis", "build", "dist", "demo_out", ".peers",
    "peers", "PKG-INFO", "setup.cfg", ".RESULTS*",
)  # fmt: skip
"""What tools leave in the folder, and what a distribution adds."""


def files(folder):
    return {
        str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()
    }


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """(the tree, the distribution made of it, unpacked)."""
    pytest.importorskip("setuptools")
    place = tmp_path_factory.mktemp("a place")
    tree = place / "the tree"
    shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(*LEFT))
    known = files(tree)
    subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; sys.path.insert(0, '.ci'); import build_backend as b; "
            "b.build_sdist('out')",
        ],
        cwd=tree,
        capture_output=True,
        check=True,
    )
    (archive,) = (tree / "out").iterdir()
    with tarfile.open(archive) as packed:
        packed.extractall(place / "unpacked", filter="data")
    (inside,) = (place / "unpacked").iterdir()
    return known, inside


def test_a_source_distribution_has_every_file(unpacked):
    known, inside = unpacked
    assert {"Makefile", "requirements-lock.txt", "configs/default.toml"} <= known
    assert {".ci/build_backend.py", ".ci/run"} <= known
    assert {"tests/conftest.py", "sample_sessions/S01.subject.h5"} <= known
    assert known - files(inside) == set()


def test_it_has_nothing_that_is_made_by_running(unpacked):
    _, inside = unpacked
    made = [n for n in files(inside) if n.endswith((".pyc", ".nbi", ".nbc"))]
    assert made == []


def test_its_tests_are_found(unpacked):
    _, inside = unpacked
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "--collect-only",
            "-p",
            "no:cacheprovider",
        ],
        cwd=inside,
        capture_output=True,
        text=True,
        check=False,
        env={"PYTHONPATH": str(inside), "PATH": "/usr/bin:/bin"},
    )
    assert done.returncode == 0, done.stdout[-2000:]
