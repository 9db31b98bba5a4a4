"""Takes as steps read them and hand them back."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from handclean.commands.shared.formats import RECORDS
from handclean.commands.shared.take_options import options_of
from handclean.hand.subject import Subject
from handclean.hand.surface import Surface
from handclean.io import files
from handclean.recording import Recording
from handclean.remarks import Remark
from handclean.runner import read_remarks
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome, Writer
from handclean.runner.steps import step


def read(source: Source) -> Recording:
    """Read a take, and what made it where that stands in a file beside it.

    What is odd about it is told should the task fail, see `remember`.

    Raises
    ------
    HandcleanError
        If it cannot be read as what it claims to be.
    """
    options = options_of(source)
    with step("read"):
        recording = files.read(
            source.path,
            rate_hz=options.rate_hz,
            unit=options.unit,
            lenient=options.lenient,
            believe_coordinates=options.believe_coordinates,
        )
    remember(source, recording)
    if recording.provenance:
        return recording
    return replace(recording, provenance=RECORDS.of(source.path))


def remember(source: Source, recording: Recording) -> Recording:
    """Return a take; what is odd about it is told should the task fail."""
    read_remarks.note(source.path, recording.remarks)
    return recording


def is_overruled(recording: Recording) -> bool:
    """Whether ``--unit`` was taken where the file that was read says another."""
    return any("overruled" in one.data for one in recording.remarks)


def outcome(
    recording: Recording,
    line: str,
    figures: Mapping[str, Any],
    more: tuple[Remark, ...] = (),
    surfaces: Mapping[str, Surface] | None = None,
    *,
    unnamed: bool = False,
    bvh_up: str = "+y",
) -> Outcome:
    """Hand back a take to be written, its hands with skins where they have some.

    Parameters
    ----------
    more : remarks beside those that the take has.
    unnamed : write points without a name into a TRC, too.
    bvh_up : axis that points up in a BVH.
    """
    recording = replace(recording, remarks=(*recording.remarks, *more))
    return Outcome(
        line=line,
        figures=figures,
        remarks=recording.remarks,
        writers=(writer(recording, surfaces=surfaces, unnamed=unnamed, bvh_up=bvh_up),),
        history=tuple(recording.provenance),
    )


def surfaces(found: Mapping[str, Subject]) -> dict[str, Surface]:
    """Return the skins of subjects that have their own."""
    return {
        name: subject.surface
        for name, subject in found.items()
        if subject.surface is not None
    }


def writer(
    recording: Recording,
    *,
    silent: bool = False,
    surfaces: Mapping[str, Surface] | None = None,
    unnamed: bool = False,
    bvh_up: str = "+y",
) -> Writer:
    """Make what writes a take, in the format of the path it is given.

    Parameters
    ----------
    surfaces : skins of its hands, for formats that show them.
    silent : do not tell what the format cannot keep.
    unnamed : write points without a name into a TRC, too.
    bvh_up : axis that points up in a BVH.
    """

    def write(path: Path, provenance: tuple[Entry, ...]) -> tuple[Remark, ...]:
        take = replace(recording, provenance=provenance)
        lost = files.write(
            path, take, surfaces=surfaces, unnamed=unnamed, bvh_up=bvh_up
        )
        return () if silent else lost

    return write
