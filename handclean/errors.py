"""What the person at the keyboard can fix.

Every message reads *where: what is wrong; what would be right*, on one line. What is
said of an error elsewhere rests on its attributes; nothing reads the message.
"""

from collections.abc import Collection
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Self, TypeVar

TAKE = "take"
"""Where something is wrong with a take whose file the raiser does not know."""


@dataclass(frozen=True)
class Place:
    """A part of a file, or the option that names the file.

    Attributes
    ----------
    file : the file.
    part : what stands behind its name: " line 3", "/markers".
    option : "--subject", or "" where no option is to be named.
    """

    file: Path
    part: str = ""
    option: str = ""

    def __str__(self) -> str:
        return f"{self.option} {self.file}{self.part}".lstrip()

    def __truediv__(self, name: str) -> "Place":
        """Return the place of a group or a dataset in this one."""
        return Place(self.file, f"{self.part}/{name}", self.option)


@dataclass(frozen=True)
class TakeNumber:
    """One of several takes whose files the raiser does not know; they count from 0."""

    number: int

    def __str__(self) -> str:
        return f"take {self.number + 1}"


Where = Path | Place | TakeNumber | str
"""A file, a part of one, or the option or thing that something is wrong with."""

_MOST_CHARACTERS = 100
"""Characters of a name that a message shows (chosen)."""

_MOST_NAMES = 200
"""Names that one is compared with (chosen)."""


class HandcleanError(Exception):
    """Something in the input that its owner can mend; printed on one line.

    Parameters
    ----------
    wrong : what is wrong, and what would be right.
    where : file, part of a file, option or thing that it is wrong with; by default
        that is for whoever catches the error to say.

    Attributes
    ----------
    where, wrong : as given.
    """

    exit_status = 1

    def __init__(self, wrong: str, *, where: Where | None = None):
        super().__init__(wrong if where is None else f"{where}: {wrong}")
        self.where = where
        self.wrong = wrong

    @property
    def file(self) -> Path | None:
        """The file that the error names; None where it names none."""
        if isinstance(self.where, Place):
            return self.where.file
        return self.where if isinstance(self.where, Path) else None

    def at(self, where: Where) -> Self:
        """Return the same error about another place."""
        return self._but(where, self.wrong)

    def in_file(self, file: Path) -> Self:
        """Return the same error about the same part of another file."""
        here = self.where
        if isinstance(here, Place):
            return self._but(Place(file, here.part, here.option), self.wrong)
        return self._but(file, self.wrong)

    def with_hint(self, hint: str) -> Self:
        """Return the same error with one more thing that would be right."""
        return self._but(self.where, f"{self.wrong}; {hint}")

    def _but(self, where: Where | None, wrong: str) -> Self:
        text = wrong if where is None else f"{where}: {wrong}"
        return _made(type(self), text, {**vars(self), "where": where, "wrong": wrong})

    def __reduce__(self) -> tuple[Any, ...]:
        return _made, (type(self), str(self), vars(self))


E = TypeVar("E", bound=HandcleanError)


def _made(kind: type[E], text: str, parts: dict[str, Any]) -> E:
    """Make an error whatever its own arguments are; processes hand them on so."""
    error = kind.__new__(kind, text)
    vars(error).update(parts)
    return error


class UsageError(HandcleanError):
    """A wrong option, configuration or combination of inputs (exit status 2)."""

    exit_status = 2

    @classmethod
    def of(cls, error: HandcleanError, option: str = "") -> "UsageError":
        """Return an error as one of usage, about the option that led to it.

        Parameters
        ----------
        option : "--subject", or "" for none.
        """
        where = error.where
        if isinstance(where, Path):
            where = Place(where, option=option)
        elif isinstance(where, Place):
            where = Place(where.file, where.part, option)
        elif where is None or not option:
            where = where if where is not None else option or None
        elif where != option:
            where = f"{option} {where}"
        return UsageError(error.wrong, where=where)


class UnsaidError(UsageError):
    """A file does not say something that an option can say.

    Attributes
    ----------
    options : those options, "--rate" or "--unit" or both.
    """

    def __init__(self, where: Where, wrong: str, *options: str):
        super().__init__(wrong, where=where)
        self.options = options


class FileError(HandcleanError):
    """A file that cannot be read or written as what it claims to be."""

    def __init__(self, where: Where, wrong: str, right: str = "") -> None:
        super().__init__(wrong + (f"; {right}" if right else ""), where=where)


class ShapeError(HandcleanError):
    """An array of the wrong shape."""


class UnknownNameError(HandcleanError):
    """A name in a file or option is not one of the names that exist."""

    def __init__(
        self,
        where: Where,
        kind: str,
        name: str,
        known: Collection[str],
    ) -> None:
        name = str(name)[:_MOST_CHARACTERS]
        some = sorted(known)[:_MOST_NAMES]
        close = get_close_matches(name, some, n=2)
        if close:
            hint = f"did you mean {' or '.join(close)}?"
        elif known:
            hint = f"known: {', '.join(some)}{', ...' * (len(known) > _MOST_NAMES)}"
        else:
            hint = "there are none"
        super().__init__(f"no {kind} is called '{name}'; {hint}", where=where)


class UnknownSettingError(UsageError, UnknownNameError):
    """A name in a configuration, a manifest or an option that does not exist."""
