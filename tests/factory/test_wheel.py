"""A wheel with machine code inside is a right wheel; with it nothing is compiled."""

import base64
import csv
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from email import message_from_bytes
from pathlib import Path

import numba
import pytest

from handclean.factory import wheel
from handclean.kernels import machine_code

ROOT = Path(__file__).parents[2]
METADATA = """Metadata-Version: 2.4
Name: handclean
Version: 7.0
Requires-Dist: numpy>=2.0
Requires-Dist: numba>=0.60
Requires-Dist: numbagg; extra == "more"
"""


def plain_wheel(folder, metadata=METADATA):
    """Write a wheel as setuptools would, with one module."""
    inside = {
        "handclean/__init__.py": b"",
        "handclean-7.0.dist-info/METADATA": metadata.encode(),
        "handclean-7.0.dist-info/WHEEL": b"Wheel-Version: 1.0\n"
        b"Generator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    path = folder / "handclean-7.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as packed:
        for name, content in inside.items():
            packed.writestr(name, content)
        record = [f"{n},sha256={digest(c)},{len(c)}" for n, c in inside.items()]
        record.append("handclean-7.0.dist-info/RECORD,,")
        packed.writestr("handclean-7.0.dist-info/RECORD", "\n".join(record) + "\n")
    return path


def digest(content):
    said = base64.urlsafe_b64encode(hashlib.sha256(content).digest())
    return said.rstrip(b"=").decode()


@pytest.fixture
def code(tmp_path):
    folder = tmp_path / "code"
    (folder / "a1").mkdir(parents=True)
    (folder / "a1" / "solve-b2.nbc").write_bytes(b"machine code")
    (folder / machine_code.MADE_BY).write_text(machine_code.maker())
    return folder


def test_the_wheel_holds_the_code_asks_for_its_numba_and_is_for_this_python(
    tmp_path, code
):
    made = wheel.with_machine_code(plain_wheel(tmp_path), code, tmp_path / "a dist")
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = re.sub(r"[-.]", "_", sysconfig.get_platform())
    assert made.name == f"handclean-7.0-{python}-{python}-{platform}.whl"
    with zipfile.ZipFile(made) as packed:
        inside = {name: packed.read(name) for name in packed.namelist()}
    assert inside["handclean/data/machine_code/a1/solve-b2.nbc"] == b"machine code"
    said = message_from_bytes(inside["handclean-7.0.dist-info/METADATA"])
    assert said.get_all("Requires-Dist") == [
        "numpy>=2.0",
        f"numba=={numba.__version__}",
        'numbagg; extra == "more"',
    ]
    record = list(
        csv.reader(io.StringIO(inside["handclean-7.0.dist-info/RECORD"].decode()))
    )
    assert {name for name, _, _ in record} == set(inside)
    for name, said_digest, size in record:
        if said_digest:
            assert said_digest == f"sha256={digest(inside[name])}"
            assert int(size) == len(inside[name])


def test_a_wheel_that_asks_for_no_numba_is_refused(tmp_path, code):
    path = plain_wheel(tmp_path, METADATA.replace("numba>=0.60", "other"))
    with pytest.raises(ValueError, match="should ask for numba once, and does 0 times"):
        wheel.with_machine_code(path, code, tmp_path / "dist")
    assert not (tmp_path / "dist").exists()


@pytest.mark.slow
def test_nothing_is_compiled_where_the_wheel_is_installed(tmp_path):
    pytest.importorskip("setuptools")
    tree, code = tmp_path / "the tree", tmp_path / "code"
    left = shutil.ignore_patterns(".git", ".venv", "build", "dist", "*.egg-info")
    shutil.copytree(ROOT, tree, ignore=left)
    build = "import sys; sys.path.insert(0, '.ci'); import build_backend as b; "
    subprocess.run(
        [sys.executable, "-c", build + "b.build_wheel('out')"], cwd=tree, check=True
    )
    [plain] = (tree / "out").iterdir()
    wheel.compile_generic(code)
    made = wheel.with_machine_code(plain, code, tmp_path / "dist")
    assert made.stat().st_size < 20e6
    installed = tmp_path / "installed"
    with zipfile.ZipFile(made) as packed:
        packed.extractall(installed)
    home = tmp_path / "home"
    environment = {**os.environ, "PYTHONPATH": str(installed), "HOME": str(home)}
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        environment.pop(name, None)
    samples = tree / "sample_sessions"
    for command, take in (
        ("clean", "S01_001_thumb_4_finger.c3d"),
        ("solve", "S01_001_thumb_4_finger.labelled.c3d"),
    ):
        line = [sys.executable, "-m", "handclean", command, samples / take]
        line += ["-o", tmp_path / f"{command}.h5"]
        line += ["--subject", samples / "S01.subject.h5"]
        done = subprocess.run(
            line,
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        assert "compiling" not in done.stderr
    assert not home.exists()
