"""Machine code of kernels is kept in files that fit, and only those are loaded."""

import os
import pickle
import subprocess
import sys
import time
from pathlib import Path

import numba
import pytest

from handclean.commands.table import FIRST_RUN, compiling
from handclean.kernels import machine_code

SOLVE = """
import sys
from pathlib import Path
import numpy as np
import numba
from handclean.kernels import machine_code
machine_code.SEPARATE_BYTES = int(sys.argv[1])
machine_code.SHIPPED = Path(sys.argv[3])
for _ in range(int(sys.argv[2])):
    numba.njit(lambda x: x)(0)  # other numbers in the names of what comes
from handclean.kernels import linalg
rng = np.random.default_rng(0)
root = rng.normal(size=(5, 5))
square, vector = root @ root.T + np.eye(5), rng.normal(size=5)
assert linalg.solve(square.copy(), vector)
stats = [linalg.solve.stats, linalg.factor.stats, linalg.forward_vector.stats]
hits = sum(sum(s.cache_hits.values()) for s in stats)
misses = sum(sum(s.cache_misses.values()) for s in stats)
print(hits, misses, vector.tobytes().hex())
"""


def compiling_in(cache, **more):
    """Environment of a process that compiles, also where this one does not."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), **more}
    environment.pop("NUMBA_DISABLE_JIT", None)
    environment["PYTHONPATH"] = os.pathsep.join(sys.path)
    return environment


@pytest.fixture
def solved(tmp_path):
    """Solve equations in a new process; return loaded, compiled, and the result."""

    def run(separate=1, before=0, place=tmp_path / "cache", shipped="none", **more):
        env = compiling_in(place, **more)
        line = [sys.executable, "-c", SOLVE, str(separate), str(before), str(shipped)]
        done = subprocess.run(line, env=env, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert not done.stderr
        hits, misses, result = done.stdout.split()
        return int(hits), int(misses), result

    return run


def files(place, name=""):
    return sorted(place.rglob(f"{name}*.nbc"))


def test_a_second_process_loads_what_the_first_compiled(solved, tmp_path):
    first, second = solved(), solved()
    assert (first[:2], second[:2]) == ((0, 3), (3, 0))
    assert first[2] == second[2]
    assert not list(tmp_path.rglob("*.nbc.*"))


def test_kernels_compiled_by_themselves_give_the_same_bits_and_shorter_callers(
    solved, tmp_path
):
    apart = solved(separate=1, place=tmp_path / "apart")
    built_in = solved(separate=10**9, place=tmp_path / "built in")
    assert apart[2] == built_in[2]
    [short] = files(tmp_path / "apart", "solve")
    [long] = files(tmp_path / "built in", "solve")
    assert short.stat().st_size < 0.8 * long.stat().st_size


@pytest.mark.parametrize("lost", ["factor", "solve"])
def test_a_kernel_compiled_anew_goes_with_the_files_of_the_others(
    solved, tmp_path, lost
):
    first = solved()
    for file in files(tmp_path, lost):
        file.unlink()
    again = solved(before=3)
    assert again == (2, 1, first[2])
    assert solved()[:2] == (3, 0)


def test_a_damaged_file_is_not_loaded_and_is_written_anew(solved, tmp_path):
    first = solved()
    [file] = files(tmp_path, "solve")
    whole = file.read_bytes()
    for damaged in (
        whole[:1000],
        b"",
        whole[:-1] + bytes([whole[-1] ^ 1]),
        whole[:60] + bytes([whole[60] ^ 1]) + whole[61:],
    ):
        file.write_bytes(damaged)
        assert solved()[1] == 1
        assert solved() == (3, 0, first[2])


class Evil:
    """Writes a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def test_nothing_is_unpickled_that_its_digest_does_not_fit(solved, tmp_path):
    solved()
    [file] = files(tmp_path, "solve")
    head = file.read_bytes()[: len(machine_code._MAGIC) + 32]
    file.write_bytes(head + pickle.dumps(Evil(tmp_path / "executed")))
    assert solved()[1] == 1
    assert not (tmp_path / "executed").exists()


def test_a_folder_that_cannot_be_written_costs_only_time(solved, tmp_path):
    place = tmp_path / "a file"
    place.write_bytes(b"")
    assert solved(place=place)[:2] == (0, 3)
    assert place.read_bytes() == b""


def test_a_full_disk_leaves_nothing(tmp_path, monkeypatch):
    def full(path, *_):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="No space"):
        machine_code._write(tmp_path / "a" / "kernel.nbc", b"content")
    assert not list((tmp_path / "a").iterdir())


def test_two_processes_that_are_first_at_once_give_each_other_whole_files(
    solved, tmp_path
):
    env = compiling_in(tmp_path / "cache")
    begun = [
        subprocess.Popen(
            [sys.executable, "-c", SOLVE, "1", str(before), "none"],
            env=env,
            stdout=subprocess.PIPE,
            text=True,
        )
        for before in (0, 2)
    ]
    said = [process.communicate()[0].split() for process in begun]
    assert [process.returncode for process in begun] == [0, 0]
    assert {result for _, _, result in said} == {solved()[2]}
    assert sum(int(compiled) for _, compiled, _ in said) == 3  # none of them twice
    assert solved()[:2] == (3, 0)


