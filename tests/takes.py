"""Sources and batches of which options of takes are said, as on a command line."""

from dataclasses import fields

from handclean.commands.shared.take_options import TakeOptions
from handclean.runner.batch import Batch, Source

OF_TAKES = {field.name for field in fields(TakeOptions)}


def take_source(**given):
    """Make a `Source`; options of takes become what is given of it."""
    return Source(**_parted(given))


def take_batch(**given):
    """Make a `Batch`; options of takes become what is given of all its inputs."""
    return Batch(**_parted(given))


def _parted(given):
    takes = {name: value for name, value in given.items() if name in OF_TAKES}
    rest = {name: value for name, value in given.items() if name not in OF_TAKES}
    return {"given": TakeOptions(**takes), **rest}
