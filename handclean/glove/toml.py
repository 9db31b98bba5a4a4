"""What the glove's TOML files share: finding them, and saying what is wrong in them."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, Place, UnknownNameError, Where
from handclean.toml import expect_few, parse_toml, read_toml

_MOST = 1e300
"""No number is larger; a whole one of TOML may be."""


def load(
    name: str | Path, folder: Path, kind: str, table: str
) -> tuple[Path, dict[str, Any]]:
    """Find a file by its shipped name or path and parse it.

    Raises
    ------
    FileError, UnknownNameError
        If there is none, or it is no TOML with [[table]]s.
    """
    path = Path(name)
    if path.suffix != ".toml":
        known = sorted(p.stem for p in folder.glob("*.toml"))
        if str(name) not in known:
            raise UnknownNameError(kind, kind, str(name), known)
        path = folder / f"{name}.toml"
    return path, _with(path, read_toml(path, f"not a {kind}"), kind, table)


def parse(path: Path, content: str, kind: str, table: str) -> dict[str, Any]:
    """Parse a text that should have [[table]]s.

    Raises
    ------
    FileError
        If it is no TOML or has none.
    """
    return _with(path, parse_toml(path, content, f"not a {kind}"), kind, table)


def _with(path: Path, found: dict[str, Any], kind: str, table: str) -> dict[str, Any]:
    """Expect [[table]]s."""
    if table and not found.get(table):
        raise FileError(path, f"no [[{table}]]", f"a {kind} has at least one")
    return found


def check_keys(where: Where, row: Mapping[str, Any], known: Collection[str]) -> None:
    """Expect only keys that exist."""
    for key in row:
        if key not in known:
            raise UnknownNameError(where, "key", key, known)


def tables(
    path: Path, name: str, content: Mapping[str, Any], known: Collection[str]
) -> list[dict[str, Any]]:
    """Return the [[name]] tables, their keys checked."""
    rows = content.get(name)
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise FileError(path, f"{name} is {rows!r:.60}", f"write [[{name}]] tables")
    expect_few(path, name, rows)
    for row in rows:
        check_keys(Place(path, f" [[{name}]]"), row, known)
    return rows


def text(where: Where, key: str, row: Mapping[str, Any]) -> str:
    """Return a text that is not empty."""
    value = row.get(key)
    if not isinstance(value, str) or not value:
        raise FileError(where, f"{key} is {value!r:.60}", f'give {key} = "..."')
    return value


def texts(where: Where, key: str, row: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a list of texts, empty if it is not there."""
    value = row.get(key, [])
    if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
        raise FileError(where, f"{key} is {value!r:.60}", f'give {key} = ["...", ...]')
    return tuple(value)


def numbers(where: Where, key: str, value: Any, count: int) -> Floats:
    """Return so many finite numbers."""
    try:
        found = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise FileError(where, f"{key} is {value!r:.60}", f"give {count} numbers")
    return found


def factors(where: Where, value: Any) -> dict[str, float]:
    """Return a table of numbers by name."""
    if not isinstance(value, dict) or not value:
        raise FileError(where, f"{value!r:.60} is no table", "give { name = factor }")
    for key, number in value.items():
        kind = isinstance(number, int | float) and not isinstance(number, bool)
        if not (kind and abs(number) < _MOST):
            raise FileError(where, f"{key} = {number!r:.60}", "it should be a number")
    return {key: float(number) for key, number in value.items()}
