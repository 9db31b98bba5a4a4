"""What kind of file stands somewhere: a file is never replaced by one of another kind.

A subject takes a recording of its own to make again, and a name that is typed wrong
should not cost it.
"""

import csv
from pathlib import Path

from handclean.errors import HandcleanError, UsageError
from handclean.tomltext import parse_toml

SESSION = "handclean session"
SUBJECT = "handclean subject"

MADE_BY = {
    ("clean", ".h5"): SESSION,
    ("label", ".h5"): SESSION,
    ("fill-gaps", ".h5"): SESSION,
    ("solve", ".h5"): SESSION,
    ("calibrate-glove apply", ".h5"): SESSION,
    ("calibrate-hand markers", ".h5"): SUBJECT,
    ("calibrate-hand scan", ".h5"): SUBJECT,
    ("learn subspace", ".h5"): "handclean posture prior",
    ("calibrate-glove sample", ".h5"): "handclean glove samples",
    ("calibrate-glove fit", ".h5"): "handclean glove calibration",
    ("calibrate-glove rewear", ".h5"): "handclean glove calibration",
    ("calibrate-glove examine", ".toml"): "description of a glove",
    ("optimize-layout", ".toml"): "marker set",
}
"""What commands make, where that does not depend on what they read; so that a wrong
place is found before the work is done. What was made is looked at in any case."""

_MOST = 2**22
"""[bytes] no text whose kind is asked for is longer."""


def kind_of(path: Path) -> str:
    """Return what kind of file stands there; "" where nobody can tell."""
    match path.suffix.lower():
        case ".h5":
            return _h5(path)
        case ".toml":
            return _toml(path)
        case ".csv":
            return _csv(path)
    return path.suffix.lower().removeprefix(".").upper()


def expect_same(path: Path, made: str, called: Path) -> None:
    """Expect a file to be of the kind that is to replace it.

    Parameters
    ----------
    made : that kind, "" where it is not known.
    called : what the user calls the file.

    Raises
    ------
    UsageError
        If it is of another.
    """
    stands = kind_of(path)
    if made and stands and made != stands:
        raise UsageError(
            f"is a {_called(stands)}, which a {_called(made)} never replaces; "
            "-o should name another place",
            where=called,
        )


def _called(kind: str) -> str:
    return kind.removeprefix("handclean ")


def _h5(path: Path) -> str:
    from handclean.io.hdf5.file import format_of  # late, so that help is instant

    try:
        return format_of(path)
    except HandcleanError:
        return ""


def _text(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(_MOST).decode("utf-8-sig")


def _toml(path: Path) -> str:
    try:
        found = parse_toml(path, _text(path), "not TOML")
    except (OSError, ValueError, HandcleanError):
        return ""
    for key, kind in (
        ("bone", "joint tree"),
        ("marker", "marker set"),
        ("rotation", "description of a glove"),
    ):
        if key in found:
            return kind
    places = [value for key, value in found.items() if key != "unit"]
    if places and all(isinstance(value, list) for value in places):
        return "list of landmarks"
    return "TOML file of another kind" if found else ""


def _csv(path: Path) -> str:
    try:
        first = _text(path).split("\n", 1)[0].strip()
        cells = [cell.strip() for cell in next(csv.reader([first]), [])]
    except (OSError, ValueError, csv.Error):
        return ""
    if first.startswith("# handclean readings"):
        return "file of a glove's readings"
    return "manifest" if "input" in cells else "table"
