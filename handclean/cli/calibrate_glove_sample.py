"""``handclean calibrate-glove sample``."""

from pathlib import Path

import click

from handclean.cli import completion, glove_options, options
from handclean.commands.shared.choices import GloveSampling
from handclean.commands.table import work_of
from handclean.glove.settings import GloveSampleConfig
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("sample")
@options.settings("calibrate-glove-sample", GloveSampleConfig)
@click.option(
    "--pose",
    default="",
    metavar="NAME",
    shell_complete=completion.poses,
    help="A key pose, or FILE.toml:NAME.",
)
@click.option(
    "--hold",
    multiple=True,
    metavar="JOINT=DEG",
    help="A widget held this rotation, by its or its sensor's name; once per widget.",
)
@click.option(
    "--touch",
    default="",
    metavar="thumb,index",
    shell_complete=completion.touching,
    help="These fingertips touched.",
)
@click.option(
    "--markers", type=options.PATH, metavar="TAKE", help="A solved take of this motion."
)
@click.option(
    "--start",
    type=options.PATH,
    metavar="GLOVE.h5",
    help="Calibration to begin touches from.  [default: linear rescaling]",
)
@glove_options.option
@options.batch(
    [*options.INPUTS, options.rate],
    options.ONE_OUTPUT,
    [options.subject, options.side],
    options.TELLING,
)
def command(
    batch: Batch,
    settings: GloveSampleConfig,
    pose: str,
    hold: tuple[str, ...],
    touch: str,
    markers: Path | None,
    start: Path | None,
    glove: str,
) -> int:
    """Take samples (readings with known rotations) from a glove's readings.

    Those of poses, widgets and markers are FK, good for any wearer; those of touching
    are IK, good for this subject.

    \b
    Example:
        handclean calibrate-glove sample flat.csv --pose flat -o flat.h5
        handclean calibrate-glove sample im20.csv --hold IM_ABD=20 -o im20.h5
    """
    glove_options.expect_h5(batch, "samples")
    batch = options.with_files(batch, markers=markers, start=start)
    batch, name = glove_options.with_glove(batch, glove)
    chosen = GloveSampling(
        sample=settings, pose=pose, holds=hold, touch=touch, glove=name
    )
    return many.reduce(work_of("calibrate-glove sample", batch, chosen), batch)
