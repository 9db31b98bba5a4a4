"""Which sensors of a glove are cross-coupled."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from handclean.commands.shared import glove_sources
from handclean.commands.shared.choices import GloveExamining
from handclean.errors import FileError, UsageError
from handclean.glove import examine
from handclean.glove.definitions import to_toml
from handclean.glove.gloves import Glove, with_coupling
from handclean.io.shared.writing import write_lines
from handclean.remarks import Remark, remark
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome

FIGURES = {
    "glove": "its name",
    "coupled": "measuring sensors to those that affect them",
    "effects": "sensor, who moved, sd and largest deviation in % of the active range",
    "reading": "readings at the ends of each sensor's active range",
}

_MOVED = re.compile(r"free-([^/]+)$")


def calibrate_glove_examine(
    sources: tuple[Source, ...], settings: GloveExamining
) -> Outcome:
    """Find cross-coupled sensors in recordings in which some joints moved alone."""
    if settings.moved and len(settings.moved) != len(sources):
        raise UsageError(
            f"--moved: is given {len(settings.moved)} times for {len(sources)} files; "
            "give it once for each, in their order"
        )
    glove = glove_sources.glove_of(sources[0], settings.glove)
    named = settings.moved or ("",) * len(sources)
    recordings = [
        _recording(source, glove, given)
        for source, given in zip(sources, named, strict=True)
    ]
    found = examine.examine(
        glove, recordings, settings.examine.coupled_sd, settings.examine.coupled_most
    )
    new = with_coupling(
        glove,
        found.affected,
        found.reading,
        f"{glove.source}; examined by {len(sources)} recordings",
    )

    def write(path: Path, _: tuple[Entry, ...]) -> None:
        write_lines(path, to_toml(new).splitlines())

    coupled = {sensor: list(by) for sensor, by in found.affected.items() if by}
    rows = [_row(effect) for effect in found.effects]
    return Outcome(
        line=_line(coupled, len(found.reading)),
        details=_details(rows),
        figures={
            "glove": glove.name,
            "coupled": coupled,
            "effects": rows,
            "reading": {k: list(v) for k, v in found.reading.items()},
        },
        remarks=_remarks(found),
        writers=(write,),
    )


def _recording(source: Source, glove: Glove, named: str) -> examine.Moved:
    """Read a recording and whose joints moved in it: as named, or as it says itself."""
    found, _, readings = glove_sources.whole(source, glove)
    given = named or found.facts.get("moved", "")
    if not given and (match := _MOVED.search(source.path.stem)):
        given = match[1]
    names = re.split(r"[+, ]+", given) if isinstance(given, str) else given
    moved = tuple(str(name) for name in names if name)
    if not moved:
        raise FileError(
            source.path,
            "does not say whose joints moved",
            "give --moved I_MCP+M_MCP, or call it free-I_MCP+M_MCP.csv",
        )
    return examine.Moved(where=source.path, sensors=moved, readings=readings)


def _row(effect: examine.Effect) -> dict[str, Any]:
    """Figures of one effect."""
    return {
        "sensor": effect.sensor,
        "by": "+".join(effect.by),
        "sd_percent": round(100 * effect.sd, 1),
        "max_percent": round(100 * effect.most, 1),
        "coupled": effect.coupled,
    }


def _line(coupled: Mapping[str, Sequence[str]], examined: int) -> str:
    words = ", ".join(
        f"{sensor} (by {', '.join(by)})" for sensor, by in coupled.items()
    )
    line = f"{len(coupled)} of {examined} sensors are coupled"
    return f"{line}: {words}" if words else line


def _details(rows: Sequence[Mapping[str, Any]]) -> str:
    """One line for each effect that is coupling."""
    return "\n".join(
        f"{r['sensor']:>10} by {r['by']:<14} sd {r['sd_percent']:5.1f} %, "
        f"most {r['max_percent']:5.1f} %"
        for r in rows
        if r["coupled"]
    )


def _remarks(found: examine.Examination) -> tuple[Remark, ...]:
    if not found.unknown:
        return ()
    text = (
        f"{', '.join(found.unknown)} never moved alone: what affects them "
        "stays as it was"
    )
    return (remark("unobserved", text, sensors=list(found.unknown)),)