def test_code_that_ships_is_for_any_processor_and_beats_the_cache(solved, tmp_path):
    shipped = tmp_path / "package"
    made = solved(place=shipped, NUMBA_CPU_NAME="generic")
    for path in (shipped, *shipped.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    loaded = solved(shipped=shipped)
    assert loaded == (3, 0, made[2])
    assert not files(tmp_path / "cache")


def test_damaged_code_that_ships_is_compiled_into_the_cache(solved, tmp_path):
    shipped = tmp_path / "package"
    made = solved(place=shipped, NUMBA_CPU_NAME="generic")
    [file] = files(shipped, "solve")
    damaged = bytearray(file.read_bytes())
    damaged[-9] ^= 4
    file.write_bytes(damaged)
    assert solved(shipped=shipped) == (2, 1, made[2])
    assert solved(shipped=shipped) == (3, 0, made[2])
    assert file.read_bytes() == damaged


HOLD = """
import sys
from pathlib import Path
from handclean.kernels import machine_code
assert not machine_code.Turns().take(Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.read()
"""


def test_another_process_is_waited_for_and_not_for_ever(tmp_path, monkeypatch):
    place, other = tmp_path / "a1" / "solve-b2.nbc", tmp_path / "a1" / "factor-c3.nbc"
    turns = machine_code.Turns()
    assert not turns.take(place)
    turns.give_back(place)
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(place)],
        env=compiling_in(tmp_path),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert holder.stdout.readline() == "held\n"
    assert not turns.take(other)
    monkeypatch.setattr(machine_code, "LONGEST_WAIT_S", 0.1)
    began = time.monotonic()
    assert turns.take(place)
    assert time.monotonic() - began >= 0.1
    monkeypatch.setattr(machine_code, "LONGEST_WAIT_S", 60.0)
    holder.communicate("")  # its end ends its turn
    assert not turns.take(place)


@pytest.fixture
def shipped(tmp_path, monkeypatch):
    """Say that machine code ships, made by some numba."""

    def made_by(text):
        (tmp_path / machine_code.MADE_BY).write_text(f"{text}\n")
        monkeypatch.setattr(machine_code, "SHIPPED", tmp_path)

    return made_by


def test_it_is_said_why_code_that_ships_is_not_used(shipped, monkeypatch):
    assert compiling() == f"compiling kernels ({FIRST_RUN}) ..."
    shipped(machine_code.maker())
    assert compiling() == f"compiling kernels ({FIRST_RUN}) ..."
    file = machine_code.SHIPPED / "a1" / "solve-b2.nbc"
    monkeypatch.setattr(machine_code, "_damaged", {file})
    told = f"{file}: does not fit its digest; install handclean anew"
    assert compiling() == f"compiling kernels ({told}) ..."
    shipped("numba 0.61.0, Python 3.11, x86_64")
    told = "the machine code that ships is made by numba 0.61.0, Python 3.11, x86_64, "
    told += f"and this is {machine_code.maker()}"
    assert compiling() == f"compiling kernels ({told}) ..."


def test_a_file_is_named_after_all_that_decides_its_code(monkeypatch):
    files = machine_code.KernelFiles(compiling_in)
    magic = ("x86_64-unknown-linux-gnu", "generic", "")
    types = (numba.int64,)
    places = {
        files._name(types, magic),
        files._name((numba.float64,), magic),
        files._name(types, ("x86_64-unknown-linux-gnu", "znver4", "")),
    }
    machine_code._compiler.cache_clear()
    monkeypatch.setattr(numba.config, "BOUNDSCHECK", int(not numba.config.BOUNDSCHECK))
    places.add(files._name(types, magic))
    machine_code._compiler.cache_clear()
    assert len(places) == 4


def test_a_change_in_an_imported_module_changes_the_digest(tmp_path, monkeypatch):
    package = tmp_path / "handclean"
    (package / "inner").mkdir(parents=True)
    for path, text in {
        "__init__.py": "",
        "inner/__init__.py": "",
        "inner/a.py": "from handclean.inner import (\n    b,\n)\n",
        "inner/b.py": "from handclean.inner.c import d\n",
        "inner/c.py": "d = 1\n",
        "inner/other.py": "",
    }.items():
        (package / path).write_text(text)
    monkeypatch.setattr(machine_code, "_PACKAGE", package)

    def digest():
        machine_code._source.cache_clear()
        machine_code.source_digest.cache_clear()
        return machine_code.source_digest(package / "inner" / "a.py")

    before = digest()
    (package / "inner" / "other.py").write_text("e = 2\n")
    assert digest() == before
    (package / "inner" / "c.py").write_text("d = 2\n")
    assert digest() != before
    machine_code._source.cache_clear()
    machine_code.source_digest.cache_clear()


LITERAL = """
import numba
from handclean.kernels import jit

@jit
def count(first):
    return first + 1

@jit
def count_all():
    t = 0
    while t < 10:
        t = count(t)
    return t

for kernel in (count, count_all):
    kernel._cache.disable()  # compiled here, and not loaded
assert count_all() == 10
assert list(count.overloads) == [(numba.int64,)]
"""


def test_a_variable_that_begins_at_a_literal_makes_no_further_variant(tmp_path):
    line = [sys.executable, "-c", LITERAL]
    done = subprocess.run(
        line, env=compiling_in(tmp_path), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_with_another_numba_kernels_are_kept_by_numba(tmp_path):
    other = SOLVE.replace(
        "machine_code.SEPARATE_BYTES", "machine_code.KNOWN = ()\nunused"
    )
    env = compiling_in(tmp_path)
    said = [
        subprocess.run(
            [sys.executable, "-c", other, "1", "0", "none"],
            env=env,
            capture_output=True,
            text=True,
        ).stdout.split()
        for _ in range(2)
    ]
    assert [int(loaded) for loaded, _, _ in said] == [0, 1]
    assert len({result for _, _, result in said}) == 1
    assert list(tmp_path.rglob("*.nbi"))
