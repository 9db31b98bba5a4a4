"""``handclean fill-gaps``."""

from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.shared.choices import Filling
from handclean.commands.table import work_of
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("fill-gaps")
@options.settings("fill-gaps", FillConfig)
@options.settings("solve", SolveConfig, prefix="solve", into="solve")
@options.prior
@options.batch(
    options.SOURCES, options.OUTPUT, options.HANDS, options.MANY, options.TELLING
)
def command(
    batch: Batch, settings: FillConfig, solve: SolveConfig, prior: Path | None
) -> int:
    """Fill short gaps in marker trajectories.

    A hand is always needed, as its posture tells what is missing: --subject, or
    --marker-set for the template. Measured samples are never changed, unless --despike
    or --smooth ask for it; filled samples are marked as filled.

    \b
    Example:
        handclean fill-gaps take_07.labels.h5 -o take_07.filled.h5 --subject S01.h5
    """
    chosen = Filling(fill=settings, solve=solve)
    batch = options.with_files(batch, prior=prior)
    return many.run(work_of("fill-gaps", batch, chosen), batch)
