"""The option that says which glove it is."""

from pathlib import Path

import click

from handclean.cli import completion, options
from handclean.errors import UsageError
from handclean.runner.batch import Batch

option = click.option(
    "--glove",
    default="",
    metavar="NAME|FILE.toml",
    shell_complete=completion.gloves,
    help="Which glove it is.  [default: the one the readings name]",
)


def with_glove(batch: Batch, glove: str) -> tuple[Batch, str]:
    """Put a glove's file among the files that are read; return a name otherwise."""
    if glove.endswith(".toml"):
        return options.with_files(batch, glove=Path(glove)), ""
    return batch, glove


def expect_h5(batch: Batch, what: str) -> None:
    """Expect an output that can hold samples or calibrations.

    Raises
    ------
    UsageError
        If it is called otherwise.
    """
    suffix = Path(batch.output or "").suffix.lower()
    if suffix not in ("", ".h5"):
        raise UsageError(f"-o {batch.output}: {what} are .h5 files, not {suffix}")
