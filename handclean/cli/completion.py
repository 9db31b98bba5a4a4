"""Completion of command lines by a shell: commands, options, and what options take.

A shell calls ``handclean`` with `VARIABLE` set; then one of its scripts, or what may
come next, is written to stdout, and nothing is run. Only the command that is being
typed is imported. What goes wrong here is told to nobody: a shell would put it amid
the line that is typed.
"""

import contextlib
import os
from collections.abc import Callable, Collection, Iterable
from importlib import import_module
from pathlib import Path

import click
from click.shell_completion import CompletionItem, shell_complete

from handclean.commands.shared.formats import RECORDINGS
from handclean.io.formats import MESHES
from handclean.tomlfile import read_toml

VARIABLE = "_HANDCLEAN_COMPLETE"
"""Set to bash_source, zsh_source or fish_source, it makes the script of that shell."""

DATA = Path(__file__).parents[1] / "data"
FINGERS = ("index", "middle", "ring", "little")

Complete = Callable[[click.Context, click.Parameter, str], "list[CompletionItem[str]]"]


def asked() -> bool:
    """Tell whether a shell asks."""
    return bool(os.environ.get(VARIABLE))


def answer(cli: click.Command) -> int:
    """Answer a shell; return the exit status."""
    with contextlib.suppress(Exception), contextlib.redirect_stderr(None):
        return shell_complete(cli, {}, "handclean", VARIABLE, os.environ[VARIABLE])
    return 1


def words(known: Iterable[str], files: bool = False) -> Complete:
    """Complete words that are known, or files where these may stand instead."""
    return found(lambda: known, files)


def found(look: Callable[[], Iterable[str]], files: bool = False) -> Complete:
    """Complete words that are looked for when they are needed."""

    def complete(
        context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> "list[CompletionItem[str]]":
        begin = [CompletionItem(incomplete, type="file")] if files else []
        known = (word for word in look() if word.startswith(incomplete))
        return [*begin, *map(CompletionItem, known)]

    return complete


def shipped(folder: str) -> Complete:
    """Complete names of TOML files that ship in a folder, or files."""
    return found(
        lambda: sorted(path.stem for path in (DATA / folder).glob("*.toml")), True
    )


def _key_poses() -> Collection[str]:
    return read_toml(DATA / "gloves" / "key_poses.toml", "not TOML")


def _gloves() -> Collection[str]:
    known = sorted(path.stem for path in (DATA / "gloves").glob("*.toml"))
    return [name for name in known if name != "key_poses"]


def _grasps() -> Collection[str]:
    known: Collection[str] = import_module("handclean.simulation.grasps").GRASPS
    return known


def _bones() -> Collection[str]:
    known: Collection[str] = (
        import_module("handclean.hand.template").template("right").bones
    )
    return known


files = words((), files=True)
marker_sets = shipped("marker_sets")
joint_maps = shipped("joint_maps")
gloves = found(_gloves, files=True)
poses = found(_key_poses, files=True)
suffixes = words((*RECORDINGS, *MESHES))
touching = words(f"thumb,{finger}" for finger in FINGERS)

SETTINGS: dict[str, Complete] = {
    "marker_set": marker_sets,
    "glove": gloves,
    "grasps": found(_grasps),
    "without_bones": found(_bones),
}
"""Of settings whose values are not a few words; of those, the settings class says."""
