"""TOML from people's files: read within bounds, wrong files told in one line.

`tomllib` is written for files that are trusted. A key of many parts costs it the
square of their number, nested arrays end Python's stack, every table costs up to a
hundred times its bytes, and a number may have any number of digits. So the text is
looked through once before it is parsed, by its tokens, and refused where it holds more
of any than a settings file, a marker set or a scene does.
"""

import re
import tomllib
from collections.abc import Sized
from pathlib import Path
from typing import Any

from handclean.errors import FileError, Where

MOST_BYTES = 2**21
"""A file is no longer."""

DEEPEST = 20
"""Arrays and tables are nested no deeper, and a key has no more parts."""

MOST_TABLES = 20_000
"""Tables, and parts of dotted keys, in a file."""

MOST_ROWS = 1000
"""Markers of a set, bones of a tree, rotations of a glove."""

_TOKEN = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\Z)'
    r"|'''(?:[^']|'(?!''))*+(?:'{3,5}|\Z)"
    r'|"(?:[^"\\\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+"
    r"|[][{}=,.\n]",
    re.DOTALL,
)
"""Texts and comments, which are passed over, and marks; a text without an end goes on
to the file's, where `tomllib` refuses it."""

_SAID = 200
"""Characters of what `tomllib` says that are passed on."""


def read_toml(path: Path, what: str, right: str = "") -> dict[str, Any]:
    """Read a TOML file.

    Parameters
    ----------
    what : how to say that it is not TOML, such as "not a marker set".
    right : what to do where there is no such file.

    Raises
    ------
    FileError
        If it cannot be read, is not TOML, or holds more than any such file does.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise FileError(path, "no such file", right) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(path, f"cannot be read ({reason.lower()})") from None
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        if len(content) <= MOST_BYTES:
            right = "it should be TOML in UTF-8"
            raise FileError(path, f"{what}: is not text", right) from None
        text = content.decode("utf-8-sig", "replace")
    return parse_toml(path, text, what)


def parse_toml(where: Where, text: str, what: str) -> dict[str, Any]:
    """Parse a TOML text; parameters and errors as of `read_toml`."""
    text = text.replace("\r\n", "\n")
    if len(text) > MOST_BYTES:
        right = f"at most {MOST_BYTES // 2**20} MB are read"
        raise FileError(where, f"{what}: is too long", right)
    if wrong := _excess(text):
        raise FileError(where, f"{what}: {wrong}")
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileError(
            where, f"{what}: {' '.join(str(error).split())[:_SAID]}"
        ) from None
    except (ValueError, RecursionError):  # Python's own limit of digits
        raise FileError(where, f"{what}: a number has too many digits") from None
    if not _in_range(document):
        raise FileError(where, f"{what}: a whole number is beyond 64 bits")
    return document


def expect_few(where: Where, name: str, rows: Sized) -> None:
    """Expect no more [[tables]] of a name than a thing of this world has.

    Raises
    ------
    FileError
        If there are more.
    """
    if len(rows) > MOST_ROWS:
        right = f"at most {MOST_ROWS} are read"
        raise FileError(where, f"has {len(rows)} [[{name}]]", right)


def _excess(text: str) -> str:
    """Say what a text holds too much of; "" if nothing."""
    inside: list[str] = []
    in_key, parts, tables, line = True, 1, 0, 1
    for found in _TOKEN.finditer(text):
        mark = found[0]
        if mark == ".":
            if in_key:
                parts += 1
                tables += 1
        elif mark in "[{":
            tables += mark == "{" or (in_key and not inside)
            inside.append(mark)
            in_key = in_key or mark == "{"
            parts = 1
        elif mark in "]}":
            if inside:
                inside.pop()
            in_key = False
        elif mark == "=":
            in_key, parts = False, 1
        elif mark == "," or (mark == "\n" and not inside):
            in_key = not inside or inside[-1] == "{"
            parts = 1
        line += mark.count("\n")
        if parts > DEEPEST:
            return f"line {line}: a key has more than {DEEPEST} parts"
        if len(inside) > DEEPEST:
            return f"line {line}: is nested more than {DEEPEST} deep"
        if tables > MOST_TABLES:
            return f"line {line}: has more than {MOST_TABLES} tables"
    return ""


def _in_range(document: dict[str, Any]) -> bool:
    """Whether all whole numbers are of 64 bits, as TOML has them."""
    left: list[Any] = [document]
    while left:
        value = left.pop()
        if isinstance(value, dict):
            left.extend(value.values())
        elif isinstance(value, list):
            left.extend(value)
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            return False
    return True
