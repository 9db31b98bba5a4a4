"""The record of what made an output, by which a rerun knows it again.

An ``.h5`` carries it inside, as the last entry of ``/provenance``, with a digest of all
its bytes; beside any other output ``OUT`` stands ``OUT.made.json``, which also has the
digest of ``OUT``: a file that was changed afterwards is no longer one that handclean
made.
"""

import hashlib
import json
import math
import os
import stat
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from handclean import __version__
from handclean.errors import FileError, UsageError
from handclean.runner.batch import Source, Task, Work
from handclean.runner.outcome import Entry, Outcome
from handclean.runner.places import files_of, sidecar

SAME = ("command", "version", "code", "settings", "inputs", "seed")
"""What has to be equal for a rerun to be the same.

``code`` is of what ships, so that between two releases too, an output is made anew when
what makes it has changed. Libraries are not part of it: a new numpy is no reason to
clean a thousand takes again, and ``--overwrite`` is there for whoever thinks it is.
"""

PACKAGE = Path(__file__).parents[1]


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


@cache
def code(package: Path = PACKAGE) -> str:
    """Digest of all code and data that ship, by name and content (some 10 ms)."""
    found = hashlib.sha256()
    for path in sorted(package.rglob("*")):
        if path.suffix == ".pyc" or not path.is_file():
            continue
        content = path.read_bytes()
        name = path.relative_to(package).as_posix()
        found.update(f"{name}\0{len(content)}\0".encode())
        found.update(content)
    return found.hexdigest()[:16]


def entry(work: Work, task: Task, digests: Mapping[Path, str]) -> dict[str, Any]:
    """Begin the record of a task: all that decides what its outputs will be."""
    inputs: list[dict[str, Any]] = []
    for source in task.sources:
        for item in _items(source, digests):
            if item["role"] == "input" or item not in inputs:
                inputs.append(item)
    settings = asdict(work.settings) if work.settings is not None else {}
    seed = {} if work.seed is None else {"seed": work.seed}
    return {
        "command": work.command,
        "version": __version__,
        "code": code(),
        "settings": plain(settings),
        "inputs": inputs,
        **seed,
    }


def _items(source: Source, digests: Mapping[Path, str]) -> list[dict[str, Any]]:
    files = files_of(source)
    items: list[dict[str, Any]] = [
        {"role": role.split()[0], "name": _name(path), "sha256": digests[path]}
        for role, path in files.items()
    ]
    if not source.is_file:
        items.insert(0, {"role": "input", "built_in": str(source.path)})
    given = {
        "number": source.number,
        "side": source.side,
        "rate_hz": source.rate_hz,
        "unit": source.unit,
        "lenient": source.lenient or None,
        "believe_coordinates": source.believe_coordinates or None,
        "marker_set": "" if source.marker_set_file else source.marker_set,
    }
    is_given = {name: value for name, value in given.items() if value not in (None, "")}
    items[0].update(is_given)
    return items


def _name(path: Path) -> str:
    """Name of a file for people: bytes that are no UTF-8 as question marks."""
    return os.fsencode(path.name).decode("utf-8", "replace")


def finished(begun: Entry, outcome: Outcome) -> dict[str, Any]:
    """Complete a record with what came out, and when."""
    return {
        **begun,
        "made": made_at(),
        "line": outcome.line,
        "figures": plain(outcome.figures),
        "warnings": list(outcome.warnings),
    }


def same(one: Entry, other: Entry) -> bool:
    """Whether two records would make the same output; names and times apart."""

    def bare(entry: Entry, key: str) -> Any:
        value = entry.get(key)
        if key != "inputs" or not isinstance(value, list):
            return value
        return [{k: v for k, v in item.items() if k != "name"} for item in value]

    return all(bare(one, key) == bare(other, key) for key in SAME)


def of(path: Path) -> tuple[Entry, ...]:
    """Provenance of a file; empty when handclean did not make it as it is now."""
    path = Path(os.path.realpath(path))
    if path.suffix.lower() == ".h5":
        return _inside(path)
    beside = sidecar(path)
    try:
        document = json.loads(beside.read_bytes())
        if document["sha256"] != digest(path):
            return ()
        return _entries(document["provenance"])
    except (OSError, ValueError, KeyError, TypeError, FileError):
        return ()


def behind(path: Path) -> frozenset[str]:
    """Digests of the files that stand in a file's provenance, also if it was edited."""
    place = Path(os.path.realpath(path))
    entries = _inside(place) if place.suffix.lower() == ".h5" else ()
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        entries += _entries(json.loads(sidecar(place).read_bytes())["provenance"])
    items = (item for entry in entries for item in _entries(entry.get("inputs")))
    return frozenset(str(item["sha256"]) for item in items if "sha256" in item)


def is_record(path: Path) -> bool:
    """Whether a file is a record that stands, or stood, beside an output."""
    try:
        document = json.loads(path.read_bytes())
        return bool(document["sha256"]) and bool(_entries(document["provenance"]))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def _inside(path: Path) -> tuple[Entry, ...]:
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


def intact(path: Path) -> bool | None:
    """Whether a file that `of` knows is as it was made; None if it cannot tell.

    Only an ``.h5`` of an older handclean, or of other hands, cannot.
    """
    path = Path(os.path.realpath(path))
    if path.suffix.lower() != ".h5":
        return True  # `of` compared the digest
    from handclean.io.hdf5 import seal  # late, so that help is instant

    try:
        return seal.intact(path)
    except (OSError, FileError):
        return False


def _entries(found: object) -> tuple[Entry, ...]:
    """Take what was read for entries only if that is what it is."""
    if isinstance(found, list) and len(found) == 1 and isinstance(found[0], list):
        return _entries([json.loads(text) for text in found[0]])  # of unlike lengths
    if not isinstance(found, list):
        return ()
    return tuple(found) if all(isinstance(item, dict) for item in found) else ()


def write_sidecar(path: Path, output: Path, provenance: Sequence[Entry]) -> None:
    """Write the record that stands beside an output."""
    document = {"sha256": digest(output), "provenance": list(provenance)}
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def made_at() -> str:
    """Time of now, or of SOURCE_DATE_EPOCH where that is set.

    Raises
    ------
    UsageError
        If SOURCE_DATE_EPOCH is not a number of seconds.
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if epoch is None:
        return datetime.now(UTC).isoformat(timespec="seconds")
    try:
        return datetime.fromtimestamp(int(epoch), UTC).isoformat()
    except (ValueError, OverflowError, OSError):
        raise UsageError(
            f"SOURCE_DATE_EPOCH: should be a number of seconds, not '{epoch}'"
        ) from None


def plain(value: Any) -> Any:
    """Turn a value into what JSON can hold: NaN into null, infinity into a word.

    Raises
    ------
    TypeError
        If it is none of numbers, text, and lists and mappings of them.
    """
    if hasattr(value, "tolist"):  # numpy numbers and arrays
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, str | int | float):
        return value
    raise TypeError(f"{value!r} has no place in JSON")
