"""Frames that a person reads are the source's numbers, both ends included, everywhere.

Inside they are rows, from 0, without the stop. Only `Numbering` turns one into the
other; these tests look through all of the code for whoever forgets it.
"""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

from handclean.recording import Numbering, Recording

PACKAGE = Path(__file__).parents[1] / "handclean"
SOURCES = sorted(PACKAGE.rglob("*.py"))

READ = {
    ("io/c3d/remarks.py", "layout.first_frame"),
    ("io/shared/reading.py", "numbers[row]"),
    ("io/shared/reading.py", "numbers[row - 1]"),
    ("io/hdf5/session.py", "first"),
    ("io/text/vendors.py", "first"),
    ("io/c3d/verdict.py", "', '.join(runs)"),  # counted from the first frame's
}
"""Numbers that were read as they are from a file's own column or header."""

COUNTING = {
    "recording.py",
    "io/c3d/events.py",  # [s] before the first frame
    "io/text/csv_write.py",  # a column of numbers
    "report/metrics.py",  # where numbers of two takes overlap
}
"""Modules that add to or subtract from a first frame's number."""

NUMBER = re.compile(r"\b[Ff]rames?( from| to| number| is number)? $")


def said_frames(tree):
    """Values that follow the word frame in a text, with the function they are in."""
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef):
            continue
        for text in ast.walk(function):
            if not isinstance(text, ast.JoinedStr):
                continue
            before = ""
            for part in text.values:
                if isinstance(part, ast.Constant):
                    before = part.value
                    continue
                if NUMBER.search(before):
                    yield part.value, function
                before = ""


def is_numbered(value, function):
    """Whether a value, or the variable it is, was made by a `Numbering`."""
    made = re.compile(r"numbering|\.span\(|_frames_of\(")
    if not isinstance(value, ast.Name):
        return bool(made.search(ast.unparse(value)))
    given = [
        node.value
        for node in ast.walk(function)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if value.id in {n.id for n in ast.walk(target) if isinstance(n, ast.Name)}
    ]
    return bool(given) and all(made.search(ast.unparse(node)) for node in given)


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_frame_in_a_text_is_a_number_of_the_source(path):
    name = path.relative_to(PACKAGE).as_posix()
    for value, function in said_frames(ast.parse(path.read_text())):
        told = ast.unparse(value)
        fine = is_numbered(value, function) or (name, told) in READ
        assert fine or name == "recording.py", f"{told} in {function.name} is a row?"


def test_the_search_finds_what_it_should():
    code = "def f(t, n):\n    a = t.numbering.of(n)\n    b = n + 1\n"
    code += "    return f'in frame {n}, frames {a} to {b}, {n} frames'\n"
    found = [
        (ast.unparse(value), is_numbered(value, function))
        for value, function in said_frames(ast.parse(code))
    ]
    assert found == [("n", False), ("a", True)]


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_nobody_else_counts_from_the_first_frame(path):
    if path.relative_to(PACKAGE).as_posix() in COUNTING:
        return
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
            for side in (node.left, node.right):
                assert not re.search(r"\bfirst_frame$", ast.unparse(side)), (
                    f"{ast.unparse(node)}: take.numbering does that"
                )


def test_rows_become_numbers_and_come_back():
    take = Recording(rate=100.0, frames=50, first_frame=995)
    numbering = take.numbering
    assert numbering == Numbering(995)
    assert numbering.of(np.int64(0)) == 995
    assert numbering.span(0, 50) == (995, 1044)
    assert numbering.rows(995, 1044) == (0, 50)
    assert numbering.rows(*numbering.span(7, 7)) == (7, 7)  # nothing stays nothing
    assert numbering.words(3, 4) == "frame 998"
    assert numbering.words(0, 50) == "frames 995 to 1044"
    assert isinstance(numbering.of(np.int64(0)), int)
