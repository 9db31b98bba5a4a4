"""Options that mean the same for every command, as named objects, and settings.

``@batch(SOURCES, OUTPUT, ...)`` adds groups of them and hands the command one `Batch`.
``@settings("fill-gaps", FillConfig)`` makes an option of every field, puts defaults,
configuration file and options together, and hands the command the settings.
"""

import functools
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from handclean import config
from handclean.cli import checks, completion, setting_options, tables
from handclean.commands.shared.formats import RECORDINGS
from handclean.commands.shared.take_options import TakeOptions
from handclean.runner.batch import Batch
from handclean.settings import settings_of

_NOT_GIVEN = (ParameterSource.DEFAULT, ParameterSource.DEFAULT_MAP)

Function = Callable[..., Any]
Decorator = Callable[[Function], Function]

CONFIG = "handclean.config"
"""Where the click context keeps the configuration file."""

PATH = click.Path(path_type=Path, readable=False)
"""A path that is not looked at here: one that cannot be read fails its own input."""


def _config(
    context: click.Context, parameter: click.Parameter, value: Path | None
) -> None:
    """Check the whole file at once, whichever command it is given to."""
    if value is not None:
        config.check(value, tables.classes())
    context.meta[CONFIG] = value


inputs = click.argument("inputs", nargs=-1, type=PATH, metavar="IN...")
recursive = click.option(
    "--recursive",
    is_flag=True,
    help="Inputs may be folders, for the files below them that the command reads.",
)
manifest = click.option(
    "--manifest",
    metavar="FILE|-",
    shell_complete=completion.files,
    help="More inputs: CSV or TSV with a header (input, output, subject, marker_set, "
    "side), one path per line, or what --json of another command printed; '-' is "
    "stdin.",
)
rate = click.option(
    "--rate",
    "rate_hz",
    type=float,
    callback=checks.positive,
    metavar="HZ",
    help="Frames per second, for files that do not say.",
)
unit = click.option(
    "--unit",
    type=click.Choice(["mm", "cm", "m"]),
    help="Unit of length, for files that do not say; where one says another, this is "
    "taken, with a warning.",
)
lenient = click.option(
    "--lenient", is_flag=True, help="Save what can be saved of a damaged file."
)
believe_coordinates = click.option(
    "--believe-coordinates",
    is_flag=True,
    help="Of a C3D that marks every point as missing, take those with coordinates.",
)
output = click.option(
    "-o",
    "--output",
    metavar="OUT",
    callback=checks.output,
    shell_complete=completion.files,
    help="Where to: a file, whose suffix picks the format, or a folder.",
)
file_format = click.option(
    "--format",
    metavar="SUFFIX",
    callback=checks.suffix,
    shell_complete=completion.suffixes,
    help=f"Format of the files in a folder.  [default: {RECORDINGS[0]}]",
)
overwrite = click.option(
    "--overwrite",
    is_flag=True,
    help="Make every output anew and replace files handclean did not make.",
)
seed = click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of everything random.",
)
no_seed = click.option(
    "--seed",
    type=click.IntRange(min=0),
    hidden=True,
    callback=lambda context, parameter, value: None,
    help="Of nothing, as nothing random is drawn; scripts that give it go on.",
)
subject = click.option(
    "--subject",
    "subjects",
    multiple=True,
    type=PATH,
    metavar="FILE",
    help="Whose hand it is; once per hand.",
)
subject_for = click.option(
    "--subject-for",
    multiple=True,
    metavar="PATTERN",
    help="Whose hand each take is, by its place: '{parent}/subject.h5' or "
    "'subjects/{parent.name}.h5'; {stem} is the take's name. Once per hand.",
)
marker_set = click.option(
    "--marker-set",
    default="",
    metavar="NAME|FILE",
    shell_complete=completion.marker_sets,
    help="Where the markers sit on the hand.",
)
side = click.option(
    "--side",
    type=click.Choice(["left", "right", "both"]),
    help="Which hand it is. So far 'both' means no more than that there should be a "
    "--subject of each.",
)
one_side = click.option(
    "--side",
    type=click.Choice(["left", "right"]),
    help="Which hand it is.",
)
jobs = click.option(
    "-j",
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Inputs at a time.  [default: SLURM_CPUS_PER_TASK, else 1]",
)
scheduler = click.option(
    "--scheduler",
    default="",
    metavar="ADDRESS",
    help="Let workers of a Dask cluster do it: tcp://host:8786, or the file that its "
    "scheduler wrote.",
)
shard = click.option(
    "--shard",
    default="",
    metavar="I/N",
    help="Only every N-th input, from the I-th (from 1).",
)
fail_fast = click.option(
    "--fail-fast/--keep-going",
    default=False,
    help="Begin nothing more once an input failed, or go on.  [default: go on]",
)
failed = click.option(
    "--failed", type=PATH, metavar="FILE", help="List the failed inputs as a manifest."
)
require = click.option(
    "--require",
    multiple=True,
    metavar='"NAME<=VALUE"',
    help="Exit with 3 unless this figure of every input is so.",
)
as_json = click.option(
    "--json", is_flag=True, help="On stdout, one JSON object per input."
)
quiet = click.option("-q", "--quiet", is_flag=True, help="No warnings, no progress.")
verbose = click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Tell on stderr what each step took [s], and where one failed.",
)
config_path = click.option(
    "-c",
    "--config",
    type=PATH,
    metavar="FILE.toml",
    expose_value=False,
    callback=_config,
    help="Settings; a table for each command.",
)

