"""``handclean convert``."""

import click

from handclean.cli import options
from handclean.pipeline import many
from handclean.pipeline.batch import Batch, Work


@click.command("convert")
@options.batch(options.SOURCES, options.OUTPUT, options.MANY, options.TELLING)
def command(batch: Batch) -> int:
    """Convert takes from any format into any other.

    \b
    Example:
        handclean convert take_07.c3d -o take_07.h5
    """
    return many.run(Work.of("convert", batch), batch)
