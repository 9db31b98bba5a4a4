"""``handclean calibrate-glove apply``."""

from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.shared.choices import GloveApplying
from handclean.commands.table import work_of
from handclean.glove.settings import GloveApplyConfig
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("apply")
@options.settings("calibrate-glove-apply", GloveApplyConfig)
@click.option(
    "--calibration",
    type=options.PATH,
    metavar="GLOVE.h5",
    help="What the readings mean.",
)
@click.option("--tips", is_flag=True, help="Add the fingertips, in the hand's frame.")
@options.batch(
    [*options.INPUTS, options.rate],
    options.OUTPUT,
    [*options.SUBJECTS, options.side],
    options.MANY,
    options.TELLING,
)
def command(
    batch: Batch, settings: GloveApplyConfig, calibration: Path | None, tips: bool
) -> int:
    """Turn a glove's readings into joint angles with sigma.

    Streams may be of any length. Frames with a rotation that is not sure enough are not
    trusted.

    \b
    Example:
        handclean calibrate-glove apply take.csv --calibration glove.h5 -o take.h5
    """
    batch = options.with_files(batch, calibration=calibration)
    chosen = GloveApplying(apply=settings, tips=tips)
    return many.run(work_of("calibrate-glove apply", batch, chosen), batch)
