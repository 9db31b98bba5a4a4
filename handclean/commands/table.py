"""All commands, as the runner has to know them; imports nothing heavy."""

from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import Any

from handclean.commands.shared.formats import FORMATS, H5, RECORDINGS
from handclean.commands.shared.needs import Needs
from handclean.io.formats import BY_SUFFIX, HANDS, MESHES, TAKES_READ
from handclean.labels.settings import LEAST_MARKERS
from handclean.runner.batch import Batch
from handclean.runner.command import Check, Command, Work

FIRST_RUN = "first run after an install or update; `handclean warm` does it ahead"
"""Why kernels are compiled, unless machine code that ships should have been loaded."""


def compiling() -> str:
    """Say that kernels are compiled, and why; numba is loaded when this is asked."""
    code = import_module("handclean.kernels.machine_code")
    return f"compiling kernels ({code.why_compiled() or FIRST_RUN}) ..."


SESSION = {H5: "session"}
SUBJECT = {H5: "subject"}
CALIBRATION = {H5: "glove calibration"}
READINGS = (".csv", H5)
"""Suffixes of a data glove's readings."""


def _command(
    name: str,
    suffixes: tuple[str, ...] = (),
    makes: Mapping[str, str] | None = None,
    check: Check | None = None,
    step: str = "",
    reads: Iterable[str] = TAKES_READ,
) -> Command:
    """Make a command, whose step is called as it is unless another is named."""
    module = step or name.replace(" ", "_").replace("-", "_")
    return Command(
        name=name,
        step=f"handclean.commands.{module}",
        formats=FORMATS,
        reads=tuple(reads),
        suffixes=suffixes,
        makes=makes or {},
        check=check or Needs(),
        compiling=compiling,
    )


HAND = Needs(hand=True)
ENOUGH = Needs(hand=True, markers=LEAST_MARKERS)

COMMANDS = {
    command.name: command
    for command in (
        _command("inspect", reads=BY_SUFFIX),
        _command("clean", RECORDINGS, SESSION, ENOUGH),
        _command("label", RECORDINGS, SESSION, ENOUGH),
        _command("fill-gaps", RECORDINGS, SESSION, Needs(marked=True)),
        _command("solve", RECORDINGS, SESSION, HAND),
        _command("calibrate-hand markers", (H5,), SUBJECT, Needs(marker_set=True)),
        _command("calibrate-hand scan", (H5,), SUBJECT),
        _command(
            "calibrate-glove examine",
            (".toml",),
            {".toml": "description of a glove"},
            reads=READINGS,
        ),
        _command(
            "calibrate-glove sample", (H5,), {H5: "glove samples"}, reads=READINGS
        ),
        _command("calibrate-glove fit", (H5,), CALIBRATION, reads=[H5]),
        _command("calibrate-glove rewear", (H5,), CALIBRATION, reads=[H5]),
        _command("calibrate-glove apply", RECORDINGS, SESSION, reads=READINGS),
        _command("learn subspace", (H5,), {H5: "posture prior"}),
        _command("optimize-layout", (".toml",), {".toml": "marker set"}),
        _command("simulate"),
        _command("compare"),
        _command(
            "convert", (*RECORDINGS, *MESHES), reads=(*TAKES_READ, *HANDS, *MESHES)
        ),
    )
}
"""Commands by name. `Command.makes` is left out where what is made depends on what is
read: what was made is looked at in any case."""

JUDGE_LAYOUTS = _command("optimize-layout", step="evaluate_layout", reads=[".toml"])
"""``optimize-layout --evaluate``, which writes nothing."""

JUDGE_FILLERS = _command("fill-gaps", step="evaluate_fillers")
"""``fill-gaps --evaluate``, which writes tables and a plot at most."""


def work_of(name: str, batch: Batch, settings: Any = None) -> Work:
    """Make the work of the command of this name."""
    return Work.of(COMMANDS[name], batch, settings)
