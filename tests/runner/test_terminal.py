"""Text from files does no more than be read, and no line is endless."""

import json
import warnings
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.runner import terminal


@given(text=st.text())
def test_nothing_in_a_line_is_obeyed_by_a_terminal(text):
    told = terminal.line(text)
    assert len(told) <= terminal.MOST_CHARACTERS
    assert "\n" not in told
    assert all(char.isprintable() or char == "\u3000" for char in terminal.safe(told) if
               ord(char) < 0x100)  # fmt: skip
    assert not any(0xD800 <= ord(char) < 0xE000 for char in told)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a\x1b[2Jb", "a\\x1b[2Jb"),
        ("a\x9b2Jb", "a\\x9b2Jb"),
        ("a\rb\x07\x00\x7f", "a\\rb\\x07\\x00\\x7f"),
        ("a\u202egnp.exe", "a\\u202egnp.exe"),
        ("a\u2066\u200b\ufeffb", "a\\u2066\\u200b\\ufeffb"),
        ("a\udcffb", "a\\udcffb"),
        ("späße 手\tx\ny", "späße 手\tx\ny"),
    ],
)
def test_what_a_terminal_obeys_is_written_as_what_it_is(text, said):
    assert terminal.safe(text) == said


def test_a_line_that_is_too_long_keeps_both_ends():
    told = terminal.line("in/a.c3d: " + "x" * 10_000 + "; it should be right")
    assert len(told) == terminal.MOST_CHARACTERS == 500
    assert told.startswith("in/a.c3d: xxx")
    assert told.endswith("xxx; it should be right")
    assert terminal.line("x" * 500) == "x" * 500


EVIL = "\x1b]0;title\x07\u202e"


def test_texts_of_files_are_safe_in_results_warnings_and_errors(folder, run):
    for name, word in (("a", "evil"), ("b", "wicked")):
        Path(f"{name}{EVIL}.txt").write_text(word)
    paths = sorted(Path().glob("*.txt"))
    given = {"output": "out", "json": False, "verbose": True}
    status, lines, err = run(*paths, **given)
    assert status == 1
    text = "\n".join([*lines, err])
    assert text.count("\\x1b]0;title\\x07\\u202e") >= 6
    assert "\x1b" not in text
    assert "\u202e" not in text
    assert max(map(len, err.splitlines())) <= 500
    _, (one, two), _ = run(*paths, output="more")
    assert EVIL in one["warnings"][0]
    assert len(two["error"]) == 500
    json.dumps(one).encode("ascii")


def test_what_libraries_warn_of_is_kept_back_unless_somebody_asked():
    for asked, count in ((None, 0), (SyntaxWarning, 1)):
        with warnings.catch_warnings(record=True) as told:
            warnings.resetwarnings()
            if asked:
                warnings.simplefilter("error", asked)
            terminal.hush()
            warnings.warn("invalid value", RuntimeWarning, stacklevel=1)
        assert len(told) == count


def test_no_warning_of_a_library_is_written_by_a_worker(inputs, run):
    _, objects, err = run(*inputs(a="numpy", b="numpy"), output="out")
    assert [o["status"] for o in objects] == ["done", "done"]
    assert err == "2 done\n"
