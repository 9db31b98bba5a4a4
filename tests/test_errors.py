"""Errors say where, what is wrong and what would be right; nothing reads the text."""

import ast
import pickle
from pathlib import Path

import pytest

from handclean.errors import (
    TAKE,
    FileError,
    HandcleanError,
    Place,
    ShapeError,
    TakeNumber,
    UnknownNameError,
    UnknownSettingError,
    UnsaidError,
    UsageError,
)
from handclean.remarks import KINDS

PACKAGE = Path(__file__).parents[1] / "handclean"
FILE = Path("m")
EVERY = [
    HandcleanError("is wrong"),
    HandcleanError("is wrong", where=TAKE),
    HandcleanError("is wrong", where=TakeNumber(1)),
    UsageError("is wrong", where="--side"),
    UnsaidError(FILE, "does not say", "--rate"),
    FileError(FILE, "is wrong", "it should be right"),
    FileError(Place(FILE, " line 3"), "is wrong"),
    FileError(Place(FILE) / "markers", "is wrong"),
    FileError(Place(FILE, option="--subject"), "is wrong"),
    ShapeError("is wrong"),
    UnknownNameError(FILE, "marker", "a", ["b"]),
    UnknownSettingError("--model", "model", "a", ["b"]),
]


@pytest.mark.parametrize("error", EVERY, ids=str)
def test_an_error_comes_out_of_another_process_as_it_was(error):
    back = pickle.loads(pickle.dumps(error))
    assert (type(back), str(back), vars(back)) == (type(error), str(error), vars(error))


@pytest.mark.parametrize("error", EVERY, ids=str)
def test_an_error_may_be_said_of_another_place(error):
    other = error.at(Path("7"))
    assert (type(other), other.wrong) == (type(error), error.wrong)
    assert str(other) == f"7: {error.wrong}"
    assert error.at(error.where or "x").exit_status == error.exit_status


def test_a_part_of_a_file_is_said_of_another_file():
    for error, said in zip(
        EVERY[5:9],
        ["7: is", "7 line 3: is", "7/markers: is", "--subject 7: is"],
        strict=True,
    ):
        assert error.file == FILE
        assert str(error.in_file(Path("7"))).startswith(said)


def test_what_is_wrong_with_a_file_is_wrong_usage_of_its_option():
    for error, said in [
        (FileError(FILE, "is wrong"), "--subject m: is wrong"),
        (FileError(Place(FILE, "/a"), "is wrong"), "--subject m/a: is wrong"),
        (HandcleanError("is wrong"), "--subject: is wrong"),
        (HandcleanError("is wrong", where="--subject"), "--subject: is wrong"),
        (HandcleanError("is wrong", where="hand"), "--subject hand: is wrong"),
    ]:
        made = UsageError.of(error, "--subject")
        assert (str(made), made.exit_status) == (said, 2)
        assert made.file == error.file


def calls():
    """Every call that makes an error, but for those in the module of errors."""
    kinds = {kind.__name__ for kind in map(type, EVERY)}
    for path in sorted(PACKAGE.rglob("*.py")):
        if path.name == "errors.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in kinds:
                yield f"{path.name}:{node.lineno}", node


def begins_with_a_place(text):
    """Whether an expression is a text like f"{path}: is wrong"."""
    if not isinstance(text, ast.JoinedStr) or len(text.values) < 2:
        return False
    first, second = text.values[:2]
    return isinstance(first, ast.FormattedValue) and (
        isinstance(second, ast.Constant) and second.value.startswith(": ")
    )


def test_no_error_has_its_place_in_its_text():
    """A place in the text is named twice where one in ``where`` is named once."""
    assert begins_with_a_place(ast.parse('f"{path}: is wrong"').body[0].value)
    texts = [(where, call.args[0]) for where, call in calls() if call.args]
    assert len(texts) > 300
    wrong = [where for where, text in texts if begins_with_a_place(text)]
    assert not wrong, f"say where=... instead: {', '.join(wrong)}"


LOOKS = {
    *{"startswith", "endswith", "removeprefix", "removesuffix", "replace"},
    *{"split", "rsplit", "partition", "rpartition", "find", "index", "count"},
}
"""Methods by which code looks into a text."""

TEXTS = {"text", "wrong"}
"""Attributes of remarks, events and errors that are sentences for people."""


def reads_a_message(node, caught):
    """Whether code looks into the text of an error, a remark or an event."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        if getattr(node.func.value, "id", "") == "re":
            return any(is_a_message(part, caught) for part in node.args)
        looks = node.func.attr in LOOKS and bool(node.args)
        return looks and is_a_message(node.func.value, caught)
    if isinstance(node, ast.Compare):
        parts = (node.left, *node.comparators)
        return any(is_a_message(part, caught) for part in parts)
    return False


def is_a_message(node, caught):
    """Whether an expression is ``str(error)``, ``remark.text`` or ``error.wrong``."""
    if isinstance(node, ast.Attribute):
        return node.attr in TEXTS and getattr(node.value, "id", "") != "self"
    return (
        isinstance(node, ast.Call)
        and getattr(node.func, "id", "") == "str"
        and bool(node.args)
        and getattr(node.args[0], "id", "") in caught
    )


def readers_of_messages(code):
    """Lines of code that look into a message."""
    nodes = list(ast.walk(ast.parse(code)))
    caught = {n.name for n in nodes if isinstance(n, ast.ExceptHandler)}
    return [node.lineno for node in nodes if reads_a_message(node, caught)]


@pytest.mark.parametrize(
    "line",
    [
        'if "--rate" in str(error): pass',
        'if str(error).startswith("a"): pass',
        'if event.text.startswith("gap in "): pass',
        'told = one.text.removeprefix("a.c3d: ")',
        'if "odd" in remark.text: pass',
        'if remark.text == "odd": pass',
        're.sub("take 1", name, one.text)',
        'where, _, wrong = error.wrong.partition(": ")',
    ],
)
def test_a_reader_of_messages_is_found(line):
    code = f"try:\n    pass\nexcept ValueError as error:\n    {line}\n"
    assert readers_of_messages(code) == [4]
    assert not readers_of_messages('told = f"{name}: {one.text}"\nraise E(str(error))')


def test_no_code_reads_a_message():
    found = [
        f"{path.relative_to(PACKAGE)}:{line}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for line in readers_of_messages(path.read_text(encoding="utf-8"))
    ]
    assert not found, found


def test_every_remark_is_of_a_kind_there_is():
    """A kind that is misspelt would be found only when it is told."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "remark":
                kind = node.args[0] if node.args else None
                found += [kind.value] if isinstance(kind, ast.Constant) else []
    assert len(found) > 100
    assert set(found) <= set(KINDS)
