"""``handclean warm``."""

import json
import time
from importlib import import_module

import click

from handclean.cli import options
from handclean.commands.shared.warming import FOR
from handclean.runner.batch import Batch

jobs = click.option(
    "-j",
    "--jobs",
    type=click.IntRange(min=1),
    default=2,
    show_default=True,
    metavar="N",
    help="Processes; more than three have little to do.",
)


commands = click.argument(
    "commands", nargs=-1, type=click.Choice(list(FOR)), metavar="[COMMAND]..."
)


@click.command("warm")
@commands
@options.batch([jobs, options.as_json])
def command(batch: Batch, commands: tuple[str, ...]) -> int:
    """Compile and cache the kernels, once per installation.

    Of all commands, or only of those given: clean (with label, fill-gaps and solve) and
    calibrate-hand (of markers), which take most of the time.

    Without it they are compiled when a command first needs them. A wheel of
    `make wheel` brings them along, and nothing is left to compile.

    \b
    Example:
        handclean warm
        handclean warm calibrate-hand clean
    """
    began = time.perf_counter()
    figures = import_module("handclean.commands.shared.kernels").warm(
        batch.jobs or 2, lambda text: click.echo(text, err=True), commands
    )
    figures["seconds"] = round(time.perf_counter() - began, 3)
    if batch.json:
        click.echo(json.dumps({"status": "done", **figures}))
    else:
        text = (
            "{compiled} kernels compiled, {loaded} loaded from {cache} in {seconds} s"
        )
        click.echo(text.format(**figures))
    return 0
