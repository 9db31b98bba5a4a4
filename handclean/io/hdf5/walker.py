"""The process in which HDF5 files are walked, as HDF5 may never come back from one.

It is started when first needed, serves all files that this process reads, and is killed
and started anew when one takes too long or makes it crash. Waiting for it can be
interrupted by any signal. When this process ends, however it does, so does the other.
"""

import atexit
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from handclean.errors import FileError, Place

LIMIT_S = 20.0
"""[s] after which a file that HDF5 does not come to an end with is given up
(chosen)."""

_START_S = 60.0
"""[s] that starting may take on a busy machine (chosen)."""

_PIECE_BYTES = 2**20
"""[bytes] read from the process at once (chosen)."""

_CODE = (
    "import sys, json; parent, sys.path[:] = json.loads(sys.stdin.buffer.readline()); "
    "from handclean.io.hdf5.serve import serve; serve(parent)"
)


@dataclass
class _Child:
    process: "subprocess.Popen[bytes]"
    owner: int
    deadline: float = 0.0

    def alive(self) -> bool:
        return self.owner == os.getpid() and self.process.poll() is None


class _State:
    child: _Child | None = None
    lock = threading.RLock()
    bad: ClassVar[dict[tuple[int, ...], str]] = {}
    """What is wrong with files over which the library hung or died."""


def start() -> None:
    """Start the process now, where one will be needed: it gets ready meanwhile."""
    with _State.lock:
        if _State.child is None or not _State.child.alive():
            stop()
            _State.child = _started()


def stop() -> None:
    """End the process; another is started when it is needed."""
    with _State.lock:
        child, _State.child = _State.child, None
        if child is None:
            return
        pipes = (child.process.stdin, child.process.stdout)
        if child.owner == os.getpid():
            child.process.kill()
            with suppress(subprocess.TimeoutExpired):  # a disk that does not answer
                child.process.wait(1.0)
        for pipe in pipes:
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()


atexit.register(stop)


def walked(
    path: Path, *, only: str | None = None, keys: list[str] | None = None
) -> tuple[dict[str, Any], list[bytes]]:
    """What `handclean.io.hdf5.walk.walk` finds in a file.

    Raises
    ------
    FileError
        If it is damaged, or holds what should not be read.
    """
    request = {"path": os.fsencode(os.path.abspath(path)).hex()}
    line = json.dumps({**request, "only": only, "keys": keys}).encode() + b"\n"
    with _State.lock:
        answer, blocks = _asked(path, line)
    if "refused" in answer:
        inner, *rest = answer["refused"]
        raise FileError(Place(path, inner), *rest)
    if "broken" in answer:
        raise FileError(path, f"cannot be read as HDF5 ({answer['broken']})")
    return answer, blocks


def _asked(path: Path, line: bytes) -> tuple[dict[str, Any], list[bytes]]:
    """Ask; once more if the process ended by no fault of the file.

    A file that made it hang or die is not tried again as long as it stays as it is.
    """
    state = _state_of(path)
    if state in _State.bad:
        raise FileError(path, _State.bad[state], "it is damaged")
    try:
        for _ in range(2):
            with suppress(EOFError, ConnectionError):
                return _answered(line)
        wrong = "cannot be read: the process that reads it was killed"
        raise FileError(path, wrong, "perhaps for want of memory")
    except _BadError as error:
        _State.bad[state] = str(error)
        raise FileError(path, str(error), "it is damaged") from None


class _BadError(Exception):
    """The library hung or died over a file."""


def _answered(line: bytes) -> tuple[dict[str, Any], list[bytes]]:
    """Ask once; a process that was interrupted in the middle is of no more use."""
    start()
    child = _State.child
    assert child is not None
    done = False
    try:
        answer = _answer(child, line)
        done = True
        return answer
    except TimeoutError:
        text = f"cannot be read: HDF5 does not come to an end in {LIMIT_S:.0f} s"
        raise _BadError(text) from None
    except (EOFError, ConnectionError):
        status = child.process.wait()
        if status in (0, -signal.SIGKILL):
            raise
        raise _BadError(_cause(status)) from None
    finally:
        if not done:
            stop()


def _state_of(path: Path) -> tuple[int, ...]:
    about = path.stat()
    return (about.st_dev, about.st_ino, about.st_size, about.st_mtime_ns)


def _cause(status: int) -> str:
    if status in (-signal.SIGXCPU, -signal.SIGALRM):
        return "cannot be read: HDF5 does not come to an end"
    return "cannot be read: HDF5 breaks down over it"


def _started() -> _Child:
    command = [sys.executable, "-P", "-c", _CODE]
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        bufsize=0,
    )
    child = _Child(process, os.getpid(), time.monotonic() + _START_S)
    assert process.stdin is not None
    with suppress(OSError):  # it died; asking will tell
        process.stdin.write(json.dumps([os.getpid(), sys.path]).encode() + b"\n")
    return child


def _answer(child: _Child, line: bytes) -> tuple[dict[str, Any], list[bytes]]:
    pipe = child.process.stdin
    assert pipe is not None
    pipe.write(line)
    child.deadline = max(child.deadline, time.monotonic() + LIMIT_S)
    answer = json.loads(_part(child))
    blocks = [_part(child) for _ in range(answer["blocks"])]
    child.deadline = 0.0
    return answer, blocks


def _part(child: _Child) -> bytes:
    size = int.from_bytes(_read(child, 8), "little")
    return _read(child, size)


def _read(child: _Child, size: int) -> bytes:
    """Read exactly so many bytes.

    Raises
    ------
    EOFError
        If the process ended.
    TimeoutError
        If it does not answer in time.
    """
    assert child.process.stdout is not None
    fd = child.process.stdout.fileno()
    out = bytearray()
    while len(out) < size:
        left = child.deadline - time.monotonic()
        ready, _, _ = select.select([fd], [], [], max(left, 0.0))
        if not ready:
            raise TimeoutError
        piece = os.read(fd, min(size - len(out), _PIECE_BYTES))
        if not piece:
            raise EOFError
        out += piece
    return bytes(out)
