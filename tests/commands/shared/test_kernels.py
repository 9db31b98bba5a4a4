"""Warming leaves nothing to compile later."""

import json
import pkgutil
import re
import subprocess
import sys
from importlib import import_module

import pytest

import handclean
from handclean.commands.shared import kernels
from handclean.errors import HandcleanError
from handclean.labels.review.suppose import judge_path
from handclean.labels.track.frames import track_frames

UNUSED = {
    "handclean.kernels.rotations.quaternion_from_matrix",
    "handclean.kernels.rotations.logarithm",
}
"""Kernels that no command calls (they complete the maps of their module)."""

BY_HAND = (track_frames, judge_path)
"""Kernels that some part calls with what it set out itself, as labelling would."""


def everything():
    """Import every module of the package."""
    for module in pkgutil.walk_packages(handclean.__path__, "handclean."):
        if not module.name.endswith("__main__"):
            import_module(module.name)


def called_by(kernel):
    """Kernels that a kernel calls, and those that they call."""
    found, new = set(), {kernel}
    while new:
        found |= new
        functions = [k.py_func for k in new]
        named = {f.__globals__.get(n) for f in functions for n in f.__code__.co_names}
        new = {n for n in named if hasattr(n, "nopython_signatures")} - found
    return found


def in_a_process(what):
    """What this file says of itself; alone, since other tests compile kernels, too."""
    line = [sys.executable, __file__, what]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def after_warming():
    """Names of kernels that warming leaves, and how often those of `BY_HAND` are."""
    everything()
    kernels.warm()
    known = list(kernels.kernels())
    reached = {k for kernel in known if kernel.signatures for k in called_by(kernel)}
    left = {
        f"{k.py_func.__module__}.{k.py_func.__name__}" for k in set(known) - reached
    }
    return sorted(left), [len(kernel.signatures) for kernel in BY_HAND]


def test_warming_leaves_no_kernel_uncompiled():
    left, signatures = in_a_process("once")
    assert set(left) == UNUSED, "a part in commands/shared/kernels.py should reach them"
    assert signatures == [1, 1]
    again = in_a_process("again")
    assert again["compiled"] == 0
    assert again["loaded"] > 10


def test_processes_do_every_part_but_the_last_and_tell_what_they_compiled(
    tmp_path, monkeypatch
):
    done = []
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    parts = {"skin": kernels.skin, "chain": lambda: done.append("chain")}
    monkeypatch.setattr(kernels, "PARTS", parts)
    told = []
    assert kernels.warm(2, told.append)["compiled"] > 0
    assert done == ["chain"]
    [text] = told
    assert re.fullmatch(r"1 of 2: skin, [1-9]\d* compiled, \d+ loaded", text)
    again = []
    kernels.warm(2, again.append)
    assert again == []


def test_a_process_that_fails_is_one_error(monkeypatch):
    monkeypatch.setattr(kernels, "PARTS", {"none": None, "such": None})
    with pytest.raises(HandcleanError, match="internal error, please report it"):
        kernels.warm(jobs=2)


if __name__ == "__main__":
    done = after_warming() if sys.argv[1] == "once" else kernels.warm(jobs=2)
    print(json.dumps(done))
