"""The process that `handclean.io.hdf5.walker` starts: it walks files it is asked for.

Its memory and time are bounded, and it ends with the process that asks.
"""

import json
import os
import signal
import struct
import sys
from contextlib import suppress
from typing import Any

from handclean.io.hdf5.walk import BROKEN, Refused, most, walk

LIMIT_S = 20
"""[s] a file over which HDF5 takes longer is given up (chosen; as in `walker`)."""

_LOOP_CPU_S = 1
"""[s] of processor time that no one object needs (chosen)."""

_LIBRARY_BYTES = 2**24
"""[bytes] of memory for the library itself (chosen)."""

HEAD = struct.Struct("<Q")
"""Before each part of an answer: its size [bytes]. The JSON says how many follow."""


def serve(parent: int) -> None:
    """Answer requests, a line of JSON each, until there are no more."""
    _end_with(parent)
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    for line in sys.stdin.buffer:
        answer, blocks = _answered(json.loads(line))
        head = json.dumps({**answer, "blocks": len(blocks)}).encode()
        for part in (head, *blocks):
            out.write(HEAD.pack(len(part)))
            out.write(part)
        out.flush()
        signal.setitimer(signal.ITIMER_REAL, 0)


def _answered(request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S + 2)  # should nobody listen any more
    path = os.fsdecode(bytes.fromhex(request["path"]))
    try:
        _limit_memory(path)
        _expect_to_end()
        return walk(
            path, only=request["only"], keys=request["keys"], begin=_expect_to_end
        )
    except Refused as error:
        return {"refused": error.args}, []
    except BROKEN as error:
        reason = (str(error).splitlines() or [""])[0] or type(error).__name__
        return {"broken": reason[:200]}, []


def _expect_to_end() -> None:
    """Let the system end this process if HDF5 turns round in a ring.

    It is deaf to Python's signals then.
    """
    import resource

    used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used) + 1 + _LOOP_CPU_S, hard))


def _limit_memory(path: str) -> None:
    """Take no more memory than a file of that size may need."""
    import resource

    with suppress(OSError, ValueError):
        with open("/proc/self/statm") as file:
            now = int(file.read().split()[0]) * resource.getpagesize()
        room = _LIBRARY_BYTES + most(os.stat(path).st_size)
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (now + room, hard))


def _end_with(parent: int) -> None:
    """Die with the process that asks, however it ends, and of signals at once."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGALRM])
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        os._exit(0)
