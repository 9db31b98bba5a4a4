"""Warming leaves nothing to compile later."""

import json
import pkgutil
import re
import subprocess
import sys
from functools import partial
from importlib import import_module
from pathlib import Path

import pytest

import handclean
from handclean.cli.main import main
from handclean.commands.shared import kernels
from handclean.commands.shared.warming import FOR
from handclean.errors import HandcleanError
from handclean.labels.review.suppose import judge_path
from handclean.labels.track.frames import track_frames

SAMPLES = Path(__file__).parents[3] / "sample_sessions"

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


def in_a_process(*what):
    """What this file says of itself; alone, since other tests compile kernels, too."""
    line = [sys.executable, __file__, *what]
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


def after_warming_for_the_demo(folder):
    """Names of kernels that commands of the demo still load, or compile."""
    kernels.warm(commands=["calibrate-hand", "clean"])
    before = {k: len(k.signatures) for k in kernels.kernels()}
    subject, take = f"{folder}/S01.h5", SAMPLES / "S01_001_thumb_4_finger.c3d"
    rom = [SAMPLES / "S01_001_rom.c3d", "--marker-set", "maycock26", "-o", subject]
    clean = [take, "--subject", subject, "-o", f"{folder}/take.h5"]
    for words in (["calibrate-hand", "markers", *rom], ["clean", *clean]):
        assert main([str(word) for word in words]) == 0
    return [
        k.py_func.__name__
        for k in kernels.kernels()
        if len(k.signatures) > before.get(k, 0)
    ]


def test_what_the_demo_needs_first_is_compiled_alone(tmp_path):
    assert in_a_process("demo", str(tmp_path)) == []


def test_other_commands_need_parts_that_there_are(monkeypatch):
    done = []
    parts = {part: partial(done.append, part) for part in kernels.PARTS}
    monkeypatch.setattr(kernels, "PARTS", parts)
    for needed in FOR.values():
        assert set(needed) < set(parts)
    kernels.warm(commands=["calibrate-hand"])
    assert done == ["calibration"]
    done.clear()
    kernels.warm()
    assert done == list(parts)


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
    what, *given = sys.argv[1:]
    told = {
        "once": after_warming,
        "again": partial(kernels.warm, jobs=2),
        "demo": after_warming_for_the_demo,
    }
    print(json.dumps(told[what](*given)))
