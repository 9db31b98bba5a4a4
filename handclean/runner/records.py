"""Where the record of a file stands: inside it, or beside it.

A file whose format has a place for its record carries it inside. Beside any other
output ``OUT`` stands ``OUT.made.json``, which also has the digest of ``OUT``: a file
that was changed afterwards is no longer one that handclean made. Which formats those
are, the runner is told by an object with the methods of `Formats`.
"""

import hashlib
import json
import os
import stat
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from handclean.errors import FileError
from handclean.remarks import Remark
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry


class Formats(Protocol):
    """What the runner asks about files, of whose formats it knows nothing."""

    @property
    def usual(self) -> tuple[str, ...]:
        """Suffixes of inputs, the most usual one first."""
        ...

    def kind(self, path: Path) -> str:
        """What people call such a file: "table"; "" where nobody can tell."""
        ...

    def carries_record(self, path: Path) -> bool:
        """Whether a file of this name has its record inside."""
        ...

    def record(self, path: Path) -> tuple[Entry, ...]:
        """Return the record inside a file; empty where there is none to be read."""
        ...

    def intact(self, path: Path) -> bool | None:
        """Whether a file with a record inside is as it was made; None if unknown."""
        ...

    def reading(
        self, sources: Sequence[Source]
    ) -> AbstractContextManager[Sequence[Remark]]:
        """Prepare for a step that reads these; yield what is noted of damaged files."""
        ...


@dataclass(frozen=True)
class Records:
    """The records of files, each where its format has it."""

    formats: Formats

    def of(self, path: Path) -> tuple[Entry, ...]:
        """Provenance of a file; empty when handclean did not make it as it is now."""
        path = Path(os.path.realpath(path))
        if self.formats.carries_record(path):
            return self.formats.record(path)
        return beside(path)

    def behind(self, path: Path) -> frozenset[str]:
        """Digests of files that stand in a file's provenance, also if it was edited."""
        place = Path(os.path.realpath(path))
        known: tuple[Entry, ...] = ()
        if self.formats.carries_record(place):
            known = self.formats.record(place)
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            known += entries(json.loads(sidecar(place).read_bytes())["provenance"])
        items = (item for entry in known for item in entries(entry.get("inputs")))
        return frozenset(str(item["sha256"]) for item in items if "sha256" in item)

    def intact(self, path: Path) -> bool | None:
        """Whether a file that `of` knows is as it was made; None if it cannot tell."""
        path = Path(os.path.realpath(path))
        if self.formats.carries_record(path):
            return self.formats.intact(path)
        return True  # `of` compared the digest

    def beside(self, path: Path) -> tuple[Path, ...]:
        """Where the record beside a file stands; nowhere if it carries it inside."""
        return () if self.formats.carries_record(path) else (sidecar(path),)

    def with_theirs(self, paths: Iterable[Path]) -> list[Path]:
        """List files, each once, with the records that stand beside them."""
        return [
            part for path in dict.fromkeys(paths) for part in (path, *self.beside(path))
        ]


def sidecar(path: Path) -> Path:
    """Where the record of an output stands that cannot carry it itself."""
    return path.with_name(path.name + ".made.json")


def beside(path: Path) -> tuple[Entry, ...]:
    """Return the record beside a file; empty where none is of the file as it is."""
    path = Path(os.path.realpath(path))
    try:
        document = json.loads(sidecar(path).read_bytes())
        if document["sha256"] != digest(path):
            return ()
        return entries(document["provenance"])
    except (OSError, ValueError, KeyError, TypeError, FileError):
        return ()


def is_record(path: Path) -> bool:
    """Whether a file is a record that stands, or stood, beside an output."""
    try:
        document = json.loads(path.read_bytes())
        return bool(document["sha256"]) and bool(entries(document["provenance"]))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def entries(found: object) -> tuple[Entry, ...]:
    """Take what was read for entries only if that is what it is."""
    if not isinstance(found, list):
        return ()
    return tuple(found) if all(isinstance(item, dict) for item in found) else ()


def write_sidecar(path: Path, output: Path, provenance: Sequence[Entry]) -> None:
    """Write the record that stands beside an output."""
    document = {"sha256": digest(output), "provenance": list(provenance)}
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def digest(path: Path) -> str:
    """SHA-256 of a file's bytes.

    Raises
    ------
    FileError
        If there is no such file, it is a folder or a device, or cannot be read.
    """
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise FileError(path, "is a folder", "name the files in it")
        if not stat.S_ISREG(mode):
            raise FileError(path, "is not a regular file")
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError:
        raise FileError(path, "no such file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(path, f"cannot be read: {reason.lower()}") from None
