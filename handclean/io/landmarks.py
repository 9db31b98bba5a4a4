"""Landmarks on a scan: TOML, ``name = [x, y, z]``, in the scan's own coordinates.

Their unit is the scan's, unless the file says another: ``unit = "mm"``.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.io.shared.settle import in_metres, named_unit
from handclean.tomlfile import read_table


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
    content = read_table(path, "not landmarks")
    stated = content.text("unit", unit)
    known = named_unit(stated)
    if known is None:
        raise content.wrong("unit", "it should be mm, cm or m")
    names = [name for name in content if name != "unit"]
    if not names:
        raise FileError(path, "has no landmarks", "write name = [x, y, z]")
    right = "a landmark is three numbers"
    return {
        name: in_metres(np.array(content.vector(name, 3, right=right)), known)
        for name in names
    }


def write_landmarks(path: Path, landmarks: Mapping[str, Floats]) -> None:
    """Write landmarks (3,) [m] in metres."""
    lines = ['unit = "m"']
    for name, place in landmarks.items():
        x, y, z = (repr(round(float(part), 7)) for part in place)
        lines.append(f"{name} = [{x}, {y}, {z}]")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
