"""Which sensors of a glove are cross-coupled."""

import re
from pathlib import Path

from handclean.commands.shared import glove_files
from handclean.commands.shared.choices import GloveExamining
from handclean.errors import FileError, UsageError
from handclean.glove import examine
from handclean.glove.definitions import to_toml
from handclean.glove.gloves import with_coupling
from handclean.io.shared.writing import write_lines
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
    """Look at recordings in which some joints moved and the others did not."""
    if settings.moved and len(settings.moved) != len(sources):
        raise UsageError(
            f"--moved: is given {len(settings.moved)} times for {len(sources)} files; "
            "give it once for each, in their order"
        )
    glove = glove_files.glove_of(sources[0], settings.glove)
    recordings = []
    for k, source in enumerate(sources):
        found, _, readings = glove_files.whole(source, glove)
        given = settings.moved[k] if settings.moved else found.facts.get("moved", "")
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
        recordings.append(
            examine.Moved(where=source.path, sensors=moved, readings=readings)
        )
    found_out = examine.examine(
        glove, recordings, settings.examine.coupled_sd, settings.examine.coupled_most
    )
    new = with_coupling(
        glove,
        found_out.affected,
        found_out.reading,
        f"{glove.source}; examined by {len(sources)} recordings",
    )

    def write(path: Path, _: tuple[Entry, ...]) -> None:
        write_lines(path, to_toml(new).splitlines())

    coupled = {s: list(by) for s, by in found_out.affected.items() if by}
    warnings = []
    if found_out.unknown:
        warnings.append(
            f"{', '.join(found_out.unknown)} never moved alone: what affects them "
            "stays as it was"
        )
    rows = [
        {
            "sensor": e.sensor,
            "by": "+".join(e.by),
            "sd_percent": round(100 * e.sd, 1),
            "max_percent": round(100 * e.most, 1),
            "coupled": e.coupled,
        }
        for e in found_out.effects
    ]
    details = "\n".join(
        f"{r['sensor']:>10} by {r['by']:<14} sd {r['sd_percent']:5.1f} %, "
        f"most {r['max_percent']:5.1f} %"
        for r in rows
        if r["coupled"]
    )
    words = ", ".join(f"{s} (by {', '.join(by)})" for s, by in coupled.items())
    return Outcome(
        line=f"{len(coupled)} of {len(found_out.reading)} sensors are coupled"
        + (f": {words}" if words else ""),
        details=details,
        figures={
            "glove": glove.name,
            "coupled": coupled,
            "effects": rows,
            "reading": {k: list(v) for k, v in found_out.reading.items()},
        },
        warnings=tuple(warnings),
        writers=(write,),
    )
