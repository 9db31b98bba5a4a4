"""What was odd about the takes that a task read, for its report should it fail.

A step that is done hands back warnings of its own. One that fails hands back nothing:
hence what its reader found is noted here as the take is read.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

Noted = dict[Path | None, tuple[str, ...]]
"""Lines by the file they are about; None where they name it themselves."""

_NOTED: ContextVar[Noted | None] = ContextVar("noted", default=None)


@contextmanager
def collected() -> Iterator[Noted]:
    """Within, what is noted is added to the mapping that this yields."""
    noted: Noted = {}
    token = _NOTED.set(noted)
    try:
        yield noted
    finally:
        _NOTED.reset(token)


def note(path: Path | None, lines: Sequence[str]) -> None:
    """Note what is odd about a file; a file that is read again has the later lines."""
    noted = _NOTED.get()
    if noted is not None and lines:
        noted[path] = tuple(lines)


def told(noted: Noted, only: Path | None) -> tuple[str, ...]:
    """Return all lines that were noted, each by its file but those of ``only``."""
    return tuple(
        line if path in (None, only) else f"{path}: {line}"
        for path, lines in noted.items()
        for line in lines
    )
