"""``handclean learn subspace``."""

from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.shared.choices import LearnConfig
from handclean.commands.table import work_of
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("subspace")
@options.settings("learn-subspace", LearnConfig)
@click.option(
    "--held-out",
    multiple=True,
    type=options.PATH,
    metavar="FILE",
    help="A take to say how much of it is covered, not to learn from; once per file.",
)
@options.batch(options.SOURCES, options.ONE_OUTPUT, options.TELLING)
def command(batch: Batch, settings: LearnConfig, held_out: tuple[Path, ...]) -> int:
    """Learn a posture prior from joint angles.

    Angles come from sessions with a motion, or from BVH files.

    \b
    Example:
        handclean learn subspace takes/*.h5 -o prior.h5 --held-out other.h5
    """
    numbered = {f"held_out {i}": path for i, path in enumerate(held_out, start=1)}
    batch = options.with_files(batch, **numbered)
    return many.reduce(work_of("learn subspace", batch, settings), batch)
