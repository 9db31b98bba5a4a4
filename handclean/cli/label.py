"""``handclean label``."""

from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.table import work_of
from handclean.labels.settings import LabelConfig
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("label")
@options.settings("label", LabelConfig)
@options.prior
@options.batch(
    options.SOURCES, options.OUTPUT, options.HANDS, options.MANY, options.TELLING
)
def command(batch: Batch, settings: LabelConfig, prior: Path | None) -> int:
    """Name the markers of unlabelled takes.

    Nothing measured is changed or lost: points that are no marker stay, unnamed.

    \b
    Example:
        handclean label take_07.c3d -o take_07.labels.h5 --subject S01.h5
    """
    batch = options.with_files(batch, prior=prior)
    return many.run(work_of("label", batch, settings), batch)
