"""``handclean tally``, with a step that a worker of a cluster can import."""

import sys
from types import ModuleType

import boxes
import click

from handclean.cli import main as frame
from handclean.cli import options
from handclean.runner import many
from handclean.runner.batch import Batch
from handclean.runner.command import Work


@click.command("tally")
@options.batch(options.SOURCES, options.OUTPUT, options.MANY, options.TELLING)
def command(batch: Batch) -> int:
    """Count words."""
    return many.run(Work.of(boxes.tally(), batch), batch)


if __name__ == "__main__":
    module = ModuleType("handclean.cli.tally")
    module.command = command
    sys.modules["handclean.cli.tally"] = module
    frame.COMMANDS["tally"] = "Count words."
    sys.exit(frame.main())
