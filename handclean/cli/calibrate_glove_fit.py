"""``handclean calibrate-glove fit``."""

import click

from handclean.cli import glove_options, options
from handclean.commands.shared.choices import GloveFitting
from handclean.commands.table import work_of
from handclean.glove.settings import GloveFitConfig
from handclean.runner import many, progress
from handclean.runner.batch import Batch


@click.command("fit")
@options.settings("calibrate-glove-fit", GloveFitConfig)
@options.batch(
    options.INPUTS,
    options.ONE_DRAWN_OUTPUT,
    [options.jobs],
    options.TELLING,
)
def command(batch: Batch, settings: GloveFitConfig) -> int:
    """Learn from samples what a glove's readings mean.

    Each rotation has a model of its own; -j fits so many at a time, with the same
    result.

    \b
    Example:
        handclean calibrate-glove fit flat.h5 fist.h5 im20.h5 touch.h5 -j 2 -o glove.h5
    """
    glove_options.expect_h5(batch, "calibrations")
    chosen = GloveFitting(fit=settings, jobs=many.jobs_of(batch))
    with progress.shown(batch.quiet):
        return many.reduce(work_of("calibrate-glove fit", batch, chosen), batch)
