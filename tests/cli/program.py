"""handclean with one more command, ``tally``, that does what its inputs say."""

import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Annotated

import click

sys.path.insert(0, str(Path(__file__).parents[1] / "runner" / "fakes"))

import boxes

from handclean.cli import main as frame
from handclean.cli import options, tables
from handclean.runner import many
from handclean.runner.batch import Batch
from handclean.runner.command import Work
from handclean.settings import Limits, expect_limits


@dataclass(frozen=True, kw_only=True)
class TallyConfig:
    """Settings of ``tally``, one of each kind."""

    method: Annotated[str, "How to count."] = "by hand"
    max_gap_s: Annotated[float, "Longest gap.", Limits(least=0.0, unit="s")] = 0.5
    times: Annotated[int, "How often."] = 1
    aloud: Annotated[bool, "Whether to be heard."] = False
    words: Annotated[tuple[str, ...], "Only these."] = ()
    between: Annotated[tuple[float, float], "From, to."] = (0.0, 1.0)

    def __post_init__(self):
        expect_limits(self)


@click.command("tally")
@options.batch(
    options.SOURCES,
    [*options.OUTPUT[:-1], options.seed],  # it draws
    options.HANDS,
    options.MANY,
    options.TELLING,
)
@options.settings("tally", TallyConfig)
def command(batch: Batch, settings: TallyConfig) -> int:
    """Count words."""
    return many.run(Work.of(boxes.tally(), batch, settings), batch)


module = ModuleType("handclean.cli.tally")
module.command = command
module.TallyConfig = TallyConfig
sys.modules["handclean.cli.tally"] = module

if __name__ == "__main__":
    frame.COMMANDS["tally"] = "Count words."
    tables.TABLES["tally"] = "handclean.cli.tally:TallyConfig"
    sys.exit(frame.main())
