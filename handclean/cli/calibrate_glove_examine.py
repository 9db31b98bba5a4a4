"""``handclean calibrate-glove examine``."""

import click

from handclean.cli import glove_options, options
from handclean.commands.shared.choices import GloveExamining
from handclean.commands.table import work_of
from handclean.glove.settings import GloveExamineConfig
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("examine")
@options.settings("calibrate-glove-examine", GloveExamineConfig)
@glove_options.option
@click.option(
    "--moved",
    multiple=True,
    metavar="SENSOR+SENSOR",
    help="Whose joints moved; once per file.  [default: what file or its name says]",
)
@options.batch(
    [*options.INPUTS, options.rate],
    options.ONE_OUTPUT,
    options.TELLING,
)
def command(
    batch: Batch, settings: GloveExamineConfig, glove: str, moved: tuple[str, ...]
) -> int:
    """Find which sensors of a glove are cross-coupled, and their active ranges.

    In each recording some joints move as far as they go, the others are held still;
    each joint should move alone in one of them.

    \b
    Example:
        handclean calibrate-glove examine free-*.csv --glove cyberglove18 -o my.toml
    """
    batch, name = glove_options.with_glove(batch, glove)
    chosen = GloveExamining(examine=settings, glove=name, moved=moved)
    return many.reduce(work_of("calibrate-glove examine", batch, chosen), batch)
