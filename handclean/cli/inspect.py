"""``handclean inspect``."""

import click

from handclean.cli import options
from handclean.commands.shared.choices import Inspecting
from handclean.commands.table import work_of
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("inspect")
@click.option(
    "--verify",
    is_flag=True,
    help="Read a C3D with the c3d package, too, and say where the two differ.",
)
@options.batch(options.SOURCES, [options.no_seed], options.MANY, options.TELLING)
def command(batch: Batch, verify: bool) -> int:
    """Say what is in a file and what is odd about it.

    A file that is damaged is read as far as it goes. With --verify the exit status is
    1 where the c3d package reads something else than handclean. A file that it cannot
    read is no difference: a line says so, and the exit status is 0.

    \b
    Example:
        handclean inspect take_07.c3d
        handclean inspect --verify take_07.c3d
    """
    chosen = Inspecting(verify=True) if verify else None
    return many.run(work_of("inspect", batch, chosen), batch)
