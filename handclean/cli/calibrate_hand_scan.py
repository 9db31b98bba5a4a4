"""``handclean calibrate-hand scan``."""

from pathlib import Path

import click

from handclean.cli import options
from handclean.commands.shared.choices import Scanning
from handclean.commands.table import work_of
from handclean.runner import many, progress
from handclean.runner.batch import Batch
from handclean.subject.scan.settings import ScanConfig


@click.command("scan")
@options.settings("calibrate-hand-scan", ScanConfig)
@click.option(
    "--landmarks",
    "marks",
    type=options.PATH,
    metavar="FILE.toml",
    help="Where on the scan the template's landmarks are: name = [x, y, z].",
)
@click.option("--name", default="", help="Whose hand it is.")
@options.batch(
    [options.inputs, options.unit],
    options.ONE_OUTPUT,
    [options.one_side],
    options.TELLING,
)
def command(batch: Batch, settings: ScanConfig, marks: Path | None, name: str) -> int:
    """Learn a hand with its skin from a scan (.ply, .obj, .stl) and landmarks.

    Points without faces are enough; normals and colors are used if there are any.
    The hand is a right one unless --side says otherwise.

    \b
    Example:
        handclean calibrate-hand scan hand.ply --landmarks hand.toml -o S01.h5
    """
    chosen = Scanning(scan=settings, name=name)
    given = options.with_files(batch, landmarks=marks)
    with progress.shown(batch.quiet):
        return many.reduce(work_of("calibrate-hand scan", given, chosen), given)
