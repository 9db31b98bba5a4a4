"""A glove's readings as HDF5: ours, and other people's that name them alike."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, Place
from handclean.io.glove.readings_file import FORMAT, Piece, ReadingsFile
from handclean.io.hdf5.file import open_some
from handclean.io.hdf5.numbers import Stored
from handclean.io.hdf5.opening import expect_same, opened

_NO_READINGS = (
    "has no dataset 'readings' (frames, sensors)",
    "with it may stand 'time' [s] and 'sensors'",
)


@dataclass(frozen=True, kw_only=True)
class H5Readings(ReadingsFile):
    """Readings in HDF5; ``stored`` are its datasets of numbers."""

    row: ClassVar[str] = "frame"
    clock_name: ClassVar[str] = "dataset 'time'"
    stored: Mapping[str, Stored] = field(default_factory=dict)

    @property
    def has_times(self) -> bool:
        """Whether it has a dataset of times."""
        return "time" in self.stored

    @property
    def says_time_unit(self) -> bool:
        """Whether it says in what unit its times are: seconds are agreed on."""
        return True

    def pieces(self, size: int) -> Iterator[Piece]:
        """Go through times, readings and numbers of frames."""
        readings, time = self.stored["readings"], self.stored.get("time")
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


def open_h5(path: Path) -> H5Readings:
    """Look at the head of an HDF5 file.

    Raises
    ------
    FileError
        If it is not one of readings.
    """
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
    return H5Readings(
        path=path,
        sensors=names,
        columns=columns,
        rate=math.nan,
        facts=dict(root.attrs),
        stored=stored,
    )
