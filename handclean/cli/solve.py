"""``handclean solve``."""

from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.shared.choices import Solving
from handclean.commands.table import work_of
from handclean.ik.settings import SolveConfig
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("solve")
@options.settings("solve", SolveConfig)
@click.option(
    "--per-frame",
    is_flag=True,
    help="Means nothing so far: frame by frame, each from the last, is the only way.",
)
@click.option("--standard", is_flag=True, help="Plain inverse kinematics, no prior.")
@options.prior
@options.batch(
    options.SOURCES, options.OUTPUT, options.HANDS, options.MANY, options.TELLING
)
def command(
    batch: Batch,
    settings: SolveConfig,
    prior: Path | None,
    standard: bool,
    per_frame: bool,
) -> int:
    """Find the joint angles of labelled takes.

    Filled samples are never taken for measured ones.

    \b
    Example:
        handclean solve take_07.filled.h5 -o take_07.angles.h5 --subject S01.h5
    """
    chosen = Solving(solve=settings, standard=standard)
    batch = options.with_files(batch, prior=prior)
    return many.run(work_of("solve", batch, chosen), batch)