prior = click.option(
    "--prior",
    type=PATH,
    metavar="FILE",
    help="Posture prior.  [default: the one that ships]",
)

READING = (rate, unit, lenient, believe_coordinates)
INPUTS = (inputs, recursive, manifest)
SOURCES = (*INPUTS, *READING)
OUTPUT = (output, file_format, overwrite, no_seed)
ONE_OUTPUT = (output, overwrite, no_seed)
ONE_DRAWN_OUTPUT = (output, overwrite, seed)
SUBJECTS = (subject, subject_for)
HANDS = (*SUBJECTS, marker_set, side)
MANY = (jobs, scheduler, shard, fail_fast, failed)
TELLING = (require, as_json, quiet, verbose, config_path)


def batch(*groups: Sequence[Decorator]) -> Decorator:
    """Add groups of options; the command receives them as one ``batch``."""
    own = {field.name for field in fields(Batch)}
    of_takes = {field.name for field in fields(TakeOptions)}

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def wrapper(**given: Any) -> Any:
            values = {name: given.pop(name) for name in own & given.keys()}
            told = {name: given.pop(name) for name in of_takes & given.keys()}
            values["config"] = click.get_current_context().meta.get(CONFIG)
            values = {k: v for k, v in values.items() if v is not None or k == "seed"}
            takes = TakeOptions(**{k: v for k, v in told.items() if v is not None})
            return function(batch=Batch(given=takes, **values), **given)

        return _add(wrapper, [option for group in groups for option in group])

    return decorate


def with_files(batch: Batch, **given: Path | None) -> Batch:
    """Add further files that the step reads, by what they are."""
    files = {role: path for role, path in given.items() if path is not None}
    return replace(batch, files={**batch.files, **files})


def settings(
    table: str,
    cls: type[Any],
    /,
    *,
    prefix: str = "",
    into: str = "settings",
    beneath: str = "",
    bare: bool = False,
) -> Decorator:
    """Add an option for every setting; the command receives them as ``into``.

    An option that stands on the command line beats every file, also where it says what
    is the default anyway. Names that settings had are options, too, which help hides.
    The command needs the group ``TELLING``, which has ``--config``.

    Parameters
    ----------
    prefix : comes before the options of one of several settings of a command: "fill"
        makes ``--fill-max-gap-s`` of ``max_gap_s``.
    bare : whether the option without the prefix works, too; help hides it.
    beneath : parameter of the command that has a ``layer`` of settings of its own;
        configuration file and options beat it.
    """
    start = f"{prefix}_" if prefix else ""
    found = settings_of(cls)
    known = {start + setting.name: setting for setting in found}
    hidden = {start + one.former: one for one in found if one.former}
    if bare:
        hidden |= {setting.name: setting for setting in found}

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def wrapper(**given: Any) -> Any:
            context = click.get_current_context()
            options = {name: given.pop(name) for name in known | hidden}
            values = {
                name.removeprefix(start): value
                for name, value in options.items()
                if context.get_parameter_source(name) not in _NOT_GIVEN
            }
            layer = given[beneath].layer if beneath else None
            path = context.meta[CONFIG]
            loaded: Any = config.load(path, table, cls, layer, **values)
            return function(**{into: loaded}, **given)

        shown = [setting_options.option(*item) for item in known.items()]
        shown += [setting_options.option(*one, hidden=True) for one in hidden.items()]
        return _add(wrapper, shown)

    return decorate


def _add(function: Function, parameters: Sequence[Decorator]) -> Function:
    """Add parameters so that help shows them in this order."""
    for parameter in reversed(parameters):
        function = parameter(function)
    return function
