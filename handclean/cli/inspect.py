"""``handclean inspect``."""

import click

from handclean.cli import options
from handclean.runner import many
from handclean.runner.batch import Batch, Work


@click.command("inspect")
@options.batch(options.SOURCES, [options.no_seed], options.MANY, options.TELLING)
def command(batch: Batch) -> int:
    """Say what is in a file and what is odd about it.

    A file that is damaged is read as far as it goes.

    \b
    Example:
        handclean inspect take_07.c3d
    """
    return many.run(Work.of("inspect", batch), batch, suffixes=())
