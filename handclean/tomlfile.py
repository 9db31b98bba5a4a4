"""TOML files as tables with checked getters; every reader of TOML uses them.

`read_table` gives a `Table`. Its getters refuse what is missing, of the wrong kind or
out of bounds, in one line that names the file, the table and the key.

Nothing heavy is imported, so that help is instant: vectors are tuples of floats.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handclean.errors import FileError, Place, UnknownNameError, Where
from handclean.tomltext import MOST_BYTES, parse_toml

MOST_ROWS = 1000
"""[[tables]] of one name, at most: markers of a set, bones of a tree (chosen)."""

MOST_NUMBER = 1e12
"""No number is larger, whatever its unit (chosen)."""

LONGEST_NAME = 1000
"""Characters of a name, at most; no program shows so many (chosen)."""

MOST_SHOWN = 60
"""Characters of a key or a value that a message shows (chosen)."""


@dataclass(frozen=True)
class Table:
    """One table of a TOML file, with getters that refuse wrong values.

    Getters raise a `FileError` where a value is not there and has no default, is of the
    wrong kind or out of bounds; ``right`` says what would be right. Where a key is
    unknown, they raise an `UnknownNameError` that names the closest one.

    Attributes
    ----------
    file : the file.
    values : what the table holds, by key.
    part : which table of the file, as messages show it: " [[marker]] 3"; "" for the
        file's own.
    """

    file: Path
    values: Mapping[str, Any]
    part: str = ""

    @property
    def where(self) -> Where:
        """The place that messages name."""
        return Place(self.file, self.part) if self.part else self.file

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def __iter__(self) -> Iterator[str]:
        return iter(self.values)

    def error(self, wrong: str, right: str = "") -> FileError:
        """Return an error about this table: what is wrong, what would be right."""
        return FileError(self.where, wrong, right)

    def wrong(self, key: str, right: str) -> FileError:
        """Return an error about the value of a key, or that it has none."""
        if key not in self.values:
            return self.error(f"no {key}", right)
        return self.error(f"{key[:MOST_SHOWN]} is {_shown(self.values[key])}", right)

    def expect_keys(self, known: Collection[str], kind: str = "key") -> None:
        """Expect only keys that are known; ``kind``: what they are, for messages."""
        for key in self.values:
            if key not in known:
                raise UnknownNameError(self.where, kind, key, known)

    def name(self, key: str, right: str = "") -> str:
        """Return a text that should be there, neither empty nor too long for a name."""
        value = self.values.get(key)
        if not isinstance(value, str) or not value:
            raise self.wrong(key, right or f'give {key} = "..."')
        if len(value) > LONGEST_NAME:
            wrong = f"{key[:MOST_SHOWN]} has {len(value)} characters"
            raise self.error(wrong, f"{LONGEST_NAME} are the most")
        return value

    def text(self, key: str, default: str) -> str:
        """Return a text, which may be empty."""
        value = self.values.get(key, default)
        if not isinstance(value, str):
            raise self.wrong(key, f'give {key} = "..."')
        return value

    def texts(self, key: str, right: str = "") -> tuple[str, ...]:
        """Return a list of texts; one that is not there is empty."""
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
            raise self.wrong(key, right or f'give {key} = ["...", ...]')
        return tuple(value)

    def word(self, key: str, known: Collection[str], default: str | None = None) -> str:
        """Return one of the words known, or the default where there is none."""
        value = self.values.get(key, default)
        if not isinstance(value, str) or value not in (*known, default):
            raise self.wrong(key, f"{key} should be {' or '.join(known)}")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Return true or false."""
        value = self.values.get(key, default)
        if not isinstance(value, bool):
            raise self.wrong(key, f"give {key} = true or false")
        return value

    def number(
        self,
        key: str,
        default: float | None = None,
        *,
        least: float = -MOST_NUMBER,
        most: float = MOST_NUMBER,
        right: str = "",
    ) -> float:
        """Return a number within bounds."""
        value = self.values.get(key, default)
        if not _is_number(value, least, most):
            raise self.wrong(key, right or "it should be a number")
        return float(value)

    def whole_number(self, key: str, least: int, most: int, right: str) -> int:
        """Return a whole number within bounds."""
        value = self.values.get(key)
        if not isinstance(value, int) or not _is_number(value, least, most):
            raise self.wrong(key, right)
        return value

    def vector(
        self, key: str, count: int, *, most: float = MOST_NUMBER, right: str = ""
    ) -> tuple[float, ...]:
        """Return so many numbers of a magnitude of at most ``most``."""
        value = self.values.get(key)
        numbers = value if isinstance(value, list) and len(value) == count else [None]
        if not all(_is_number(number, -most, most) for number in numbers):
            raise self.wrong(key, right or f"give {count} numbers")
        return tuple(map(float, numbers))

    def numbers(self) -> dict[str, float]:
        """Return all values of a table of numbers."""
        if not self.values:
            raise self.error("is empty", "give name = number")
        return {key: self.number(key) for key in self.values}

    def table(self, key: str, right: str) -> "Table":
        """Return a table in this one; one that is not there is empty."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise self.error(f"{key} is {_shown(value)}, no table", right)
        return Table(self.file, value, f"{self.part} [{key[:MOST_SHOWN]}]")

    def tables(self, key: str, known: Collection[str]) -> tuple["Table", ...]:
        """Return the [[tables]] of a name, with keys that are known; perhaps none."""
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
            raise self.wrong(key, f"write [[{key}]] tables")
        if len(value) > MOST_ROWS:
            right = f"at most {MOST_ROWS} are read"
            raise self.error(f"has {len(value)} [[{key}]]", right)
        rows = tuple(
            Table(self.file, row, f"{self.part} [[{key}]] {number}")
            for number, row in enumerate(value, 1)
        )
        for row in rows:
            row.expect_keys(known)
        return rows


def shipped_names(folder: Path) -> tuple[str, ...]:
    """Names of the TOML files in a folder of those that come with handclean."""
    return tuple(sorted(path.stem for path in folder.glob("*.toml")))


def find_file(
    name: str | Path, folder: Path, where: Where, kind: str, known: Collection[str]
) -> Path:
    """Return the file that a path names, or that ships under a name.

    Parameters
    ----------
    folder : where files ship, under the names ``known``.
    where, kind : the option and what it takes, for messages.

    Raises
    ------
    UnknownNameError
        If it is neither a path of a TOML file nor one of the names.
    """
    path = Path(name)
    if path.suffix == ".toml":
        return path
    if str(name) not in known:
        raise UnknownNameError(where, kind, str(name), known)
    return folder / f"{name}.toml"


def read_table(path: Path, what: str, right: str = "") -> Table:
    """Read a TOML file; parameters and errors as of `read_toml`."""
    return Table(path, read_toml(path, what, right))


def _shown(value: Any) -> str:
    """Return a value as a message shows it."""
    return f"{value!r:.{MOST_SHOWN}}"


def _is_number(value: Any, least: float, most: float) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value) and least <= value <= most


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
