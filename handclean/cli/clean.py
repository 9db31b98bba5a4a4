"""``handclean clean``."""

from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.shared.choices import Cleaning
from handclean.commands.table import work_of
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.labels.settings import LabelConfig
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("clean")
@options.settings("label", LabelConfig, prefix="label", into="label", bare=True)
@options.settings("fill-gaps", FillConfig, prefix="fill", into="fill", bare=True)
@options.settings("solve", SolveConfig, prefix="solve", into="solve", bare=True)
@options.prior
@options.batch(
    options.SOURCES, options.OUTPUT, options.HANDS, options.MANY, options.TELLING
)
def command(
    batch: Batch,
    label: LabelConfig,
    fill: FillConfig,
    solve: SolveConfig,
    prior: Path | None,
) -> int:
    """Label, fill gaps and solve unlabelled takes in one pass.

    \b
    Example:
        handclean clean take_07.c3d -o take_07.h5 --subject S01.h5
    """
    chosen = Cleaning(label=label, fill=fill, solve=solve)
    batch = options.with_files(batch, prior=prior)
    return many.run(work_of("clean", batch, chosen), batch)
