"""Glove readings: CSV and HDF5, of any length, read a piece at a time.

A CSV of ours begins with ``# handclean readings`` and a JSON object of facts
(``glove``, ``subject``, ``moved``), then a header: ``time_s`` and the sensors. Other
people's files have a header of sensor names, with or without a column of times, or no
header: then columns are the glove's sensors in their order, perhaps after a time [s].
HDF5 files have ``readings`` (T, S) and, if known, ``time`` (T,) [s], ``sensors``, and
the facts as attributes. Blank cells and nan are missing.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from handclean.arrays import Floats, expect_shape
from handclean.errors import FileError, UsageError
from handclean.io.h5 import format_of, write_h5
from handclean.io.parts import Array, Part
from handclean.io.writing import write_lines

FORMAT = "handclean glove readings"

_MARK = "# handclean readings"
_TIME = {"time", "times", "time_s", "timesec", "timeseconds", "t"}
_FRAME = {"frame", "frames", "frameno", "framenumber", "sample"}
_AGREE = 1e-3
_LONGEST_LINE = 2**20


@dataclass(frozen=True, kw_only=True)
class ReadingsFile:
    """What a file of readings says before its numbers.

    Attributes
    ----------
    path : the file.
    sensors : names of its columns of readings; empty if it has no header.
    columns : how many columns of readings there are.
    rate : [Hz] for files without times; nan for those with.
    facts : what else it says of itself.
    """

    path: Path
    sensors: tuple[str, ...]
    columns: int
    rate: float
    facts: Mapping[str, Any] = field(default_factory=dict)
    _time_column: int = -1
    _skipped: tuple[int, ...] = ()
    _lines: int = 0

    def chunks(self, size: int) -> Iterator[tuple[Floats, Floats]]:
        """Go through (t,) [s] times and (t, S) readings, so many frames at a time.

        Raises
        ------
        FileError
            If a line is not as the header says, or times do not rise.
        """
        pieces = self._h5(size) if _is_h5(self.path) else self._csv(size)
        last, frames = -math.inf, 0
        for times, values in pieces:
            if len(times) == 0:
                continue
            if not np.isfinite(times).all():
                raise FileError(self.path, "has frames without a time")
            steps = np.diff(times, prepend=last if frames else times[0] - 1.0)
            if np.any(steps <= 0.0):
                at = frames + int(np.argmax(steps <= 0.0)) + 1
                raise FileError(
                    self.path, f"frame {at} is not later than the one before it"
                )
            last, frames = float(times[-1]), frames + len(times)
            yield times, values
        if frames == 0:
            raise FileError(self.path, "has no readings")

    def all(self) -> tuple[Floats, Floats]:
        """(T,) [s] times and (T, S) readings of the whole file."""
        pieces = list(self.chunks(100_000))
        return (
            np.concatenate([times for times, _ in pieces]),
            np.concatenate([values for _, values in pieces]),
        )

    def _csv(self, size: int) -> Iterator[tuple[Floats, Floats]]:
        width = self.columns + len(self._skipped)
        done, rows = 0, []
        with self.path.open("rb") as file:
            for number, line in enumerate(_lines(self.path, file), start=1):
                if number <= self._lines or not line.strip():
                    continue
                rows.append(_numbers(self.path, number, line, width))
                if len(rows) == size:
                    yield self._split(np.array(rows), done)
                    done, rows = done + len(rows), []
        if rows:
            yield self._split(np.array(rows), done)

    def _split(self, grid: Floats, done: int) -> tuple[Floats, Floats]:
        values = np.delete(grid, self._skipped, axis=1)
        if self._time_column >= 0:
            return grid[:, self._time_column].copy(), values
        return (done + np.arange(len(grid))) / self.rate, values

    def _h5(self, size: int) -> Iterator[tuple[Floats, Floats]]:
        with _opened(self.path) as file:
            readings = file["readings"]
            for begin in range(0, len(readings), size):
                rows = slice(begin, begin + size)
                values = np.asarray(readings[rows], dtype=np.float64)
                if "time" in file:
                    yield np.asarray(file["time"][rows], dtype=np.float64), values
                else:
                    yield (begin + np.arange(len(values))) / self.rate, values


def _is_h5(path: Path) -> bool:
    return path.suffix.lower() == ".h5"


def open_readings(
    path: Path, *, rate_hz: float | None = None, sensors: int = 0
) -> ReadingsFile:
    """Look at the head of a file of readings.

    Parameters
    ----------
    rate_hz : [Hz] for files without times.
    sensors : of the glove; tells a column of times in files without a header.

    Raises
    ------
    FileError
        If there is no such file or it is not one of readings.
    UsageError
        If the rate is needed and not given, or contradicts the file.
    """
    if path.suffix.lower() not in (".csv", ".h5"):
        right = "readings are .csv or .h5"
        raise FileError(path, f"no format is called '{path.suffix}'", right)
    if not path.exists():
        raise FileError(path, "no such file")
    found = _open_h5(path) if _is_h5(path) else _open_csv(path, sensors)
    times = found._time_column >= 0
    said = found.facts.get("rate_hz")
    said = float(said) if isinstance(said, int | float) and said > 0 else None
    if rate_hz and said and abs(rate_hz / said - 1.0) > _AGREE:
        raise UsageError(
            f"{path}: --rate {rate_hz:g} Hz, but the file says {said:g} Hz"
        )
    if not times and not (rate_hz or said):
        raise UsageError(f"{path}: has no times; give --rate")
    return _with_rate(found, math.nan if times else float(rate_hz or said or 1.0))


def is_readings(path: Path) -> bool:
    """Whether a CSV says that it holds readings."""
    try:
        with path.open("rb") as file:
            return (
                file.read(len(_MARK) + 3)
                .lstrip(b"\xef\xbb\xbf")
                .startswith(_MARK.encode())
            )
    except OSError:
        return False


def inspect_readings(path: Path, rate_hz: float | None) -> dict[str, Any]:
    """Return what is in a file of readings, as plain JSON values.

    Raises
    ------
    FileError, UsageError
        If it cannot be read, or its rate is not known.
    """
    found = open_readings(path, rate_hz=rate_hz)
    frames, blank, first, last = 0, 0, math.nan, math.nan
    low, high = np.full(found.columns, np.inf), np.full(found.columns, -np.inf)
    for times, values in found.chunks(50_000):
        first = float(times[0]) if frames == 0 else first
        last = float(times[-1])
        frames += len(times)
        blank += int(np.isnan(values).sum())
        low, high = np.fmin(low, values.min(axis=0)), np.fmax(high, values.max(axis=0))
    rate = (frames - 1) / (last - first) if frames > 1 else None
    still = [s for s, a, b in zip(found.sensors, low, high, strict=False) if a == b]
    traps = [f"{name} never changes" for name in still]
    if blank:
        traps.append(f"{blank} readings are missing")
    return {
        "format": "glove readings",
        "frames": frames,
        "rate": rate,
        "duration_s": frames / rate if rate else None,
        "sensors": list(found.sensors),
        "facts": dict(found.facts),
        "traps": traps,
    }


def _with_rate(found: ReadingsFile, rate: float) -> ReadingsFile:
    parts = {name: getattr(found, name) for name in found.__dataclass_fields__}
    return ReadingsFile(**{**parts, "rate": rate})


def _open_csv(path: Path, sensors: int) -> ReadingsFile:
    facts: dict[str, Any] = {}
    with path.open("rb") as file:
        lines = _lines(path, file)
        skipped = 0
        for line in lines:
            text = line.decode("utf-8", "replace").strip().lstrip("\ufeff")
            if text.startswith(_MARK):
                facts = _facts(path, text.removeprefix(_MARK))
            if text and not text.startswith("#"):
                break
            skipped += 1
        else:
            raise FileError(path, "has no readings")
    cells = [cell.strip().strip('"') for cell in text.split(",")]
    if all(_is_number(cell) for cell in cells):
        first = len(cells) == sensors + 1
        return ReadingsFile(
            path=path,
            sensors=(),
            columns=len(cells) - first,
            rate=math.nan,
            facts=facts,
            _time_column=0 if first else -1,
            _skipped=(0,) if first else (),
            _lines=skipped,
        )
    plain = [
        cell.casefold().replace(" ", "").split("(")[0].split("[")[0] for cell in cells
    ]
    times = [k for k, name in enumerate(plain) if name in _TIME]
    others = [k for k, name in enumerate(plain) if name in _FRAME]
    leave = (*times, *others)
    names = tuple(cell for k, cell in enumerate(cells) if k not in leave)
    double = sorted({name for name in names if names.count(name) > 1})
    if double or "" in names:
        what = f"'{double[0]}' twice" if double else "a column without a name"
        raise FileError(
            path, f"has {what}", "every sensor should have a name of its own"
        )
    if not names:
        raise FileError(path, "has no column of readings")
    return ReadingsFile(
        path=path,
        sensors=names,
        columns=len(names),
        rate=math.nan,
        facts=facts,
        _time_column=times[0] if times else -1,
        _skipped=leave,
        _lines=skipped + 1,
    )


def _facts(path: Path, text: str) -> dict[str, Any]:
    try:
        found = json.loads(text or "{}")
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise FileError(path, "its first line is damaged: no JSON object")
    return found


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _lines(path: Path, file: Any) -> Iterator[bytes]:
    number = 0
    while line := file.readline(_LONGEST_LINE):
        number += 1
        if len(line) == _LONGEST_LINE:
            raise FileError(f"{path} line {number}", "is longer than any of readings")
        yield line


def _numbers(path: Path, number: int, line: bytes, width: int) -> list[float]:
    cells = line.rstrip(b"\r\n").split(b",")
    if len(cells) != width:
        raise FileError(
            f"{path} line {number}", f"has {len(cells)} cells", f"not {width} as above"
        )
    try:
        return [float(cell) if cell.strip() else math.nan for cell in cells]
    except ValueError:
        wrong = next(c for c in cells if not _is_number(c.decode("utf-8", "replace")))
        shown = wrong[:20].decode("utf-8", "replace").strip()
        raise FileError(f"{path} line {number}", f"'{shown}' is not a number") from None


def _open_h5(path: Path) -> ReadingsFile:
    if (name := format_of(path)) != FORMAT:
        raise FileError(path, f"is a {name[:40]}", "not one of readings")
    with _opened(path) as file:
        readings = file.get("readings")
        if not isinstance(readings, h5py.Dataset) or readings.ndim != 2:
            raise FileError(path, "has no readings (T, S)")
        if "time" in file and file["time"].shape != readings.shape[:1]:
            raise FileError(path, f"has {len(readings)} frames and other times")
        names = _names(file)
        if names and len(names) != readings.shape[1]:
            raise FileError(
                path, f"names {len(names)} sensors for {readings.shape[1]} columns"
            )
        facts = {k: _plain(v) for k, v in file.attrs.items()}
        timed = "time" in file
        return ReadingsFile(
            path=path,
            sensors=names,
            columns=int(readings.shape[1]),
            rate=math.nan,
            facts=facts,
            _time_column=0 if timed else -1,
        )


def _opened(path: Path) -> Any:
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as error:
        reason = str(error).splitlines()[0]
        raise FileError(path, f"cannot be read as HDF5 ({reason})") from None


def _names(file: Any) -> tuple[str, ...]:
    if "sensors" not in file:
        return ()
    return tuple(
        name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
        for name in file["sensors"][()]
    )


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value.tolist() if hasattr(value, "tolist") else value


def write_readings(
    path: Path,
    times: Floats,
    readings: Floats,
    sensors: Sequence[str],
    facts: Mapping[str, Any],
) -> None:
    """Write readings as CSV or HDF5.

    Parameters
    ----------
    times : (T,) [s]; readings : (T, S).
    facts : what else to say, plain JSON values.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    expect_shape("readings", readings, len(times), len(sensors))
    if _is_h5(path):
        items: dict[str, Any] = {
            "readings": Array(readings),
            "time": Array(times, "s"),
            "sensors": list(sensors),
        }
        plain = {
            key: value if isinstance(value, str | int | float) else "+".join(value)
            for key, value in facts.items()
        }
        write_h5(path, FORMAT, Part(plain, items))
        return
    write_lines(path, _csv_lines(times, readings, sensors, facts))


def _csv_lines(
    times: Floats, readings: Floats, sensors: Sequence[str], facts: Mapping[str, Any]
) -> Iterator[str]:
    yield f"{_MARK} {json.dumps(dict(facts), ensure_ascii=False)}"
    yield ",".join(["time_s", *sensors])
    for time, row in zip(times.tolist(), readings.tolist(), strict=True):
        cells = ("" if value != value else f"{value:.10g}" for value in row)
        yield f"{time:.6f}," + ",".join(cells)
