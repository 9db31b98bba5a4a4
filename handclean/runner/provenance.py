"""What is recorded of how an output was made, by which a rerun knows it again.

It is the last entry of the output's provenance, after those of what was read. Where
that stands is the affair of `records`.
"""

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from handclean import __version__
from handclean.errors import UsageError
from handclean.remarks import Remark, from_json, remark
from handclean.runner.batch import Source, Task
from handclean.runner.command import Work
from handclean.runner.outcome import Entry

SAME = ("command", "version", "code", "settings", "inputs", "seed")
"""What has to be equal for a rerun to be the same.

``code`` is of what ships, so that between two releases too, an output is made anew when
what makes it has changed. Libraries are not part of it: a new numpy is no reason to
clean a thousand takes again, and ``--overwrite`` is there for whoever thinks it is.
"""

PACKAGE = Path(__file__).parents[1]


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
    return begin(work.command.name, settings, inputs, work.seed)


def begin(
    command: str,
    settings: Mapping[str, Any],
    inputs: Sequence[Mapping[str, Any]],
    seed: int | None = None,
) -> dict[str, Any]:
    """Begin a record.

    Parameters
    ----------
    command : its name, "fill-gaps".
    settings : by name, what `plain` takes.
    inputs : what was read, each with its role and what tells it from others.
    seed : of everything random; None where nothing is drawn.
    """
    return {
        "command": command,
        "version": __version__,
        "code": code(),
        "settings": plain(settings),
        "inputs": list(inputs),
        **({} if seed is None else {"seed": seed}),
    }


def _items(source: Source, digests: Mapping[Path, str]) -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = [
        {"role": role.split()[0], "name": _name(path), "sha256": digests[path]}
        for role, path in source.reads.items()
    ]
    if not source.is_file:
        items.insert(0, {"role": "input", "built_in": str(source.path)})
    given = {"number": source.number, **source.given.record()}
    is_given = {name: value for name, value in given.items() if value not in (None, "")}
    items[0].update(is_given)
    return items


def _name(path: Path) -> str:
    """Name of a file for people: bytes that are no UTF-8 as question marks."""
    return os.fsencode(path.name).decode("utf-8", "replace")


def finished(
    begun: Entry,
    figures: Mapping[str, Any],
    remarks: Sequence[Remark],
    *,
    line: str = "",
    about: Path | None = None,
) -> dict[str, Any]:
    """Complete a record with what came out, and when.

    Parameters
    ----------
    figures : by name, what `plain` takes.
    line : what was done, in a few words.
    about : the file that the texts of remarks need not name.
    """
    done = {
        **begun,
        "made": made_at(),
        **({"line": line} if line else {}),
        "figures": plain(figures),
        "warnings": [],
        "remarks": [],
    }
    return with_remarks(done, remarks, about)


def with_remarks(
    entry: Entry, remarks: Sequence[Remark], about: Path | None
) -> dict[str, Any]:
    """Return a record with more remarks, and their texts as ``warnings``.

    Files stand in it without their folders, as the inputs do.
    """
    said = [one.said(about) for one in remarks]
    whole = [plain(one.as_json()) for one in remarks]
    for one, values in zip(remarks, whole, strict=True):
        if one.where.file is not None:
            values["where"]["file"] = _name(one.where.file)
    return {
        **entry,
        "warnings": [*entry["warnings"], *said],
        "remarks": [*entry["remarks"], *whole],
    }


def remarks_of(entry: Entry, task: Task) -> tuple[Remark, ...]:
    """Return the remarks that a task's record has; of an older one, its texts."""
    read = {
        _name(path): path for source in task.sources for path in source.reads.values()
    }
    try:
        if "remarks" not in entry:
            return tuple(remark("note", str(text)) for text in entry["warnings"])
        found = tuple(map(from_json, entry["remarks"]))
    except (AttributeError, KeyError, TypeError, ValueError):
        return ()
    files = [read.get(str(one.where.file), one.where.file) for one in found]
    return tuple(
        replace(one, where=replace(one.where, file=file))
        for one, file in zip(found, files, strict=True)
    )


def same(one: Entry, other: Entry) -> bool:
    """Whether two records would make the same output; names and times apart."""

    def bare(entry: Entry, key: str) -> Any:
        value = entry.get(key)
        if key != "inputs" or not isinstance(value, list):
            return value
        return [{k: v for k, v in item.items() if k != "name"} for item in value]

    return all(bare(one, key) == bare(other, key) for key in SAME)


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
