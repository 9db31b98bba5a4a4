"""Completion in real shells: commands, options, choices, files."""

import os
import pty
import select
import shutil
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete

from handclean.cli import completion
from handclean.cli import main as frame

ROOT = Path(__file__).parents[2]
START = {
    "bash": ["bash", "--norc", "-i"],
    "zsh": ["zsh", "-f", "-i"],
    "fish": ["fish", "--no-config"],
}
SOURCE = {
    "bash": 'eval "$(_HANDCLEAN_COMPLETE=bash_source handclean)"',
    "zsh": "autoload -U compinit && compinit -u -D\n"
    'eval "$(_HANDCLEAN_COMPLETE=zsh_source handclean)"',
    "fish": "_HANDCLEAN_COMPLETE=fish_source handclean | source",
}
"""What README says to put into the shell's start file."""

TYPED = {
    "fill-g": "fill-gaps",
    "calibrate-glove sam": "calibrate-glove sample",
    "fill-gaps --max-g": "fill-gaps --max-gap-s",
    "fill-gaps --method cou": "fill-gaps --method coupled",
    "label --columns ig": "label --columns ignore",
    "label --marker-set may": "label --marker-set maycock26",
    "clean --side le": "clean --side left",
    "calibrate-glove sample --pose thumb-u": "calibrate-glove sample --pose thumb-up",
    "convert --joint-map web": "convert --joint-map webxr",
    "simulate gr": "simulate grasp",
}


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder to type in; ``handclean`` is on the path."""
    folder, programs = tmp_path / "a folder", tmp_path / "bin"
    folder.mkdir()
    programs.mkdir()
    script = programs / "handclean"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m handclean "$@"\n')
    script.chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.parametrize("shell", SOURCE)
def test_the_readme_says_how(shell):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"```{shell}\n{SOURCE[shell].splitlines()[-1]}\n```" in readme


def needs(shell):
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")


class Terminal:
    """An interactive shell at a terminal of its own."""

    def __init__(self, command):
        self.pid, self.end = pty.fork()
        if self.pid == 0:
            os.execvp(command[0], command)

    def send(self, text):
        os.write(self.end, text.encode())

    def until(self, wanted, seconds=60.0):
        """What the terminal shows until it shows this."""
        shown, stop = "", time.monotonic() + seconds
        while wanted not in shown:
            left = stop - time.monotonic()
            assert left > 0, f"{wanted!r} never came: {shown!r}"
            if select.select([self.end], [], [], left)[0]:
                shown += os.read(self.end, 4096).decode(errors="replace")
        return shown

    def close(self):
        os.kill(self.pid, 9)
        os.waitpid(self.pid, 0)
        os.close(self.end)


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_the_tab_key_completes(shell, place):
    needs(shell)
    terminal = Terminal(START[shell])
    try:
        terminal.send(f"{SOURCE[shell]}\necho set''up\n")
        terminal.until("setup")
        for begun, whole in TYPED.items():
            terminal.send(f"handclean {begun}\t")
            rest = whole[len(begun) :]
            terminal.until(begun)
            terminal.until(rest)
            terminal.send("\x15")  # Ctrl-U: away with the line
    finally:
        terminal.close()


def test_fish_completes(place):
    needs("fish")
    (place / "take 07.c3d").write_text("")
    asked = "\n".join(f"complete -C 'handclean {begun}'" for begun in TYPED)
    asked += "\ncomplete -C 'handclean clean take'"
    done = subprocess.run(
        [*START["fish"], "-c", f"{SOURCE['fish']}\n{asked}"],
        capture_output=True,
        text=True,
        check=True,
    )
    found = {line.split("\t")[0] for line in done.stdout.splitlines()}
    assert {whole.split()[-1] for whole in TYPED.values()} <= found
    assert found & {"take 07.c3d", "take\\ 07.c3d"}
    assert done.stderr == ""


def test_bash_completes_files_with_a_space(place):
    (place / "take 07.c3d").write_text("")
    terminal = Terminal(START["bash"])
    try:
        terminal.send(f"{SOURCE['bash']}\necho set''up\n")
        terminal.until("setup")
        terminal.send("handclean clean take\t")
        terminal.until("take\\ 07.c3d")
    finally:
        terminal.close()


def command_of(name):
    module = name.replace(" ", "_").replace("-", "_")
    return import_module(f"handclean.cli.{module}").command


def complete(*words):
    """What may stand for the last word, as (kind, value)."""
    asked = ShellComplete(frame.cli, {}, "handclean", completion.VARIABLE)
    items = asked.get_completions(list(words[:-1]), words[-1])
    return [(item.type, item.value) for item in items]


@pytest.mark.parametrize("command", frame.COMMANDS)
def test_every_option_of_every_command_is_completed(command):
    names = {
        name
        for option in command_of(command).params
        if isinstance(option, click.Option) and not option.hidden
        for name in [*option.opts, *option.secondary_opts]
        if name.startswith("--")
    }
    found = {value for _, value in complete(*command.split(), "--")}
    assert names | {"--help"} <= found


@pytest.mark.parametrize("command", frame.COMMANDS)
def test_whatever_takes_one_of_some_words_offers_them(command):
    for option in command_of(command).params:
        kind = "" if option.metavar is None else option.metavar
        if isinstance(option.type, click.Choice) or "NAME|FILE" in kind:
            offered = complete(*command.split(), option.opts[0], "")
            assert [v for t, v in offered if t == "plain"], option.opts


def test_names_that_may_be_files_too_offer_both():
    offered = complete("label", "--marker-set", "sch")
    assert ("file", "sch") in offered
    assert ("plain", "schroeder17") in offered


def test_a_shell_that_asks_for_nonsense_hears_nothing(place):
    for words in ("handclean nope ", "handclean label --config no.toml --si"):
        asked = {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split()))}
        done = subprocess.run(
            ["handclean"],
            env={**os.environ, **asked, completion.VARIABLE: "bash_complete"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert "Usage" not in done.stdout
        assert done.stderr == ""


def test_completing_imports_one_command_and_nothing_heavy():
    code = (
        "import os, sys; from handclean.cli.main import main; main();"
        "made = [m for m in sys.modules if m.startswith('handclean.cli.')];"
        "print(*made, *{'numpy', 'scipy', 'numba', 'h5py'} & set(sys.modules),"
        " file=sys.stderr)"
    )
    asked = {"COMP_WORDS": "handclean cal", "COMP_CWORD": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={
            **os.environ,
            **asked,
            completion.VARIABLE: "bash_complete",
            "PYTHONPATH": str(ROOT),
        },
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["plain,calibrate-hand", "plain,calibrate-glove"]
    assert set(done.stderr.split()) <= {
        "handclean.cli.main",
        "handclean.cli.completion",
    }


@pytest.mark.parametrize("command", ["", *frame.GROUPS, *frame.COMMANDS])
def test_h_is_help(command, capsys):
    assert frame.main([*command.split(), "-h"]) == 0
    short = capsys.readouterr()
    assert frame.main([*command.split(), "--help"]) == 0
    assert short.out == capsys.readouterr().out
    assert "-h, --help" in short.out
