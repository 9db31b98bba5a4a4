"""``handclean compare``."""

from dataclasses import replace
from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.table import work_of
from handclean.report.settings import CompareConfig
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("compare")
@click.argument("reference", type=options.PATH)
@click.argument("test", type=options.PATH)
@options.settings("compare", CompareConfig)
@options.batch(options.READING, [options.no_seed], options.TELLING)
def command(batch: Batch, reference: Path, test: Path, settings: CompareConfig) -> int:
    """Say how far a take is from a reference: labels, markers, joint angles.

    With --quiet on one line.

    \b
    Example:
        handclean compare labelled/S01_001.c3d S01_001.h5 --require "f1>=0.99"
        handclean compare truth/S01_001.h5 S01_001.h5

    The first judges labels by what the cameras saw. A truth has hidden markers, too:
    against it, each sample that no camera saw counts as missed.
    """
    batch = replace(batch, inputs=(reference, test))
    return many.reduce(work_of("compare", batch, settings), batch)
