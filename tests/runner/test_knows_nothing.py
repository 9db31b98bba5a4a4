"""The runner knows no hand, no format and no command: they are given to it."""

import ast
import re
from pathlib import Path

import pytest

from handclean import runner
from handclean.cli.main import COMMANDS
from handclean.commands.shared.take_options import TakeOptions
from handclean.io.formats import BY_SUFFIX

FILES = sorted(Path(runner.__file__).parent.glob("*.py"))
SUFFIXES = {*BY_SUFFIX, ".toml"}
SUFFIX = re.compile(rf"(?<!\w)({'|'.join(map(re.escape, sorted(SUFFIXES)))})\b")
COMMAND = re.compile(rf"handclean ({'|'.join(COMMANDS)})\b")


def texts(tree):
    """Texts that the code of a module works with, which docstrings are not."""
    told = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and id(node) not in told:
            yield from [node.value] if isinstance(node.value, str) else ()


def names(tree):
    """Modules that a module imports, wherever in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.fixture(params=FILES, ids=lambda path: path.stem)
def tree(request):
    return ast.parse(request.param.read_text())


def test_no_suffix_of_a_format_stands_in_it(tree):
    assert [text for text in texts(tree) if SUFFIX.search(text)] == []


def test_no_command_is_named_in_it(tree):
    found = [t for t in texts(tree) if t in COMMANDS or COMMAND.search(t)]
    assert found == []
    assert [text for text in texts(tree) if text.startswith("handclean.")] == []


def test_it_imports_nothing_that_knows_hands_or_formats(tree):
    ours = {name.split(".")[1] for name in names(tree) if name.startswith("handclean.")}
    assert ours <= {"runner", "errors", "remarks", "__version__"}


def test_nothing_that_is_said_of_takes_is_an_attribute_in_it(tree):
    used = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    assert not used & set(TakeOptions.__dataclass_fields__)


def test_these_tests_find_what_they_look_for():
    found = "if path.suffix == '.h5': run('handclean warm', 'label')"
    tree = ast.parse(found)
    assert [text for text in texts(tree) if SUFFIX.search(text)] == [".h5"]
    assert [t for t in texts(tree) if t in COMMANDS or COMMAND.search(t)] == [
        "handclean warm",
        "label",
    ]
