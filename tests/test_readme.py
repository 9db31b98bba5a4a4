"""What the README shows exists: commands, options, targets of make, files."""

import re
import shlex
from pathlib import Path

import click
import pytest
from click.exceptions import Exit

from handclean.cli import main as frame

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
FENCED = re.findall(r"^```(\w*)\n(.*?)^```", README, re.DOTALL | re.MULTILINE)
BLOCKS = [text for language, text in FENCED if language != "python"]
INLINE = re.findall(
    r"`(handclean [^`]*)`", re.sub(r"^```.*?^```", "", README, flags=re.DOTALL | re.M)
)
"""Command lines, or names of commands, within the text."""

SEPARATORS = {"|", "||", "&&", ";", ">", ">>"}


def commands():
    """Every ``handclean ...`` of every block, as words after it."""
    for block in [*BLOCKS, *(" ".join(line.split()) for line in INLINE)]:
        for line in block.replace("\\\n", " ").splitlines():
            lexer = shlex.shlex(line, posix=True, punctuation_chars="|&;")
            lexer.whitespace_split = True
            words = list(lexer)
            for start in [i for i, word in enumerate(words) if word == "handclean"]:
                rest = words[start + 1 :]
                ends = [i for i, word in enumerate(rest) if word in SEPARATORS]
                yield rest[: min(ends, default=len(rest))]


def parse(words):
    """Parse a command line as ``handclean`` would, without running it; its context."""
    command, context = (
        frame.cli,
        click.Context(frame.cli, info_name="handclean", **frame.cli.context_settings),
    )
    while isinstance(command, frame.LazyGroup):
        name, *words = words
        command = command.get_command(context, name)
        assert command is not None, f"no command is called {name}"
        context = click.Context(command, parent=context, info_name=name)
    return command.make_context(context.info_name, words, parent=context.parent)


SHOWN = list(commands())
NAMES = {tuple(name.split()) for name in [*frame.COMMANDS, *frame.GROUPS]}
WHOLE = [w for w in SHOWN if w and tuple(w) not in NAMES and w != ["--help"]]
"""Those that are more than a command's name."""


@pytest.mark.parametrize("words", WHOLE, ids=" ".join)
def test_every_command_shown_parses_and_says_where_to_write(words, monkeypatch):
    monkeypatch.chdir(ROOT)
    if words[-1] == "--help":
        with pytest.raises(Exit):
            parse(words)
        return
    given = parse(words).params
    reads = given.get("inputs") and not given.get("manifest")
    if reads and "output" in given and "--evaluate" not in words:
        assert given["output"], "-o is missing"


def test_every_command_is_shown():
    shown = {
        " ".join(words[: len(c.split())]) for words in SHOWN for c in frame.COMMANDS
    }
    assert shown >= set(frame.COMMANDS)


def test_every_target_of_make_that_is_shown_exists():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    shown = set(re.findall(r"\bmake ([a-z]+)\b", "\n".join(BLOCKS)))
    shown |= set(re.findall(r"`make ([a-z]+)`", README))
    assert {"demo", "test"} <= shown
    for target in shown:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


def test_every_file_of_this_project_that_is_named_is_there():
    names = re.findall(
        r"`((?:configs|requirements|tests|handclean)[\w/.-]*\.\w+)`", README
    )
    assert names
    for name in names:
        assert "PART" in name or (ROOT / name).exists(), name
