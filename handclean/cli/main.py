"""The command ``handclean``: find the command, run it, turn errors into one line.

Commands are imported when they are called, so that ``handclean --help`` is instant.
"""

import atexit
import os
import sys
import threading
import traceback
import warnings
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any

import click
from click.exceptions import ClickException, Exit, NoArgsIsHelpError, UsageError
from click.shell_completion import CompletionItem

from handclean import __version__
from handclean.cli import completion
from handclean.errors import HandcleanError, UnknownSettingError
from handclean.runner import interrupts, terminal
from handclean.runner.interrupts import Interrupted

COMMANDS = {
    "inspect": "Say what is in a file and what is odd about it.",
    "clean": "Label, fill gaps and solve unlabelled takes in one pass.",
    "label": "Name the markers of unlabelled takes.",
    "fill-gaps": "Fill gaps in marker trajectories, or judge what fills them.",
    "solve": "Find the joint angles of labelled takes.",
    "calibrate-hand markers": "Learn a hand and its markers from labelled "
    "range-of-motion takes.",
    "calibrate-hand scan": "Learn a hand with its skin from a scan (.ply, .obj, .stl) "
    "and landmarks.",
    "calibrate-glove examine": "Find which sensors of a glove are cross-coupled, and "
    "their active ranges.",
    "calibrate-glove sample": "Take samples (readings with known rotations) from a "
    "glove's readings.",
    "calibrate-glove fit": "Learn from samples what a glove's readings mean.",
    "calibrate-glove rewear": "Adapt a calibration to another donning of the same "
    "glove.",
    "calibrate-glove apply": "Turn a glove's readings into joint angles with sigma.",
    "learn subspace": "Learn a posture prior from joint angles.",
    "optimize-layout": "Find the few markers that tell a motion best, or judge such "
    "layouts.",
    "simulate": "Make takes, scans and readings of gloves with known truth.",
    "compare": "Say how far a take is from a reference: labels, markers, joint angles.",
    "convert": "Convert takes from any format into any other.",
    "warm": "Compile and cache the kernels, once per installation.",
}
"""Commands with their first line of help; "group name" is a command of a group."""

GROUPS = {
    "calibrate-glove": "Calibrate data gloves and turn their readings into angles.",
    "calibrate-hand": "Learn a hand from what was measured of it.",
    "learn": "Learn from takes what others are solved with.",
}
"""Groups of commands with their help."""

THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


class LazyGroup(click.Group):
    """A group that imports a command when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """List the commands in the order of the table."""
        start = self._start
        names = (name[len(start) :] for name in COMMANDS if name.startswith(start))
        return list(dict.fromkeys(name.split()[0] for name in names))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command, or make a group."""
        name = self._start + cmd_name
        if name in GROUPS:
            return LazyGroup(name, help=GROUPS[name], no_args_is_help=True)
        if name not in COMMANDS:
            return None
        module = name.replace(" ", "_").replace("-", "_")
        command = import_module(f"handclean.cli.{module}").command
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find a command; a name that is none gets a suggestion."""
        if not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            known = self.list_commands(ctx)
            raise UnknownSettingError(ctx.command_path, "command", args[0], known)
        return super().resolve_command(ctx, args)

    def shell_complete(
        self, ctx: click.Context, incomplete: str
    ) -> list[CompletionItem[Any]]:
        """Complete commands without importing them, and options."""
        names = [
            CompletionItem(name, help=self._help(name))
            for name in self.list_commands(ctx)
            if name.startswith(incomplete)
        ]
        return [*names, *click.Command.shell_complete(self, ctx, incomplete)]

    def format_commands(
        self, ctx: click.Context, formatter: click.HelpFormatter
    ) -> None:
        """List the commands without importing them."""
        rows = [(name, self._help(name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def _help(self, name: str) -> str:
        return COMMANDS.get(self._start + name) or GROUPS[self._start + name]

    @property
    def _start(self) -> str:
        return "" if self.name == "handclean" else f"{self.name} "


@click.group(
    "handclean",
    cls=LazyGroup,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="handclean")
def cli() -> None:
    """Clean optical hand motion capture: label, fill gaps, solve, offline."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit status."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    for name in THREADS:
        os.environ[name] = "1"  # before numpy; inputs run side by side instead
    terminal.open_closed()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    if completion.asked():
        return completion.answer(cli)
    try:
        with interrupts.raising(), warnings.catch_warnings():
            terminal.hush()
            status = _run(arguments)
            sys.stdout.flush()
            return status
    except Interrupted as error:
        return _tell(str(error), error.exit_status)
    except BrokenPipeError:
        _let_go(sys.stdout)
        return 128 + 13  # like SIGPIPE
    except Exception as error:
        if "-v" in arguments or "--verbose" in arguments:
            sys.stderr.write(terminal.safe(traceback.format_exc()))
        kind = type(error).__name__
        return _tell(f"handclean: internal error, please report it: {kind}: {error}", 1)


def program() -> None:
    """Be the program: run the command, and leave without taking anything apart.

    All files are closed by then. What Python would do, such as to remove the machine
    code of each kernel from memory, takes longer than to clean a short take.
    """
    status = main()
    if threading.active_count() > 1:
        sys.exit(status)
    atexit._run_exitfuncs()  # processes that were started end here
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            if stream is not None:
                stream.flush()
    os._exit(status)


def _run(arguments: list[str]) -> int:
    try:
        with cli.make_context("handclean", arguments) as context:
            status: Any = cli.invoke(context)
        return int(status or 0)
    except HandcleanError as error:
        return _tell(str(error), error.exit_status)
    except NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return error.exit_code
    except UsageError as error:
        where = error.ctx.command_path if error.ctx else "handclean"
        return _tell(f"{where}: {error.format_message()}", error.exit_code)
    except ClickException as error:
        return _tell(f"handclean: {error.format_message()}", error.exit_code)
    except Exit as error:
        return error.exit_code
    except BrokenPipeError:
        raise
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        return _tell(f"{error.filename or 'handclean'}: {reason}", 1)


def _tell(text: str, status: int) -> int:
    """Write one line to stderr, should anybody still listen."""
    try:
        sys.stderr.write(terminal.line(text) + "\n")
        sys.stderr.flush()
    except OSError:
        _let_go(sys.stderr)
    return status


def _let_go(stream: Any) -> None:
    """Send what is left for a stream nowhere, so that the end is quiet too."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
