"""``handclean fill-gaps``."""

from functools import partial
from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.shared.choices import (
    EVALUATION_PLOT,
    EVALUATION_ROWS,
    EVALUATION_TABLE,
    Filling,
    JudgingFillers,
)
from handclean.commands.table import JUDGE_FILLERS, work_of
from handclean.errors import UsageError
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.report.filler_errors import expect_plot
from handclean.runner import many, plan, progress
from handclean.runner.batch import Batch
from handclean.runner.command import Work

FILES = (EVALUATION_ROWS, EVALUATION_TABLE, EVALUATION_PLOT)


@click.command("fill-gaps")
@options.settings("fill-gaps", FillConfig)
@options.settings("solve", SolveConfig, prefix="solve", into="solve")
@options.prior
@click.option(
    "--evaluate",
    is_flag=True,
    help="Fill nothing: cut gaps where nothing is missing and judge all fillers (with "
    "--method that one) beside the ridge; -o is a folder for tables and a plot.",
)
@click.option(
    "--plot",
    type=options.PATH,
    metavar="FILE",
    help="With --evaluate: errors by length of gaps (.png .pdf .svg).",
)
@options.batch(
    options.SOURCES, options.OUTPUT, options.HANDS, options.MANY, options.TELLING
)
def command(
    batch: Batch,
    settings: FillConfig,
    solve: SolveConfig,
    prior: Path | None,
    evaluate: bool,
    plot: Path | None,
) -> int:
    """Fill gaps in marker trajectories, or judge what fills them.

    Markers are filled from each other, as the take shows that they go together, as far
    as the error to expect allows; --subject, or --marker-set for the template, adds a
    hand's posture. Measured samples are never changed, unless --despike or --smooth ask
    for it; filled samples are marked as filled.

    \b
    Example:
        handclean fill-gaps take_07.labels.h5 -o take_07.filled.h5 --subject S01.h5
        handclean fill-gaps --evaluate take_07.labels.h5 -o judged/
    """
    batch = options.with_files(batch, prior=prior)
    if evaluate:
        return _evaluate(batch, settings, solve, plot)
    if plot is not None:
        raise UsageError("--plot: is for --evaluate")
    chosen = Filling(fill=settings, solve=solve)
    return many.run(work_of("fill-gaps", batch, chosen), batch)


def _evaluate(
    batch: Batch, settings: FillConfig, solve: SolveConfig, plot: Path | None
) -> int:
    if batch.format:
        raise UsageError("--format: is for filled takes; --evaluate fills nothing")
    beside = [] if plot is None else [plot]
    for path in beside:
        expect_plot(path)
    written = FILES if batch.output is not None else ()
    chosen = JudgingFillers(
        fill=settings,
        solve=solve,
        method=settings.method if _is_chosen(settings) else "",
        written=(*written, *(path.name for path in beside)),
    )
    work = Work.of(JUDGE_FILLERS, batch, chosen)
    planned = partial(plan.in_folders, names=written, beside=beside)
    with progress.shown(batch.quiet):
        return many.run(work, batch, planned)


def _is_chosen(settings: FillConfig) -> bool:
    """Whether a method was asked for, on the command line or in a file."""
    given = click.get_current_context().get_parameter_source("method")
    on_line = given is click.core.ParameterSource.COMMANDLINE
    return on_line or settings.method != FillConfig().method
