"""Takes as steps read them and hand them back."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from handclean.io import files
from handclean.pipeline import record
from handclean.pipeline.batch import Source
from handclean.pipeline.outcome import Entry, Outcome, Writer
from handclean.recording import Recording


def read(source: Source) -> Recording:
    """Read a take, and what made it where that stands in a file beside it.

    Raises
    ------
    HandcleanError
        If it cannot be read as what it claims to be.
    """
    recording = files.read(
        source.path, rate_hz=source.rate_hz, unit=source.unit, lenient=source.lenient
    )
    if recording.provenance:
        return recording
    return replace(recording, provenance=record.of(source.path))


def traps(source: Source, recording: Recording) -> tuple[str, ...]:
    """Say what was odd about a file that was read; a session was warned of before."""
    if source.path.suffix.lower() == ".h5":
        return ()
    whole = (0, recording.frames)
    return tuple(e.text for e in recording.events if (e.start, e.stop) == whole)


def outcome(
    recording: Recording,
    line: str,
    figures: Mapping[str, Any],
    warnings: tuple[str, ...] = (),
) -> Outcome:
    """Hand back a take to be written."""
    return Outcome(
        line=line,
        figures=figures,
        warnings=warnings,
        writers=(writer(recording),),
        history=tuple(recording.provenance),
    )


def writer(recording: Recording, *, silent: bool = False) -> Writer:
    """Make what writes a take, in the format of the path it is given.

    Parameters
    ----------
    silent : do not tell what the format cannot keep.
    """

    def write(path: Path, provenance: tuple[Entry, ...]) -> tuple[str, ...]:
        lost = files.write(path, replace(recording, provenance=provenance))
        return () if silent else lost

    return write
