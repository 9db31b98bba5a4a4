"""That kernels are compiled is said once, and only where one is."""

import threading
from multiprocessing import get_context

import numba
import pytest

from handclean.runner.compiling import Once, silent, watching


@pytest.fixture(autouse=True)
def _compiled(monkeypatch):
    """Compile, even where all other tests run as plain Python."""
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 0)


def test_a_compilation_is_noticed_before_it_is_done_and_a_second_call_is_not():
    @numba.njit
    def twice(x):
        return 2 * x

    told = []
    with watching(lambda: told.append(len(twice.signatures))):
        assert twice(3) == 6
        assert twice(4) == 8
    assert told == [0]
    with watching(lambda: told.append("again")):
        twice(5)
    assert told == [0]


def test_outside_the_watch_nothing_is_noticed():
    told = []
    with watching(lambda: told.append(1)):
        pass
    numba.njit(lambda x: x + 1)(1)
    assert told == []


def wait():
    return "wait ..."


@pytest.mark.parametrize("lock", [threading.Lock, get_context("spawn").Lock])
def test_it_is_said_once_on_stderr(capsys, lock):
    shared = lock()
    for once in (Once(shared, wait), Once(shared, wait)):
        once()
        once()
    out, err = capsys.readouterr()
    assert (out, err) == ("", "wait ...\n")


def test_silence_watches_nothing():
    with watching(silent) as found:
        assert found is None
