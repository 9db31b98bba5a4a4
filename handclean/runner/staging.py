"""Temporary files, whose names say whose they are, so that none stays for ever.

``.handclean-OUTPUT-HOST-BOOT-PID-STARTED-TOKEN-NUMBER.h5``: the output it will become,
and the process that writes it. A process that was killed cannot clear up; whoever
writes the same output later does, if that process lives no more. One of another machine
is taken for dead after seven days.
"""

import hashlib
import os
import re
import socket
import time
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path

from handclean.runner.places import nearest

DEAD_AFTER_S = 7 * 86400.0
"""[s] after which a file of another machine was left (chosen)."""

_NAME = re.compile(
    r"\.handclean-(?P<output>[0-9a-f]{12})-(?P<host>[0-9a-f]{8})-(?P<boot>[0-9a-f]{8})"
    r"-(?P<pid>\d+)-(?P<started>\d+)-(?P<token>[0-9a-f]+)-\d+(\..*)?"
)


def token() -> str:
    """Make a name for the temporary files of one task."""
    return os.urandom(6).hex()


def temporary(place: Path, task: str, number: int) -> Path:
    """Return where to write first: in the nearest folder above the place.

    It is on the same disk, and folders are made only for outputs that succeed. The
    name is short, hidden, nobody else's, and has the suffix of the place.

    Parameters
    ----------
    place : absolute, without links.
    task : its token.
    number : of the output among those of the task.
    """
    host, boot = _machine()
    pid = os.getpid()
    process = f"{host}-{boot}-{pid}-{_started(pid) or 0}"
    name = f".handclean-{_digest(place, 12)}-{process}-{task}-{number}{place.suffix}"
    return nearest(place) / name


def remove(outputs: Iterable[Path], task: str) -> None:
    """Remove what a task, whichever process did it, may have left half-written."""
    for path, found in _left(outputs):
        if found["token"] == task:
            _unlink(path)


def remove_dead(outputs: Iterable[Path]) -> None:
    """Remove what processes that live no more left of these outputs."""
    for path, found in _left(outputs):
        if _is_dead(path, found):
            _unlink(path)


def _left(outputs: Iterable[Path]) -> list[tuple[Path, re.Match[str]]]:
    """Temporary files of outputs, in any folder above their places."""
    real = [Path(os.path.realpath(place)) for place in outputs]
    known = {_digest(place, 12): place for place in real}
    folders = {folder for place in known.values() for folder in place.parents}
    found = []
    for folder in sorted(folders):
        with suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                match = _NAME.fullmatch(entry.name)
                if match and match["output"] in known:
                    found.append((folder / entry.name, match))
    return found


def _unlink(path: Path) -> None:
    with suppress(OSError):
        path.unlink()


def _is_dead(path: Path, found: re.Match[str]) -> bool:
    host, boot = _machine()
    if found["host"] != host:
        try:
            return time.time() - path.stat().st_mtime > DEAD_AFTER_S
        except OSError:
            return False
    if found["boot"] != boot:
        return True
    return _started(int(found["pid"])) != found["started"]


def _digest(value: object, length: int) -> str:
    return hashlib.sha256(os.fsencode(str(value))).hexdigest()[:length]


@cache
def _machine() -> tuple[str, str]:
    """Digests of this host (with its own count of processes) and of its last start."""
    spaces = boot = ""
    with suppress(OSError):
        spaces = os.readlink("/proc/self/ns/pid")
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
    return _digest(socket.gethostname() + spaces, 8), _digest(boot.strip(), 8)


def _started(pid: int) -> str | None:
    """When a process began, as its system counts; None when there is none.

    Where the system does not say, "0" of every process that lives.
    """
    try:
        status = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
        return None if status[0] in (b"Z", b"X") else status[19].decode()
    except (OSError, IndexError):
        if os.path.isdir("/proc/self"):
            return None
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return None
    except OSError:
        pass
    return "0"
