"""A regular file opened for reading, and whether it stays as it was."""

import os
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from handclean.errors import FileError
from handclean.io.hdf5.walk import identity


@contextmanager
def opened(path: Path) -> Iterator[int]:
    """Open a file for reading; gives its descriptor.

    Raises
    ------
    FileError
        If there is none, it is empty, or no regular file.
    """
    try:
        about = path.stat()
        if stat.S_ISDIR(about.st_mode):
            raise FileError(path, "is a directory", "give a file")
        if not stat.S_ISREG(about.st_mode):
            raise FileError(path, "is not a regular file")
        if not about.st_size:
            raise FileError(path, "is empty")
        fd = os.open(path, os.O_RDONLY)
    except FileNotFoundError:
        raise FileError(path, "no such file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(path, f"cannot be read ({reason})") from None
    try:
        yield fd
    except (OSError, MemoryError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or type(error).__name__
        raise FileError(path, f"cannot be read ({reason})") from None
    finally:
        os.close(fd)


def expect_same(path: Path, fd: int, state: Sequence[int]) -> None:
    """Expect a file to be the one, and as it was, when it was walked.

    Raises
    ------
    FileError
        If it is not.
    """
    if identity(os.fstat(fd)) != list(state):
        raise FileError(path, "changed while it was read", "try again")
