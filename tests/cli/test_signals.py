"""An interrupted run exits with 128 + the signal and leaves nothing half-written."""

import csv
import os
import signal
import time
from pathlib import Path

import pytest

PATIENCE = 300
"""[s] after which a process counts as stuck, on a machine that has much else to do."""


def wait_for(path, process):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if path.exists() and path.stat().st_size:
            return
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    process.kill()
    pytest.fail(f"{path} never appeared")


def files():
    return sorted(str(path) for path in Path().rglob("*") if path.is_file())


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_lone_input_leaves_nothing_half_written(program, write, number):
    process = program("tally", *write(a="linger started"), "-o", "new/a.csv")
    wait_for(Path("started"), process)
    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + number
    assert (out, err) == ("", f"interrupted by {number.name}\n")
    assert files() == ["a.txt", "started"]


@pytest.mark.parametrize("how", ["change", "hide"])
def test_a_signal_that_a_compiler_swallows_ends_the_run(program, write, how):
    process = program("tally", *write(a=f"swallow {how}"), "-o", "a.csv")
    _, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err) == (143, "interrupted by SIGTERM\n")


@pytest.mark.parametrize("to_all", [False, True], ids=["command", "whole group"])
def test_workers_leave_nothing_half_written(program, write, to_all):
    names = write(a="one", b="linger started", c="linger started2", d="one")
    process = program(
        "tally", *names, "-o", "out", "--format", "csv", "-j2", "--failed", "f.csv",
        start_new_session=True,
    )  # fmt: skip
    for name in ("started", "started2"):
        wait_for(Path(name), process)
    (os.killpg if to_all else os.kill)(process.pid, signal.SIGTERM)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 143
    assert out == "a.txt -> out/a.csv: 1 words\n"
    assert err == "interrupted by SIGTERM\n"
    assert files() == [
        "a.txt", "b.txt", "c.txt", "d.txt", "f.csv", "out/a.csv",
        "out/a.csv.made.json", "started", "started2",
    ]  # fmt: skip
    rows = csv.DictReader(Path("f.csv").read_text().splitlines())
    assert [row["input"] for row in rows] == ["b.txt", "c.txt", "d.txt"]
    for worker in ("started", "started2"):  # none lives on
        with pytest.raises(ProcessLookupError):
            os.kill(int(Path(worker).read_text()), 0)


def test_a_signal_that_is_ignored_stays_ignored(program, write):
    process = program(
        "tally", *write(a="until go started"), "-o", "a.csv",
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )  # fmt: skip
    wait_for(Path("started"), process)
    process.send_signal(signal.SIGHUP)
    Path("go").touch()
    out, _ = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out) == (0, "a.txt -> a.csv: 3 words\n")


def test_a_reader_that_leaves_early_is_no_reason_to_complain(program, write):
    names = write(a="one", b="one", c="one")
    process = program("tally", *names, "-o", "out")
    process.stdout.close()
    with process:
        assert process.stderr.read() == ""
    assert process.returncode == 141
