"""What the ``c3d`` package reads in a file: a second opinion, in a process of its own.

The package shares no code with `handclean.io.c3d`. It trusts what a file says of
itself, prints, warns and fails in many ways; so it reads in a process whose memory and
time are bounded by the size of the file, and which may die. It is given the bytes, not
the file, so that no read is longer than they are.

The process writes one line of JSON, what the file says of itself, and then the samples
of each frame. More frames than are expected are counted as one.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from handclean.arrays import Floats, Floats32

_START_S = 60.0
"""[s] that starting may take on a busy machine; chosen."""

_BYTES_PER_S = 2**20
"""Bytes that are read in a second at least; c3d 0.6 reads 35 MB (chosen: a 30th)."""

_ROOM_BYTES, _ROOM_SIZES = 2**31, 16
"""[bytes] that the process may take, and how many times the file's size more; chosen:
samples take 20 bytes for the 8 of a point, 8 for the 2 of an analog value."""

_REASON_CHARACTERS = 160
"""Characters of what the package says that a message shows (chosen)."""

_CODE = (
    "import sys, json; asked = json.loads(sys.stdin.buffer.readline()); "
    "sys.path[:] = asked.pop('paths'); "
    "from handclean.io.c3d.witness import serve; serve(**asked)"
)


class UnreadError(Exception):
    """The package cannot read the file."""


@dataclass(frozen=True, kw_only=True)
class Witness:
    """What the package reads.

    Attributes
    ----------
    rate, analog_rate : [Hz].
    first_frame : number of the first frame.
    frames : that it reads; where it reads more than are expected, that it speaks of.
    labels, analog_labels : None where it gives none.
    header_events, group_events : time [s] as stored, and label.
    points : (T, P, 5) x, y, z and residual in the file's unit, residual -1 where the
        point is missing, camera mask.
    analog : (T, samples x channels) in the channels' units.
    """

    rate: float
    analog_rate: float
    first_frame: int
    frames: int
    labels: list[str] | None
    analog_labels: list[str] | None
    header_events: list[tuple[float, str]]
    group_events: list[tuple[float, str]]
    points: Floats32
    analog: Floats


def read_witness(path: Path, frames: int) -> Witness:
    """Let the package read a file.

    Parameters
    ----------
    frames : that are expected.

    Raises
    ------
    UnreadError
        If it cannot, with its reason.
    """
    size = path.stat().st_size
    seconds = int(_START_S + size / _BYTES_PER_S)
    asked = {
        "path": os.fsencode(os.path.abspath(path)).hex(),
        "frames": frames,
        "seconds": seconds,
        "room": _ROOM_BYTES + _ROOM_SIZES * size,
        "paths": sys.path,
    }
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-W", "ignore", "-c", _CODE],
            input=json.dumps(asked).encode() + b"\n",
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=seconds,
            check=False,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired:
        raise UnreadError(f"it does not come to an end in {seconds} s") from None
    end = done.stdout.find(b"\n") + 1
    try:
        said = json.loads(done.stdout[:end])
    except ValueError:
        raise UnreadError("it breaks down over it") from None
    if "unread" in said:
        raise UnreadError(said["unread"])
    try:
        return _witness(said, done.stdout, end)
    except (KeyError, TypeError, ValueError):
        raise UnreadError("it breaks down over it") from None


def _witness(said: dict[str, Any], answer: bytes, at: int) -> Witness:
    points, analog = said.pop("points"), said.pop("analog")
    count = said.pop("counted")
    row = np.dtype([("points", "<f4", (points, 5)), ("analog", "<f8", (analog,))])
    table = np.frombuffer(answer, row, count, at) if count else np.zeros(0, row)
    for name in ("header_events", "group_events"):
        said[name] = [(float(time), str(label)) for time, label in said[name]]
    return Witness(points=table["points"], analog=table["analog"], **said)


class _Bytes(BytesIO):
    """A file in memory that refuses what a file refuses."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size < -1:
            raise ValueError("read length must be non-negative or -1")
        return super().read(size)


def serve(path: str, frames: int, seconds: int, room: int) -> None:
    """Read one file and write what is in it; the process's whole work."""
    out = os.fdopen(os.dup(1), "wb")
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)  # the package prints
    _bound(seconds, room)
    try:
        said, rows = _read(Path(os.fsdecode(bytes.fromhex(path))), frames)
    except BaseException as error:  # whatever it does, it is one line
        text = " ".join(f"{type(error).__name__}: {error}".split())
        said, rows = {"unread": text[:_REASON_CHARACTERS]}, []
    _write(out, said, rows)


def _write(out: BinaryIO, said: dict[str, Any], rows: Iterable[bytes]) -> None:
    with suppress(BrokenPipeError):
        out.write(json.dumps(said).encode() + b"\n")
        out.writelines(rows)
        out.flush()


def _bound(seconds: int, room: int) -> None:
    """Bound processor time and memory, where the system can."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_AS, (room, room))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _read(path: Path, frames: int) -> tuple[dict[str, Any], list[bytes]]:
    import c3d

    np.seterr(all="ignore")
    reader = c3d.Reader(_Bytes(path.read_bytes()))
    rows: list[bytes] = []
    shape = (0, 0)
    for _, points, analog in reader.read_frames(copy=False):
        analog = np.asarray(analog, "<f8").T
        if rows and shape != (len(points), analog.size):
            raise ValueError("its frames differ in size")
        shape = (len(points), analog.size)
        rows.append(points.astype("<f4").tobytes() + analog.tobytes())
        if len(rows) > frames:
            break
    more = len(rows) > frames
    said = {
        "rate": float(reader.point_rate),
        "analog_rate": float(reader.analog_rate) if reader.analog_used else 0.0,
        "first_frame": int(reader.first_frame),
        "frames": int(reader.frame_count) if more else len(rows),
        "counted": len(rows),
        "points": shape[0],
        "analog": shape[1],
        "labels": _given(lambda: _texts(reader.point_labels)),
        "analog_labels": _given(lambda: _texts(reader.analog_labels)),
        "header_events": _given(lambda: _header_events(reader)) or [],
        "group_events": _given(lambda: _group_events(reader)) or [],
    }
    return said, rows


def _given(part: Callable[[], Any]) -> Any:
    """A part that a file may not have, None if it has not."""
    try:
        return part()
    except (AttributeError, IndexError, TypeError, ValueError, AssertionError):
        return None


def _texts(values: Any) -> list[str]:
    return [_stripped(value) for value in np.asarray(values, object).ravel().tolist()]


def _stripped(value: Any) -> str:
    return str(value).partition("\0")[0].strip()


def _header_events(reader: Any) -> list[tuple[float, str]]:
    header = reader.header
    pairs = zip(header.event_timings, header.event_labels, strict=True)
    return [(float(time), _stripped(label)) for time, label in pairs]


def _group_events(reader: Any) -> list[tuple[float, str]]:
    times = np.asarray(reader.get("EVENT:TIMES").float_array, float).reshape(-1, 2)
    labels = _given(lambda: _texts(reader.get("EVENT:LABELS").string_array)) or []
    labels += [""] * (len(times) - len(labels))
    seconds = 60.0 * times[:, 0] + times[:, 1]
    return list(zip(seconds.tolist(), labels[: len(times)], strict=True))
