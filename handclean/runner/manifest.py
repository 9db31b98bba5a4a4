"""Lists of inputs: manifests, shards, and the failed ones as a new manifest.

A manifest is CSV or TSV whose header names ``input`` and, as needed, ``output`` and
what else may be given of an input; or plain lines, each a path; or the JSON objects
that another command told, whose outputs are the inputs. Relative paths are relative to
the folder the command runs in, like paths on the command line.
"""

import csv
import io
import json
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

from handclean.errors import UnknownSettingError, UsageError
from handclean.runner import interrupts

T = TypeVar("T")

COLUMNS = ("input", "output")
"""Columns of every manifest; those of what is given of an input come after them."""

REASON, RATING = "reason", "rating"
"""Columns that may stand there, too: why an input failed, which ``--failed`` writes,
and how good a person finds it."""

EXCLUDED = "exclude"
"""The rating that leaves an input out."""

STATES = ("done", "skipped", "failed")
"""What the JSON of a command may say of an input."""

MISSPELT_SIMILARITY = 0.75
"""[-] similarity (of `difflib`) of a cell and a column's name from which on it is meant
(chosen)."""

MOST_LINES = 1_000_000
MOST_BYTES = 100_000_000
"""A manifest that has more is refused while it is read, before memory runs out.

A line costs about a kilobyte once it is planned, so this many need a gigabyte; a
hundred bytes a line are a long path. A million takes of a second's work each are twelve
days of one core, which several manifests share better.
"""

