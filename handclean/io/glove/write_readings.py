"""A glove's readings written as CSV or HDF5."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from handclean.arrays import Floats, expect_shape
from handclean.io.glove.readings_file import FORMAT, MARK
from handclean.io.hdf5.file import write_h5
from handclean.io.hdf5.parts import Array, Part
from handclean.io.shared.writing import write_lines


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
    if path.suffix.lower() == ".h5":
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
