"""``handclean calibrate-hand markers``."""

import click

from handclean.cli import options
from handclean.commands.shared.choices import Calibrating
from handclean.commands.table import work_of
from handclean.runner import many
from handclean.runner.batch import Batch
from handclean.subject.settings import CalibrateConfig


@click.command("markers")
@options.settings("calibrate-hand-markers", CalibrateConfig)
@click.option("--name", default="", help="Whose hand it is.")
@options.batch(
    options.SOURCES,
    options.ONE_OUTPUT,
    [options.subject, options.marker_set, options.one_side],
    options.TELLING,
)
def command(batch: Batch, settings: CalibrateConfig, name: str) -> int:
    """Learn a hand and its markers from labelled range-of-motion takes.

    Filled samples are never used. With --subject, a hand from calibrate-hand scan,
    the first take begins with the hand held still and flat: there the markers are
    found on its skin. Takes that move refine both.

    \b
    Example:
        handclean calibrate-hand markers rom.c3d -o S01.h5 --marker-set maycock26
        handclean calibrate-hand markers flat.c3d rom.c3d --subject scan.h5 \\
            --marker-set maycock26 -o S01.h5
    """
    chosen = Calibrating(calibrate=settings, name=name)
    return many.reduce(work_of("calibrate-hand markers", batch, chosen), batch)
