"""Remarks on the takes that a task read, for its report should it fail.

A step that is done hands back remarks of its own. One that fails hands back nothing:
hence what its reader found is noted here as the take is read.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from handclean.remarks import Remark

Noted = dict[Path | None, tuple[Remark, ...]]
"""Remarks by the file that was read; None for those on several files."""

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


def note(path: Path | None, remarks: Sequence[Remark]) -> None:
    """Note remarks on a file; a file that is read again has the later ones."""
    noted = _NOTED.get()
    if noted is not None and remarks:
        noted[path] = tuple(remarks)


def all_of(noted: Noted) -> tuple[Remark, ...]:
    """Return all remarks that were noted, each once."""
    return tuple(dict.fromkeys(one for some in noted.values() for one in some))
