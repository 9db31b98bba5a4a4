"""Files over which the HDF5 library hangs or dies, and the process that reads them."""

import os
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import psutil
import pytest
from processes import is_alive

from handclean.errors import FileError
from handclean.io.hdf5 import file as h5
from handclean.io.hdf5 import walker

ROOT = Path(__file__).parents[3]


def with_ring(path):
    """A file of readings with one damaged byte, over which HDF5 turns in a ring."""
    with h5py.File(path, "w", libver=("v110", "v110")) as file:
        file.attrs["format"] = "handclean glove readings"
        file["readings"] = np.ones((40, 3))
        file["sensors"] = ["index", "thumb", "wrist"]
    content = bytearray(path.read_bytes())
    heap = content.index(b"GCOL")
    at = heap + 16
    for _ in range(2):  # the third text
        (size,) = struct.unpack_from("<Q", content, at + 8)
        at += 16 + (size + 7) // 8 * 8
    assert struct.unpack_from("<H", content, at)[0] == 3
    content[at + 8] = 0  # its size
    path.write_bytes(content)
    return path


def plain(path):
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(3.0)
    return path


@pytest.fixture(autouse=True)
def fresh():
    """No process of another test."""
    walker.stop()
    walker._State.bad.clear()
    yield
    walker.stop()


def pid():
    return walker._State.child.process.pid


def test_a_ring_in_the_heap_of_texts_is_an_error(tmp_path):
    path = with_ring(tmp_path / "ring.h5")
    begun = time.process_time()
    with pytest.raises(FileError, match=r"ring.h5.*cannot be read") as caught:
        h5.read_some(path, ["sensors"])
    assert "\n" not in str(caught.value)
    assert time.process_time() - begun < 1.0, "nothing turns in this process"


def test_one_process_reads_all_files_until_one_makes_it_hang(tmp_path):
    good = plain(tmp_path / "good.h5")
    first = h5.read_some(good, ["x"])
    one = pid()
    for _ in range(5):
        h5.read_some(good, ["x"])
        with pytest.raises(FileError):
            h5.read_some(ROOT / "README.md", ["x"])
    assert pid() == one, "a file that is none is no reason to start anew"
    with pytest.raises(FileError):
        h5.read_some(with_ring(tmp_path / "ring.h5"), ["sensors"])
    again = h5.read_some(good, ["x"])
    assert pid() != one
    np.testing.assert_array_equal(first.items["x"].values, again.items["x"].values)


def test_a_file_over_which_it_hung_is_not_tried_again_as_it_is(tmp_path):
    path = with_ring(tmp_path / "ring.h5")
    for _ in range(3):
        with pytest.raises(FileError, match="HDF5 does not come to an end"):
            h5.read_some(path, ["sensors"])
    assert walker._State.child is None, "the second try started none"
    plain(path)
    assert h5.read_some(path, ["x"]).has("x")


@pytest.mark.parametrize(
    ("code", "says"),
    [
        ("import time; time.sleep(1e6)", "does not come to an end in 1 s"),
        ("import os; os.abort()", "breaks down over it"),
        ("import os; os.kill(os.getpid(), 9)", "want of memory"),
    ],
)
def test_a_process_that_hangs_or_dies_is_an_error(tmp_path, monkeypatch, code, says):
    path = plain(tmp_path / "good.h5")
    monkeypatch.setattr(walker, "LIMIT_S", 1.0)
    monkeypatch.setattr(walker, "_START_S", 1.0)
    with monkeypatch.context() as patch:
        patch.setattr(walker, "_CODE", code)
        with pytest.raises(FileError, match=says):
            h5.read_some(path, ["x"])
    walker._State.bad.clear()
    monkeypatch.setattr(walker, "_START_S", 60.0)
    monkeypatch.setattr(walker, "LIMIT_S", 20.0)
    assert h5.read_some(path, ["x"]).has("x")


def test_a_process_that_was_killed_meanwhile_is_replaced(tmp_path):
    path = plain(tmp_path / "good.h5")
    h5.read_some(path, ["x"])
    os.kill(pid(), signal.SIGKILL)
    assert h5.read_some(path, ["x"]).has("x")


SPINNING = (
    "import sys, json; parent, sys.path[:] = json.loads(sys.stdin.buffer.readline()); "
    "from handclean.io.hdf5 import serve; serve._end_with(parent)\n"
    "while True: pass"
)


def command(path):
    """A command whose HDF5 turns in a ring, deaf to signals."""
    code = (
        "import sys; from handclean.io.hdf5 import walker; "
        f"walker._CODE = {SPINNING!r}; "
        "from handclean.cli.main import main; "
        f"sys.exit(main(['inspect', {str(path)!r}]))"
    )
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-c", code], env=env, stderr=subprocess.PIPE, text=True
    )


def spinning(process):
    """Wait until the command's own process turns in its ring."""
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        for one in psutil.Process(process.pid).children():
            if sum(one.cpu_times()[:2]) > 0.6:  # [s]
                return one
        time.sleep(0.05)
    raise AssertionError("it never began")


def is_gone(one):
    end = time.monotonic() + 10.0
    while time.monotonic() < end:
        if not is_alive(one.pid):
            return True
        time.sleep(0.05)
    return False


@pytest.mark.parametrize(
    ("signum", "status"),
    [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGKILL, -9)],
)
def test_a_signal_ends_a_command_at_once_and_leaves_nothing(tmp_path, signum, status):
    process = command(plain(tmp_path / "a.h5"))
    one = spinning(process)
    begun = time.monotonic()
    process.send_signal(signum)
    _, err = process.communicate(timeout=30)
    assert process.returncode == status
    assert time.monotonic() - begun < 5.0, "it takes a fraction of a second"
    assert len(err.splitlines()) == (signum != signal.SIGKILL)
    assert is_gone(one)
