"""That kernels are compiled is said once, and only where one is."""

import numba
import pytest
from boxes import tally

from handclean.runner.compiling import Once, silent, to_stderr, watching


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


def test_it_is_said_once_on_stderr(capsys):
    once = Once(lambda: "wait ...", to_stderr)
    once()
    once()
    out, err = capsys.readouterr()
    assert (out, err) == ("", "wait ...\n")


@pytest.mark.parametrize(
    ("quiet", "said"), [(False, "compiling kernels ...\n"), (True, "")]
)
def test_processes_that_compile_side_by_side_are_told_of_once(inputs, run, quiet, said):
    paths = inputs(a="one", b="two", c="three", d="four")
    command = tally(step="compiled")
    status, _, err = run(*paths, output="out", jobs=2, command=command, quiet=quiet)
    assert status == 0
    assert err == said + ("" if quiet else "4 done\n")


def test_silence_watches_nothing():
    with watching(silent) as found:
        assert found is None
