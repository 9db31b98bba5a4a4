"""All kernels with every index checked, on small things and large ones.

numba checks indices where ``NUMBA_BOUNDSCHECK`` is set, but takes machine code from its
cache as it is. So the check runs in a process of its own with an empty cache, and a
kernel known to be wrong says that it is on.
"""

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from handclean.arrays import Floats
from handclean.kernels import jit

TESTS = Path(__file__).parents[1]

CHECKED = ("kernels", "numerics", "labels/test_trees.py")
"""Where kernels are called; ``trees.KINDS`` says on what."""

WRONG = "test_a_kernel_known_to_be_wrong_is_found"


@jit
def write_behind(room: Floats) -> None:
    """Write behind the end, on purpose."""
    room[room.shape[0]] = 1.0


def test_a_kernel_known_to_be_wrong_is_found(tmp_path):
    """Here if indices are checked in this process, else in one where they are."""
    if "NUMBA_BOUNDSCHECK" in os.environ or numba.config.DISABLE_JIT:
        with pytest.raises(IndexError):
            write_behind(np.zeros(3))
    else:
        done = checked_run(tmp_path, f"{__file__}::{WRONG}")
        assert done.returncode == 0, done.stdout[-4000:]
        assert f"{WRONG} PASSED" in done.stdout


def checked_run(cache, *parts):
    """Run tests in a process whose kernels check indices, with a cache of its own."""
    checked = {
        **os.environ,
        "NUMBA_BOUNDSCHECK": "1",
        "NUMBA_CACHE_DIR": str(cache),
        "PYTHONPATH": os.pathsep.join([str(TESTS.parent), *sys.path]),
    }
    checked.pop("NUMBA_DISABLE_JIT", None)
    line = [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider"]
    return subprocess.run(
        [*line, "-m", "not slow and not bench", *parts],
        env=checked,
        cwd=TESTS.parent,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_no_kernel_reaches_beyond_an_array(tmp_path):
    done = checked_run(tmp_path, *(str(TESTS / part) for part in CHECKED))
    assert done.returncode == 0, done.stdout[-4000:]
    assert f"{WRONG} PASSED" in done.stdout
