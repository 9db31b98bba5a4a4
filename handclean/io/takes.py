"""A take of any format, read by its suffix."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handclean.errors import FileError
from handclean.io.formats import HAND, MESH, TAKES_READ, by_suffix, chosen, function
from handclean.io.shared.reading import Reading
from handclean.io.shared.unread import refuse_unread

_INSTEAD = {
    HAND: ("is not read as a take", "convert makes a subject of a skinned hand"),
    MESH: ("is a mesh, not a take", "calibrate-hand scan makes a subject of a scan"),
}
"""What a file that holds no take is, and what reads it."""


def reading_of(path: Path, given: Mapping[str, Any]) -> Reading:
    """Read a take by its suffix, with those of the options that its format takes.

    Raises
    ------
    FileError
        If its suffix is none of a take's, or it cannot be read as what that says.
    UsageError
        If the options contradict it, or rate or unit are needed and not given.
    """
    wanted = by_suffix(path)
    known = " ".join(TAKES_READ)
    if wanted is None:
        refuse_unread(path, known)
    if wanted.holds in _INSTEAD:
        raise FileError(path, *_INSTEAD[wanted.holds])
    if not wanted.read:
        wrong = f"{path.suffix.lower()} files are written for other programs, not read"
        raise FileError(path, wrong, f"readable: {known}")
    found: Reading = function(wanted.read)(path, **chosen(wanted, given))
    return found
