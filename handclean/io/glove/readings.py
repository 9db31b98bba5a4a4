"""Glove readings: CSV and HDF5, of any length, read a piece at a time.

A CSV of ours begins with ``# handclean readings`` and a JSON object of facts
(``glove``, ``subject``, ``moved``), then a header: ``time_s`` and the sensors. Other
people's files have a header of sensor names, with or without a column of times, or no
header: then columns are the glove's sensors in their order, perhaps after a time [s].
HDF5 files have ``readings`` (T, S) and, if known, ``time`` (T,) [s], ``sensors``, and
the facts as attributes; other people's need not say that they are readings. Blank cells
and nan are missing.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats, expect_shape
from handclean.errors import FileError, Place, UsageError
from handclean.io.hdf5.file import expect_same, open_some, opened, write_h5
from handclean.io.hdf5.numbers import Stored
from handclean.io.hdf5.parts import Array, Part
from handclean.io.shared.clock import SECONDS_SAID, SLOWEST_HZ, Column, time_column
from handclean.io.shared.missing import number_in
from handclean.io.shared.reading import text as as_text
from handclean.io.shared.writing import write_lines

FORMAT = "handclean glove readings"

MARK = "# handclean readings"
"""What a CSV of ours begins with."""

_FRAME = {"frame", "frames", "frameno", "framenumber", "sample"}
_AGREE = 1e-3
_HEAD = 2000
"""Frames whose times tell a rate."""

_ROUNDED = 1e-3
"""[s] to which times may be rounded."""

_LONGEST_LINE = 2**20
_NAME = 40
_NO_READINGS = (
    "has no dataset 'readings' (frames, sensors)",
    "with it may stand 'time' [s] and 'sensors'",
)


_Piece = tuple[Floats, Floats, Sequence[int]]
"""Times, readings, and the number of each frame's line (CSV) or of the frame (HDF5)."""


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
    _clock: Column = SECONDS_SAID
    _skipped: tuple[int, ...] = ()
    _lines: int = 0
    _stored: Mapping[str, Stored] = field(default_factory=dict)

    def chunks(self, size: int) -> Iterator[tuple[Floats, Floats]]:
        """Go through (t,) [s] times and (t, S) readings, so many frames at a time.

        Raises
        ------
        FileError
            If a line is not as the header says, or times do not rise.
        """
        pieces = self._h5(size) if _is_h5(self.path) else self._csv(size)
        last, frames = -math.inf, 0
        for times, values, numbers in pieces:
            if len(times) == 0:
                continue
            blank = ~np.isfinite(times)
            if blank.any():
                at = numbers[int(np.argmax(blank))]
                raise FileError(self._where(at), "is without a time")
            steps = np.diff(times, prepend=last)
            if np.any(steps <= 0.0):
                k = int(np.argmax(steps <= 0.0))
                before = times[k - 1] if k else last
                raise FileError(
                    self._where(numbers[k]),
                    f"its time {times[k]:.10g} s is not later than the {before:.10g} s "
                    "before it",
                    f"without the {self._called_time}, --rate tells",
                )
            last, frames = float(times[-1]), frames + len(times)
            yield times, values
        if frames == 0:
            raise FileError(self.path, "has no readings")

    @property
    def _called_time(self) -> str:
        return "dataset 'time'" if _is_h5(self.path) else "column of times"

    def _where(self, number: int) -> Place:
        what = "frame" if _is_h5(self.path) else "line"
        return Place(self.path, f" {what} {number}")

    @property
    def has_times(self) -> bool:
        """Whether it says when its frames were."""
        return self._time_column >= 0

    def all(self) -> tuple[Floats, Floats]:
        """(T,) [s] times and (T, S) readings of the whole file."""
        pieces = list(self.chunks(100_000))
        return (
            np.concatenate([times for times, _ in pieces]),
            np.concatenate([values for _, values in pieces]),
        )

    def _csv(self, size: int) -> Iterator[_Piece]:
        width = self.columns + len(self._skipped)
        done, rows, numbers = 0, [], []
        with self.path.open("rb") as file:
            for number, line in enumerate(_lines(self.path, file), start=1):
                if number <= self._lines or not line.strip():
                    continue
                rows.append(_numbers(self.path, number, line, width))
                numbers.append(number)
                if len(rows) == size:
                    yield *self._split(np.array(rows), done), numbers
                    done, rows, numbers = done + len(rows), [], []
        if rows:
            yield *self._split(np.array(rows), done), numbers

    def _split(self, grid: Floats, done: int) -> tuple[Floats, Floats]:
        values = np.delete(grid, self._skipped, axis=1)
        if self.has_times:
            return grid[:, self._time_column] * self._clock.seconds, values
        return (done + np.arange(len(grid))) / self.rate, values

    def _h5(self, size: int) -> Iterator[_Piece]:
        readings, time = self._stored["readings"], self._stored.get("time")
        with opened(self.path) as fd:
            expect_same(self.path, fd, readings.state)
            begin = 0
            clock = None if time is None else _pieces(time.bands(fd, size), size)
            for values in _pieces(readings.bands(fd, size), size):
                times = (begin + np.arange(len(values))) / self.rate
                if clock is not None:
                    times = next(clock)
                yield times, values, range(begin + 1, begin + 1 + len(values))
                begin += len(values)
            expect_same(self.path, fd, readings.state)


