"""``pyproject.toml`` says what is true of the package."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
DECLARED = [re.match(r"[\w-]+", line)[0] for line in PROJECT["project"]["dependencies"]]


def imported(folder="handclean"):
    """Packages that modules of a folder import, wherever in the file."""
    found = set()
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(str(node.module).partition(".")[0])
    return found


@pytest.mark.parametrize("name", DECLARED)
def test_what_is_declared_is_imported(name):
    assert name in imported()


def test_the_lock_has_what_make_demo_installs():
    """It is given as a constraint, which says nothing of a package it does not name."""
    lines = (ROOT / "requirements-lock.txt").read_text().splitlines()
    locked = {line.partition("==")[0] for line in lines if "==" in line}
    assert {*DECLARED, "setuptools"} <= locked


def test_what_has_an_exception_or_is_named_exists():
    for pattern in PROJECT["tool"]["ruff"]["lint"]["per-file-ignores"]:
        assert any(ROOT.glob(pattern)), pattern
    named = re.findall(r"[\w/]+\.py\b", (ROOT / "pyproject.toml").read_text())
    for name in named:
        assert (ROOT / name).exists() or (ROOT / "handclean" / name).exists(), name


def test_only_io_imports_what_reads_formats_of_files():
    others = [path.name for path in (ROOT / "handclean").iterdir() if path.is_dir()]
    for name in set(others) - {"io"}:
        assert not imported(f"handclean/{name}") & {"h5py", "c3d", "trimesh"}, name


def test_one_module_imports_the_independent_witness():
    users = [
        path.name
        for path in (ROOT / "handclean").rglob("*.py")
        if re.search(r"^\s*(import|from) c3d\b", path.read_text(), re.MULTILINE)
    ]
    assert users == ["witness.py"]
