"""``--subject-for '{parent}/subject.h5'``: where the subject of a take stands.

``{parent}`` is the folder of the take, ``{parent.parent}`` the folder above it,
``{stem}`` the take's name without its suffix, ``{name}`` with it. ``.name`` behind a
folder is the last part of its path: ``subjects/{parent.name}.h5``. Stars and the like
stand for what is there, ``{parent}/subject_*.h5`` for the subjects of both hands.
"""

import glob
import re
from pathlib import Path

from handclean.errors import UnknownSettingError, UsageError

KNOWN = ("parent", "parent.name", "parent.parent", "parent.parent.name", "stem", "name")
"""What may stand between braces; more parents may, too."""

_FIELD = re.compile(r"parent(\.parent)*(\.name)?|stem|name")


def filled(pattern: str, take: Path) -> Path:
    """Return a pattern with what its fields are of a take.

    Raises
    ------
    UsageError
        If the pattern has another field, or a brace without its other.
    """
    return Path(_filled(pattern, take, escaped=False))


def found(pattern: str, take: Path) -> list[Path]:
    """List the files that a pattern names for a take, in the order of their names.

    Raises
    ------
    UsageError
        As `filled`.
    """
    plain = filled(pattern, take)
    if plain.is_file():
        return [plain]
    places = glob.glob(_filled(pattern, take, escaped=True))
    return [path for path in map(Path, sorted(places)) if path.is_file()]


def _filled(pattern: str, take: Path, *, escaped: bool) -> str:
    """Fill in the fields; where they are escaped, no star of a folder is a pattern."""

    def value(match: re.Match[str]) -> str:
        text = _value(match[1], take)
        return glob.escape(text) if escaped else text

    parts = re.split(r"(\{[^{}]*\})", pattern)
    if any("{" in part or "}" in part for part in parts[::2]):
        wrong = "should have a brace } for every {, and no other"
        raise UsageError(wrong, where=f"--subject-for '{pattern}'")
    text = re.sub(r"\{([^{}]*)\}", value, pattern)
    return re.sub("^/+", "/", text)  # of a take in the root folder


def _value(field: str, take: Path) -> str:
    if not _FIELD.fullmatch(field):
        raise UnknownSettingError("--subject-for", "field", field, KNOWN)
    value = take
    for part in field.split("."):
        if part in ("name", "stem"):
            # "." has no name of its own
            return getattr(value, part) or value.absolute().resolve().name
        value = _parent(value)
    return str(value)


def _parent(path: Path) -> Path:
    """The folder above, also above one that is named by a relative path."""
    if path.name in ("", ".."):
        return path / ".." if str(path) != path.anchor else path
    return path.parent
