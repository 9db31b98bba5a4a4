"""Landmarks on a scan: TOML, ``name = [x, y, z]``, in the scan's own coordinates.

Their unit is the scan's, unless the file says another: ``unit = "mm"``.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.io.shared.reading import in_metres, named_unit
from handclean.toml import read_toml


def read_landmarks(path: Path, unit: str) -> dict[str, Floats]:
    """Read landmarks.

    Parameters
    ----------
    unit : of the scan, which holds where the file does not say another.

    Returns
    -------
    (3,) [m] by name.

    Raises
    ------
    FileError
        If it is not such a file.
    """
    content = read_toml(path, "not landmarks")
    stated = content.pop("unit", unit)
    known = named_unit(stated) if isinstance(stated, str) else None
    if known is None:
        raise FileError(path, f"the unit is {stated!r:.60}", "it should be mm, cm or m")
    if not content:
        raise FileError(path, "has no landmarks", "write name = [x, y, z]")
    return {
        name: in_metres(_place(path, name, value), known)
        for name, value in content.items()
    }


def _place(path: Path, name: str, value: Any) -> Floats:
    is_list = isinstance(value, list) and len(value) == 3
    if is_list and all(type(part) in (int, float) for part in value):
        place: Floats = np.array(value, dtype=np.float64)
        if np.isfinite(place).all():
            return place
    raise FileError(path, f"{name} is {value!r:.60}", "a landmark is three numbers")


def write_landmarks(path: Path, landmarks: Mapping[str, Floats]) -> None:
    """Write landmarks (3,) [m] in metres."""
    lines = ['unit = "m"']
    for name, place in landmarks.items():
        x, y, z = (repr(round(float(part), 7)) for part in place)
        lines.append(f"{name} = [{x}, {y}, {z}]")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