def _pieces(bands: Iterator[Any], size: int) -> Iterator[Floats]:
    """Cut bands into pieces of so many rows, as floats."""
    kept: list[Floats] = []
    count = 0
    for band in bands:
        rest = np.asarray(band, dtype=np.float64)
        while count + len(rest) >= size:
            kept.append(rest[: size - count])
            rest = rest[size - count :]
            yield np.concatenate(kept)
            kept, count = [], 0
        if len(rest):
            kept.append(rest)
            count += len(rest)
    if kept:
        yield np.concatenate(kept)


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
    found = head_of(path, sensors)
    if found.has_times:
        if rate_hz:
            _expect_rate(found, rate_hz)
        elif not found._clock.says:
            _expect_possible(found)
        return found
    said = rate_said(found.facts)
    if rate_hz and said and abs(rate_hz / said - 1.0) > _AGREE:
        raise UsageError(
            f"--rate {rate_hz:g} Hz, but the file says {said:g} Hz", where=path
        )
    if not (rate_hz or said):
        raise UsageError("has no times; give --rate", where=path)
    return replace(found, rate=float(rate_hz or said or 1.0))


def rate_said(facts: Mapping[str, Any]) -> float | None:
    """[Hz] the rate that a file says of itself, if it says one."""
    said = facts.get("rate_hz")
    if not isinstance(said, int | float) or not 0.0 < said < math.inf:
        return None
    return float(said)


def facts_of(path: Path) -> Mapping[str, Any]:
    """Return what a file of readings says of itself; its rate need not be known.

    Raises
    ------
    FileError
        If there is no such file or it is not one of readings.
    """
    return head_of(path, 0).facts


def head_of(path: Path, sensors: int) -> ReadingsFile:
    """Look at the head of a file whose rate need not be known.

    Parameters
    ----------
    sensors : of the glove; tells a column of times in files without a header.

    Raises
    ------
    FileError
        If there is no such file or it is not one of readings.
    """
    if path.suffix.lower() not in (".csv", ".h5"):
        right = "readings are .csv or .h5"
        raise FileError(path, f"no format is called '{path.suffix}'", right)
    if not path.exists():
        raise FileError(path, "no such file")
    return _open_h5(path) if _is_h5(path) else _open_csv(path, sensors)


def _expect_rate(found: ReadingsFile, rate_hz: float) -> None:
    """Expect times to run at a rate, in the mean or (with frames lost) the median."""
    times, _ = next(found.chunks(_HEAD))
    if len(times) < 2:
        return
    span = float(times[-1] - times[0])
    steps = np.array([span / (len(times) - 1), np.median(np.diff(times))])
    with np.errstate(over="ignore"):
        off = np.abs(steps * rate_hz - 1.0)
    if np.all(off > _AGREE + _ROUNDED / span):
        rate = 1.0 / steps[1] if abs(steps[1] - steps[0]) > 0.1 * steps[0] else 0.0
        raise UsageError(
            f"--rate {rate_hz:g} Hz, but its times run at "
            f"{rate or 1.0 / steps[0]:.4g} Hz",
            where=found.path,
        )


def _expect_possible(found: ReadingsFile) -> None:
    """Expect times without a unit to be seconds: not to run slower than gloves do."""
    times, _ = next(found.chunks(_HEAD))
    if len(times) > 1 and (step := float(np.median(np.diff(times)))) > 1 / SLOWEST_HZ:
        wrong = f"by its times it runs at {1 / step:.3g} Hz, which is no rate"
        right = "call them time_ms if they are milliseconds; --rate says it is right"
        raise FileError(found.path, wrong, right)


