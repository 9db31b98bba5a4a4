"""``handclean calibrate-glove rewear``."""

from pathlib import Path

import click

from handclean.cli import glove_options, options
from handclean.commands.shared.choices import GloveRewearing
from handclean.commands.table import work_of
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("rewear")
@click.option(
    "--calibration",
    type=options.PATH,
    metavar="GLOVE.h5",
    help="Of an earlier donning, perhaps another person's.",
)
@options.batch(
    options.INPUTS,
    options.ONE_OUTPUT,
    options.TELLING,
)
def command(batch: Batch, calibration: Path | None) -> int:
    """Adapt a calibration to another donning of the same glove.

    A few samples of the new donning (a flat hand and a fist, touching fingertips) tell
    how far each sensor's readings are shifted and stretched.

    \b
    Example:
        handclean calibrate-glove rewear flat.h5 --calibration glove.h5 -o day2.h5
    """
    glove_options.expect_h5(batch, "calibrations")
    batch = options.with_files(batch, calibration=calibration)
    return many.reduce(
        work_of("calibrate-glove rewear", batch, GloveRewearing()), batch
    )