_CHUNK_BYTES = 1 << 20
"""[bytes] that are read at once (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """One input and what its line says about it.

    Attributes
    ----------
    output : where to, "" where the line is silent.
    cells : what it says in other columns; without those that are empty.
    reason : why it failed the last time, "" where the line is silent.
    excluded : whether it is left out; the places of the others do not depend on it.
    failed : why an earlier command could not make the input, or "".
    at : where it stands: "takes.csv, line 3", "" on the command line.
    folder : that in which the input was found, None where it was named itself.
    """

    input: Path
    output: str = ""
    cells: Mapping[str, str] = field(default_factory=dict)
    reason: str = ""
    excluded: bool = False
    failed: str = ""
    at: str = field(default="", compare=False)
    folder: Path | None = None


def read(name: str, more: Sequence[str] = ()) -> tuple[Line, ...]:
    """Read a manifest from a file, or from stdin when its name is "-".

    Parameters
    ----------
    more : columns it may have beside `COLUMNS`, `REASON` and `RATING`.

    Raises
    ------
    UsageError
        If it cannot be read, is empty, has an unknown column, a line that does not fit
        the header, or JSON that is not of a command with outputs.
    """
    where = "stdin" if name == "-" else name
    text = _text(name, where)
    if not text.strip():
        raise UsageError(
            "is empty; it should list the inputs, one per line", where=where
        )
    first = text.lstrip("\n").split("\n", 1)[0].strip()
    if re.match(r'\{\s*("|$)', first):
        return tuple(_results(where, text))
    if re.match(r'"?input"?\s*;', first):
        raise UsageError("columns should be separated by commas or tabs", where=where)
    columns = (*COLUMNS, *more, REASON, RATING)
    for separator in (",", "\t"):
        rows = csv.reader([first], delimiter=separator)
        header = [cell.strip() for row in _rows(where, rows) for cell in row]
        if "input" in header:
            return tuple(_table(where, text, header, columns, separator))
        if len(header) > 1:
            break
    _expect_no_header(where, header, columns)
    lines = (line.removesuffix("\r") for line in text.split("\n"))
    return tuple(Line(input=Path(line)) for line in lines if line.strip())


def _expect_no_header(where: str, cells: list[str], columns: Sequence[str]) -> None:
    """Expect that a first line is a path, not a header without ``input``."""
    if len(cells) < 2 or not any(_like_a_column(cell, columns) for cell in cells):
        return
    for cell in cells:
        if cell not in columns:
            raise UnknownSettingError(where, "column", cell, columns)
    raise UsageError("has no column 'input'; its header should name one", where=where)


def _like_a_column(cell: str, columns: Sequence[str]) -> bool:
    """Whether a cell is the name of a column, perhaps misspelt."""
    return bool(
        get_close_matches(cell.casefold(), columns, n=1, cutoff=MISSPELT_SIMILARITY)
    )


def _text(name: str, where: str) -> str:
    try:
        if name == "-":
            data = _bounded(sys.stdin.buffer, where)
        else:
            with Path(name).open("rb") as stream:
                data = _bounded(stream, where)
    except OSError as error:
        raise UsageError(
            f"{(error.strerror or str(error)).lower()}", where=where
        ) from None
    if b"\n" not in data:  # lines of an old Macintosh
        data = data.replace(b"\r", b"\n")
        _expect_few(where, len(data), data.count(b"\n"))
    return os.fsdecode(data.removeprefix(b"\xef\xbb\xbf"))


def _bounded(stream: Any, where: str) -> bytes:
    """Read a stream to its end, unless that is too far away.

    One read is one call of the system (``read1``): reading all at once never comes
    back to Python, and so to a signal, as long as there is more.
    """
    chunks: list[bytes] = []
    size = lines = 0
    while chunk := stream.read1(_CHUNK_BYTES):
        interrupts.raise_swallowed()
        if b"\0" in chunk:
            raise UsageError(
                "is not text; a manifest is CSV or a list of paths", where=where
            )
        size += len(chunk)
        lines += chunk.count(b"\n")
        _expect_few(where, size, lines)
        chunks.append(chunk)
    interrupts.raise_swallowed()
    return b"".join(chunks)


def _expect_few(where: str, size: int, lines: int) -> None:
    """Expect no more bytes and lines than a manifest may have."""
    if size > MOST_BYTES or lines > MOST_LINES:
        most = f"{MOST_LINES} lines or {MOST_BYTES // 1_000_000} MB"
        raise UsageError(
            f"has more than {most}; it should be parted into several", where=where
        )


def _table(
    where: str, text: str, header: list[str], columns: Sequence[str], separator: str
) -> Iterable[Line]:
    for name in header:
        if name not in columns:
            raise UnknownSettingError(where, "column", name, columns)
    if len(set(header)) != len(header):
        raise UsageError("every column should appear once", where=where)
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    started = False
    for row in _rows(where, rows):
        if not any(cell.strip() for cell in row):
            continue
        if not started:
            started = True
            continue
        at = f"{where}, line {rows.line_num}"
        if len(row) != len(header):
            raise UsageError(
                f"has {len(row)} cells; it should have {len(header)} like the header",
                where=at,
            )
        yield _line(at, dict(zip(header, row, strict=True)))


def _rows(where: str, rows: Iterator[list[str]]) -> Iterator[list[str]]:
    try:
        yield from rows
    except csv.Error as error:
        raise UsageError(f"is not CSV: {error}", where=where) from None


def _line(where: str, cells: dict[str, str]) -> Line:
    if not cells["input"]:
        raise UsageError("should name an input", where=where)
    return Line(
        input=Path(cells["input"]),
        output=cells.get("output", ""),
        cells={
            name: text
            for name, text in cells.items()
            if text and name not in (*COLUMNS, REASON, RATING)
        },
        reason=cells.get(REASON, ""),
        excluded=cells.get(RATING, "").strip() == EXCLUDED,
        at=where,
    )


def _results(where: str, text: str) -> Iterable[Line]:
    """Read what another command told: its outputs are the inputs, whole or failed."""
    for number, row in enumerate(text.split("\n"), start=1):
        if not row.strip():
            continue
        at = f"{where}, line {number}"
        try:
            found = json.loads(row)
        except (ValueError, RecursionError):
            found = None
        if not isinstance(found, dict) or found.get("status") not in STATES:
            right = "it should be one that --json prints, with input, output and status"
            raise UsageError(f"is no JSON object of a command; {right}", where=at)
        yield _result(at, found)


def _result(at: str, found: Mapping[str, Any]) -> Line:
    made = found.get("output")
    if isinstance(made, list) and made:
        made = made[0]  # what is made beside it comes after it
    if not isinstance(made, str) or not made:
        right = "only what a command wrote can be an input"
        raise UsageError(f"names no output; {right}", where=at)
    failed = ""
    if found["status"] == "failed":
        failed = str(found.get("error") or "it does not say why")
    return Line(input=Path(made), failed=failed, at=at)


def shard(items: Sequence[T], which: str) -> Sequence[T]:
    """Take every N-th item from the I-th (from 1), of ``which`` = "I/N"; "" is all.

    Raises
    ------
    UsageError
        If ``which`` is not of that form or I is not among 1..N.
    """
    if not which:
        return items
    match = re.fullmatch(r"(\d+)/(\d+)", which, re.ASCII)
    part, parts = map(int, match.groups()) if match else (0, 0)
    if not 1 <= part <= parts:
        raise UsageError(f"--shard should be I/N with I from 1 to N, not '{which}'")
    return items[part - 1 :: parts]


def to_csv(lines: Iterable[Line], more: Sequence[str] = ()) -> str:
    """Write lines as a manifest; ``more`` are its columns beside `COLUMNS`."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow((*COLUMNS, *more, REASON))
    for line in lines:
        cells = (line.cells.get(column, "") for column in more)
        writer.writerow((line.input, line.output, *cells, line.reason))
    return out.getvalue()
