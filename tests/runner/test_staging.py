"""What a killed process left is cleared up, never what one that lives is writing."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from handclean.runner import staging

DAY = 86400.0


@pytest.fixture(autouse=True)
def somewhere_empty(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def left(place, **other):
    """A temporary file for an output, of the process or machine that is given."""
    path = staging.temporary(Path(place).absolute(), staging.token(), 0)
    name = path.name
    for part, value in other.items():
        begin, end = staging._NAME.fullmatch(name).span(part)
        name = name[:begin] + value + name[end:]
    path = path.with_name(name)
    assert staging._NAME.fullmatch(name)
    path.write_text("half")
    return path


@pytest.fixture
def dead():
    """The number of a process that is no more."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return str(process.pid)


def test_what_a_dead_process_left_of_an_output_goes(dead):
    path = left("out/a.h5", pid=dead)
    staging.remove_dead([Path("out/b.h5"), Path("a.h5")])
    assert path.exists(), "it is of another output"
    staging.remove_dead([Path("x/../out/a.h5")])
    assert not path.exists()


def test_it_goes_too_when_its_folder_was_made_meanwhile(dead):
    path = left("out/deep/a.h5", pid=dead)
    Path("out/deep").mkdir(parents=True)
    staging.remove_dead([Path("out/deep/a.h5")])
    assert not path.exists()


def test_what_a_process_that_lives_is_writing_stays():
    path = left("a.h5")
    staging.remove_dead([Path("a.h5")])
    assert path.exists()


def test_a_process_of_the_same_number_that_began_later_is_another():
    path = left("a.h5", started="1")
    staging.remove_dead([Path("a.h5")])
    assert not path.exists()


def test_a_process_that_is_dead_but_not_buried_is_dead():
    process = subprocess.Popen([sys.executable, "-c", ""])
    started = staging._started(process.pid)
    while staging._started(process.pid) is not None:
        time.sleep(0.01)
    path = left("a.h5", started=started, pid=str(process.pid))
    staging.remove_dead([Path("a.h5")])
    assert not path.exists()
    process.wait()


def test_what_was_left_before_the_machine_started_goes():
    path = left("a.h5", boot="0" * 8)
    staging.remove_dead([Path("a.h5")])
    assert not path.exists()


@pytest.mark.parametrize(("days", "stays"), [(0.0, True), (6.9, True), (7.1, False)])
def test_what_another_machine_left_goes_after_seven_days(days, stays, dead):
    path = left("a.h5", host="0" * 8, boot="1" * 8, pid=dead)
    os.utime(path, (1.0, time.time() - days * DAY))
    staging.remove_dead([Path("a.h5")])
    assert path.exists() == stays


@pytest.mark.parametrize("name", [".handclean-mine.h5", ".handclean-0-1.h5", "a.h5"])
def test_files_of_other_names_stay(name):
    Path(name).write_text("mine")
    os.utime(name, (1.0, 1.0))
    staging.remove_dead([Path("a.h5")])
    assert Path(name).exists()


def test_a_task_clears_up_after_its_own_process_only():
    task = staging.token()
    path = staging.temporary(Path("a.h5").absolute(), task, 0)
    path.write_text("half")
    staging.remove([Path("a.h5")], staging.token())
    assert path.exists()
    staging.remove([Path("a.h5")], task)
    assert not path.exists()
