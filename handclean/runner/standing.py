"""What stands where outputs belong, and whether an output may replace it.

What was read is never replaced, nor what that was made from, nor a file of another
kind; what handclean did not make, or what was edited since, only with ``--overwrite``.
"""

import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from handclean.errors import FileError, UsageError
from handclean.runner import provenance, records
from handclean.runner.command import Work
from handclean.runner.outcome import Entry
from handclean.runner.records import Records


class State(Enum):
    """What stands where an output belongs."""

    MISSING = "nothing"
    SAME = "made by the same record"
    OTHER = "made by another record"
    FOREIGN = "not made by handclean, or edited since"


@dataclass(frozen=True)
class Kept:
    """Files that nothing replaces: those read, and those they were made from.

    Attributes
    ----------
    records : where the records of files stand.
    read : digests of the files read.
    """

    records: Records
    read: Mapping[Path, str] = field(default_factory=dict)

    def has(self, path: Path, found: State) -> bool:
        """Whether a file is one of them; not by its place, which was looked at before.

        What handclean made of an input is none, also where it has the bytes of one.
        """
        digest = records.digest(path)
        if found is State.FOREIGN and digest in self.read.values():
            return True
        if found is not State.FOREIGN:
            made_of = self.records.behind(path)
            if not made_of.isdisjoint(self.read.values()):
                return False
        return any(digest in self.records.behind(read) for read in self.read)


def state(
    path: Path, begun: Entry, work: Work, read: Mapping[Path, str] | None = None
) -> State:
    """Look at the place of an output.

    Parameters
    ----------
    begun : the record that an output would have.
    read : digests of the files that the task reads.

    Raises
    ------
    UsageError
        If one of those stands there, or what one was made from, or a file of another
        kind.
    FileError
        If something stands there that handclean did not make (unless it is to be
        overwritten), or that is no file at all.
    """
    place = Path(os.path.realpath(path))
    command = work.command
    stands = is_there(path)
    foreign = [
        path.with_name(part.name)
        for part in command.records.beside(place)
        if is_there(part) and not records.is_record(part)
    ]
    found = State.MISSING
    if stands:
        found = _made(place, begun, command.records)
        if found is State.SAME and not (work.overwrite or foreign):
            return State.SAME
        made = command.makes.get(path.suffix.lower(), "")
        expect_kind(command.formats.kind(place), made, path)
        if Kept(command.records, read or {}).has(place, found):
            raise UsageError(
                "is what an input was made from, which is never replaced; -o should "
                "name another place",
                where=path,
            )
        foreign += [path] if found is State.FOREIGN else []
    if foreign and not work.overwrite:
        raise FileError(
            foreign[0],
            "is there already and not (or no longer) as handclean made it",
            f"--overwrite replaces it and keeps it as {foreign[0].name}~",
        )
    if foreign:
        return State.FOREIGN
    return found if found is State.MISSING else State.OTHER


def is_there(path: Path) -> bool:
    """Whether there is a file.

    Raises
    ------
    FileError
        If there is something else, or nobody may look.
    """
    try:
        mode = os.stat(os.path.realpath(path)).st_mode
    except FileNotFoundError:
        return False
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FileError(path, f"cannot be written: {reason}") from None
    if not stat.S_ISREG(mode):
        raise FileError(path, "is not a file", "name one that can be written")
    return True


def expect_kind(stands: str, made: str, output: Path) -> None:
    """Expect a file to be of the kind that is to replace it, where both are known.

    A name that is typed wrong should not cost a file that took a recording to make.

    Raises
    ------
    UsageError
        If it is of another.
    """
    if made and stands and made != stands:
        raise UsageError(
            f"is a {stands}, which a {made} never replaces; "
            "-o should name another place",
            where=output,
        )


def _made(path: Path, begun: Entry, known: Records) -> State:
    made = known.of(path)
    intact = known.intact(path) if made else False
    if intact is False:
        return State.FOREIGN
    return State.SAME if intact and provenance.same(made[-1], begun) else State.OTHER