def _open_csv(path: Path, sensors: int) -> ReadingsFile:
    facts: dict[str, Any] = {}
    with path.open("rb") as file:
        lines = _lines(path, file)
        skipped = 0
        for line in lines:
            if b"\0" in line or b"\r" in line.rstrip(b"\r\n"):
                wrong = "is not lines of text with their ends as they should be"
                raise FileError(path, wrong, "save it as CSV in UTF-8")
            text = line.decode("utf-8", "replace").strip().lstrip("\ufeff")
            if text.startswith(MARK):
                facts = _facts(path, text.removeprefix(MARK))
            if text and not text.startswith(("#", '"#')):  # quoted by spreadsheets
                break
            skipped += 1
        else:
            raise FileError(path, "has no readings")
    for mark, name in ((";", "semicolons"), ("\t", "tabs")):
        if mark in text:
            right = "save it with commas and decimal points"
            raise FileError(path, f"its cells are parted by {name}", right)
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
    clocks = {k: said for k, cell in enumerate(cells) if (said := time_column(cell))}
    plain = [re.split(r"[(\[]", cell[:_NAME])[0].casefold() for cell in cells]
    others = [k for k, name in enumerate(plain) if name.replace(" ", "") in _FRAME]
    leave = dict.fromkeys((*clocks, *others))
    names = tuple(cell for k, cell in enumerate(cells) if k not in leave)
    double = sorted(name for name, count in Counter(names).items() if count > 1)
    if double or "" in names:
        what = f"'{double[0][:_NAME]}' twice" if double else "a column without a name"
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
        _time_column=next(iter(clocks), -1),
        _clock=next(iter(clocks.values()), SECONDS_SAID),
        _skipped=tuple(leave),
        _lines=skipped + 1,
    )


def _facts(path: Path, text: str) -> dict[str, Any]:
    try:
        found = json.loads(text or "{}")
    except (ValueError, RecursionError):
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
            raise FileError(
                Place(path, f" line {number}"), "is longer than any of readings"
            )
        yield line


def _numbers(path: Path, number: int, line: bytes, width: int) -> list[float]:
    cells = line.rstrip(b"\r\n").split(b",")
    if len(cells) != width:
        raise FileError(
            Place(path, f" line {number}"),
            f"has {len(cells)} cells",
            f"not {width} as above",
        )
    try:
        if b"_" not in line:
            return list(map(float, cells))
    except ValueError:
        pass
    return [_number(path, number, cell) for cell in cells]


def _number(path: Path, number: int, cell: bytes) -> float:
    try:
        return number_in(cell)
    except ValueError:
        wrong = f"'{as_text(cell[:20]).strip()}' is not a number"
        raise FileError(Place(path, f" line {number}"), wrong) from None


def _open_h5(path: Path) -> ReadingsFile:
    try:
        root, stored = open_some(path, ["readings", "time", "sensors"])
    except FileError as error:
        if error.where not in (Place(path) / "readings", Place(path) / "time"):
            raise
        wrong = "should hold numbers of its own"
        raise FileError(error.where, wrong, error.wrong) from None
    name = root.attrs.get("format", FORMAT)
    if name != FORMAT:
        raise FileError(path, f"is a {str(name)[:40]}", "not one of readings")
    for key in ("readings", "time"):
        if root.has(key):
            raise FileError(Place(path) / key, "should hold numbers of its own")
    if "readings" not in stored or len(stored["readings"].shape) != 2:
        raise FileError(path, *_NO_READINGS)
    frames, columns = stored["readings"].shape
    if not columns:
        raise FileError(path, *_NO_READINGS)
    if "time" in stored and stored["time"].shape != (frames,):
        raise FileError(path, f"has {frames} frames and other times")
    if "sensors" in stored:
        raise FileError(
            Place(path) / "sensors", "holds numbers", "not names of sensors"
        )
    names = root.names("sensors") if root.has("sensors") else ()
    if names and len(names) != columns:
        raise FileError(path, f"names {len(names)} sensors for {columns} columns")
    return ReadingsFile(
        path=path,
        sensors=names,
        columns=columns,
        rate=math.nan,
        facts=dict(root.attrs),
        _time_column=0 if "time" in stored else -1,
        _stored=stored,
    )


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
    yield f"{MARK} {json.dumps(dict(facts), ensure_ascii=False)}"
    yield ",".join(["time_s", *sensors])
    for time, row in zip(times.tolist(), readings.tolist(), strict=True):
        cells = ("" if value != value else f"{value:.10g}" for value in row)
        yield f"{time:.6f}," + ",".join(cells)
