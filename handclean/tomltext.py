"""TOML parsed within bounds.

`tomllib` is written for files that are trusted. A key of many parts costs it the
square of their number, nested arrays end Python's stack, every table costs up to a
hundred times its bytes, and a number may have any number of digits. So the tokens of
the text are counted once before it is parsed, and it is refused where it holds more
of any than a settings file, a marker set or a scene does.
"""

import json
import re
import tomllib
from typing import Any

from handclean.errors import FileError, Where

MOST_BYTES = 2**21
"""[bytes] a file is no longer (chosen)."""

DEEPEST = 20
"""Arrays and tables are nested no deeper, and a key has no more parts (chosen)."""

MOST_TABLES = 20_000
"""Tables, and parts of dotted keys, in a file, at most (chosen)."""

_TOKEN = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\Z)'
    r"|'''(?:[^']|'(?!''))*+(?:'{3,5}|\Z)"
    r'|"(?:[^"\\\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+"
    r"|[][{}=,.\n]",
    re.DOTALL,
)
"""Texts and comments, which count for nothing, and marks. A text without an end runs to
the end of the file, where `tomllib` refuses it."""

_MOST_REASON = 200
"""Characters of what `tomllib` says that a message shows (chosen)."""


def parse_toml(where: Where, text: str, what: str) -> dict[str, Any]:
    """Parse a TOML text.

    Parameters
    ----------
    where : the text's place, for messages.
    what : how to say that it is not TOML, such as "not a marker set".

    Raises
    ------
    FileError
        If it is not TOML, or holds more than any such file does.
    """
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
            where, f"{what}: {' '.join(str(error).split())[:_MOST_REASON]}"
        ) from None
    except (ValueError, RecursionError):  # Python's own limit of digits
        raise FileError(where, f"{what}: a number has too many digits") from None
    if not _in_range(document):
        raise FileError(where, f"{what}: a whole number is beyond 64 bits")
    return document


def quoted(text: str) -> str:
    """Return a text as TOML has it: JSON's strings, and no raw delete character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def key_of(name: str) -> str:
    """Return a name as a key of TOML, quoted where it has to be."""
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else quoted(name)


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
