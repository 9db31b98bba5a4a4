"""What the runner asks about files: what kind they are, and where their record stands.

An ``.h5`` carries its record inside, the last entry of ``/provenance``, with a digest
of all its bytes. No other format has a place for it.
"""

import csv
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handclean.commands.shared.take_options import options_of
from handclean.errors import FileError, HandcleanError
from handclean.io.formats import TAKES_WRITTEN
from handclean.io.hdf5 import walker
from handclean.remarks import Remark
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry
from handclean.runner.records import Records, entries
from handclean.tomltext import parse_toml

H5 = ".h5"
RECORDINGS = (H5, *(suffix for suffix in TAKES_WRITTEN if suffix != H5))
"""Suffixes a take can be written with, the usual one first."""

_MOST_TEXT_BYTES = 2**22
"""[bytes] no text whose kind is asked for is longer (chosen)."""


@dataclass(frozen=True)
class HandFormats:
    """Answers of the formats that hold hands; the `Formats` of the runner.

    Attributes
    ----------
    usual : suffixes of inputs, the most usual one first.
    """

    usual: tuple[str, ...] = TAKES_WRITTEN

    def kind(self, path: Path) -> str:
        """Return what kind of file stands there; "" where nobody can tell."""
        match path.suffix.lower():
            case ".h5":
                return _kind_of_h5(path)
            case ".toml":
                return _kind_of_toml(path)
            case ".csv":
                return _kind_of_csv(path)
        return path.suffix.lower().removeprefix(".").upper()

    def carries_record(self, path: Path) -> bool:
        """Whether a file of this name has its record inside."""
        return path.suffix.lower() == H5

    def record(self, path: Path) -> tuple[Entry, ...]:
        """Return the record inside a file; empty where there is none to be read."""
        from handclean.io.hdf5 import file as h5  # late, so that help is instant
        from handclean.io.hdf5 import seal

        with suppress(OSError, ValueError, RecursionError):
            told = seal.provenance(path)
            if told is not None and (found := _entries(list(map(json.loads, told)))):
                return found
        try:
            held: Any = h5.read_some(path, ["provenance"]).items["provenance"]
            return _entries([json.loads(text) for text in held])
        except (ValueError, KeyError, TypeError, RecursionError, FileError):
            return ()

    def intact(self, path: Path) -> bool | None:
        """Whether an ``.h5`` is as it was made; None if it has no seal to tell by.

        Those of an older handclean, or of other hands, have none.
        """
        from handclean.io.hdf5 import seal  # late, so that help is instant

        try:
            return seal.intact(path)
        except (OSError, FileError):
            return False

    @contextmanager
    def reading(self, sources: Sequence[Source]) -> Iterator[Sequence[Remark]]:
        """Prepare for a step that reads these; yield what is noted of broken seals."""
        paths = [path for source in sources for path in source.reads.values()]
        if any(map(self.carries_record, paths)):
            walker.start()  # it gets ready while the step is imported
        from handclean.io.hdf5 import seal  # late, so that help is instant

        lenient = any(options_of(source).lenient for source in sources)
        with seal.tolerated(lenient) as broken:
            yield broken


FORMATS = HandFormats()
RECORDS = Records(FORMATS)


def _entries(found: list[Any]) -> tuple[Entry, ...]:
    """Take texts of a record for its entries; of unlike lengths they are one list."""
    if len(found) == 1 and isinstance(found[0], list):
        return _entries([json.loads(text) for text in found[0]])
    return entries(found)


def _kind_of_h5(path: Path) -> str:
    from handclean.io.hdf5.file import format_of  # late, so that help is instant

    try:
        return format_of(path).removeprefix("handclean ")
    except HandcleanError:
        return ""


def _text(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(_MOST_TEXT_BYTES).decode("utf-8-sig")


def _kind_of_toml(path: Path) -> str:
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


def _kind_of_csv(path: Path) -> str:
    try:
        first = _text(path).split("\n", 1)[0].strip()
        cells = [cell.strip() for cell in next(csv.reader([first]), [])]
    except (OSError, ValueError, csv.Error):
        return ""
    if first.startswith("# handclean readings"):
        return "file of a glove's readings"
    return "manifest" if "input" in cells else "table"
