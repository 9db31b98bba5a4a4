"""What the person at the keyboard can fix.

Every message reads *where: what is wrong; what would be right*, on one line.
"""

from collections.abc import Collection
from difflib import get_close_matches
from pathlib import Path


class HandcleanError(Exception):
    """Something in the input that its owner can mend; printed on one line."""

    exit_status = 1


class UsageError(HandcleanError):
    """A wrong option, configuration or combination of inputs (exit status 2)."""

    exit_status = 2


class FileError(HandcleanError):
    """A file that cannot be read or written as what it claims to be."""

    def __init__(self, where: Path | str, wrong: str, right: str = "") -> None:
        super().__init__(f"{where}: {wrong}" + (f"; {right}" if right else ""))
        self.where = where


class ShapeError(HandcleanError):
    """An array of the wrong shape."""


class UnknownNameError(HandcleanError):
    """A name in a file or option is not one of the names that exist."""

    def __init__(
        self, where: Path | str, kind: str, name: str, known: Collection[str]
    ) -> None:
        close = get_close_matches(name, known, n=2)
        if close:
            hint = f"did you mean {' or '.join(close)}?"
        elif known:
            hint = f"known: {', '.join(sorted(known))}"
        else:
            hint = "there are none"
        super().__init__(f"{where}: no {kind} is called '{name}'; {hint}")


class UnknownSettingError(UsageError, UnknownNameError):
    """A name in a configuration, a manifest or an option that does not exist."""
